#include "base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "castor/error.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, std::string_view step, int code) {
    throw FileError(file.string(), fmt::format("{}: {}", step, std::generic_category().message(code)));
}

/// An open file that is closed with its owner.
class Descriptor {
public:
    Descriptor() = default;
    Descriptor(const fs::path& path, int flags) : value_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
    ~Descriptor() {
        if (value_ >= 0) ::close(value_);
    }
    Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(value_, other.value_);
        return *this;
    }

    bool is_open() const { return value_ >= 0; }
    int get() const { return value_; }
    /// The result of close(2), which may be the first to report that a disk is full.
    int close() { return ::close(std::exchange(value_, -1)); }

private:
    int value_ = -1;
};

using Pieces = std::span<const std::span<const std::byte>>;

/// Writes all bytes, or returns the error's number.
int write_piece(int descriptor, std::span<const std::byte> bytes, ProgressCount& bytes_done) {
    constexpr std::size_t kMostAtOnce = std::size_t{4} << 20;
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor, bytes.data(), std::min(bytes.size(), kMostAtOnce));
        if (written == 0) return EIO;
        if (written < 0 && errno != EINTR) return errno;
        if (written < 0) continue;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
        bytes_done.add(static_cast<std::uint64_t>(written));
    }
    return 0;
}

int write_all(int descriptor, Pieces pieces, const Progress& progress) {
    std::uint64_t total = 1;
    for (const std::span<const std::byte> piece : pieces) total += piece.size();
    ProgressCount bytes_done(progress, total);
    for (const std::span<const std::byte> piece : pieces)
        if (const int code = write_piece(descriptor, piece, bytes_done)) return code;
    return 0;
}

/// What stands at the path, links followed; false if nothing does.
bool find_status(const fs::path& path, struct stat& status) {
    if (::stat(path.c_str(), &status) == 0) return true;
    if (errno != ENOENT) fail(path, "cannot be written", errno);
    return false;
}

/// The file itself where `file` is a link to it.
fs::path resolve(const fs::path& file) {
    std::error_code ignored;
    if (!fs::is_symlink(file, ignored)) return file;
    const fs::path target = fs::canonical(file, ignored);
    return ignored ? file : target;
}

void write_in_place(const fs::path& file, Pieces pieces, const Progress& progress) {
    Descriptor output(file, O_WRONLY);
    if (!output.is_open()) fail(file, "cannot be opened for writing", errno);
    if (const int code = write_all(output.get(), pieces, progress)) fail(file, "cannot be written", code);
    if (output.close() != 0) fail(file, "cannot be written", errno);
}

/// A new, empty file beside the target, removed at the end of its life unless it took the target's place.
class TemporaryFile {
public:
    explicit TemporaryFile(const fs::path& target) {
        // A process of the same number may have been killed and left its file: in a container numbers come again.
        do {
            path_ = target.parent_path() / temporary_name();
            output_ = Descriptor(path_, O_WRONLY | O_CREAT | O_EXCL);
        } while (!output_.is_open() && errno == EEXIST);
        if (!output_.is_open()) fail(target, "cannot be created", errno);
    }
    ~TemporaryFile() {
        if (!moved_) ::unlink(path_.c_str());
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    void fill(const fs::path& target, Pieces pieces, const Progress& progress) {
        if (const int code = write_all(output_.get(), pieces, progress)) fail(target, "cannot be written", code);
        if (::fsync(output_.get()) != 0) fail(target, "cannot be flushed to the disk", errno);
        if (output_.close() != 0) fail(target, "cannot be written", errno);
    }
    void keep_mode(mode_t mode) { ::fchmod(output_.get(), mode & 07777); }
    void move_to(const fs::path& target) {
        if (::rename(path_.c_str(), target.c_str()) != 0) fail(target, "cannot be replaced", errno);
        moved_ = true;
    }

private:
    static std::string temporary_name() {
        static std::atomic<unsigned> count = 0;
        return fmt::format(".castor-{}-{}.tmp", ::getpid(), count++);
    }

    fs::path path_;
    Descriptor output_;
    bool moved_ = false;
};

/// Whether the target can be replaced by a new file; it is written in place where not. Throws FileError where neither
/// goes.
bool is_replaceable(const fs::path& target, struct stat& status, bool& exists) {
    if (target.filename().empty()) fail(target, "cannot be written", EISDIR);
    exists = find_status(target, status);
    if (!exists) return true;
    if (S_ISDIR(status.st_mode)) fail(target, "cannot be written", EISDIR);
    // A file that its owner made read-only is not replaced, although the folder would allow it.
    if (::faccessat(AT_FDCWD, target.c_str(), W_OK, AT_EACCESS) != 0) fail(target, "cannot be written", errno);
    return S_ISREG(status.st_mode);
}

}  // namespace

void write_file_atomically(const fs::path& file, std::span<const std::byte> bytes) {
    write_file_atomically(file, std::span(&bytes, 1));
}

void write_file_atomically(const fs::path& file, std::span<const std::span<const std::byte>> pieces,
                           const Progress& progress) {
    const fs::path target = resolve(file);
    struct stat status {};
    bool exists = false;
    if (!is_replaceable(target, status, exists)) {
        write_in_place(target, pieces, progress);
        return progress.reach(1.0);
    }
    TemporaryFile temporary(target);
    if (exists) temporary.keep_mode(status.st_mode);
    temporary.fill(target, pieces, progress);
    progress.reach(1.0);  // the last chance to leave the old file
    temporary.move_to(target);
}

void check_writable(const fs::path& file) {
    const fs::path target = resolve(file);
    struct stat status {};
    bool exists = false;
    if (is_replaceable(target, status, exists)) TemporaryFile probe(target);
}

}  // namespace castor
