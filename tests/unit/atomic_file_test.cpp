// Files that are replaced in one step, or not at all.
#include "base/atomic_file.h"

#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "castor/error.h"
#include "support/catch.h"
#include "support/child_process.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
    write_file_atomically(file, std::as_bytes(std::span(text)));
}

std::size_t files_in(const fs::path& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// Files may have so many bytes as long as this lives.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) : before_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, before_handler_);
    }

private:
    rlimit before_{};
    void (*before_handler_)(int);
};

}  // namespace

TEST_CASE("a file that does not fit leaves the old one, and nothing beside it", "[atomic_file]") {
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "f";
    write(file, "old");
    {
        const FileSizeLimit limit(10000);
        CHECK_THROWS_WITH(write(file, std::string(10001, 'x')), Catch::Matchers::Contains("File too large"));
        CHECK(file_contents(file) == "old");
        CHECK(files_in(folder.path()) == 1);
        write(file, std::string(10000, 'y'));
    }
    CHECK(file_contents(file) == std::string(10000, 'y'));
    CHECK(files_in(folder.path()) == 1);
    CHECK_THROWS_WITH(write("/dev/full", "text"), Catch::Matchers::Contains("No space left on device"));
}

TEST_CASE("unfinished files of a killed process of the same number are not in the way", "[atomic_file]") {
    const TemporaryDirectory folder;
    for (int i = 0; i < 100; ++i)
        folder.write(".castor-" + std::to_string(::getpid()) + "-" + std::to_string(i) + ".tmp", "unfinished");
    for (int i = 0; i < 3; ++i) {
        write(folder.path() / "f", "text");
        CHECK(file_contents(folder.path() / "f") == "text");
    }
    check_writable(folder.path() / "g");
    CHECK(files_in(folder.path()) == 101);
}

}  // namespace castor::test
