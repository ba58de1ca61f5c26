#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace castor {

/// A whole file in memory, read-only, without a copy: pages come from the page cache as they are touched.
/// The file must not shrink meanwhile (the system ends programs that touch what is no longer there).
class MappedFile {
public:
    /// Throws SceneError where the file is missing, not a regular file, or cannot be read. An empty file is fine.
    explicit MappedFile(const std::filesystem::path& file);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;

    /// All bytes; valid as long as this object lives.
    std::string_view bytes() const { return {data_, size_}; }

    /// Tells the system that [begin, end) of these bytes have been read, so that they need not stay resident. Whoever
    /// reads them again finds the same.
    void release(const char* begin, const char* end) const;

private:
    const char* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace castor
