#include "base/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "castor/error.h"

namespace castor {

namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, int error) {
    throw SceneError(file.string(), 0, std::string("cannot be read: ") + std::strerror(error));
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file) {
    // Not blocking: opening a pipe that nobody writes to must not hang.
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) refuse(file, errno);
    struct stat status {};
    int error = ::fstat(descriptor, &status) == 0 ? 0 : errno;
    const bool regular = S_ISREG(status.st_mode);
    if (error == 0 && regular && status.st_size > 0) {
        size_ = static_cast<std::size_t>(status.st_size);
        void* memory = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
        if (memory == MAP_FAILED) {
            error = errno;
        } else {
            data_ = static_cast<const char*>(memory);
        }
    }
    ::close(descriptor);
    if (error != 0) refuse(file, error);
    if (!regular) throw SceneError(file.string(), 0, "cannot be read: not a regular file");
}

MappedFile::~MappedFile() {
    if (data_ != nullptr) ::munmap(const_cast<char*>(data_), size_);
}

void MappedFile::release(const char* begin, const char* end) const {
    static const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    // Whole pages only: others may be reading what else the first and the last have.
    const std::size_t first = (static_cast<std::size_t>(begin - data_) + page - 1) / page * page;
    const std::size_t last = static_cast<std::size_t>(end - data_) / page * page;
    if (first < last) ::madvise(const_cast<char*>(data_) + first, last - first, MADV_DONTNEED);
}

}  // namespace castor
