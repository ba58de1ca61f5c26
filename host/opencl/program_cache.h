#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/device.h"

namespace castor {

/// Compiled programs that outlive the process, one file each. A file that is damaged, of another version, or of another
/// program whose key happens to have the same hash, counts as missing. Nothing here throws: a cache that cannot be used
/// is as good as an empty one. Safe to use from several threads and processes.
class ProgramCache {
public:
    using Binary = std::vector<unsigned char>;

    /// Without a folder nothing is kept. The folder is made when something is first stored.
    explicit ProgramCache(std::filesystem::path folder = {}) : folder_(std::move(folder)) {}

    bool is_on() const { return !folder_.empty(); }

    std::optional<Binary> find(std::string_view key) const noexcept;
    void store(std::string_view key, const Binary& binary) const noexcept;
    void forget(std::string_view key) const noexcept;

    /// Where the program of `key` stands if it is there.
    std::filesystem::path file_of(std::string_view key) const;

private:
    std::filesystem::path folder_;
};

/// All that a compiled program depends on.
std::string program_cache_key(const Device& device, std::string_view source, std::string_view options);

/// programs/ in the folder that CASTOR_CACHE_DIR names, or else in castor/ of $XDG_CACHE_HOME or ~/.cache. Empty, for
/// no cache, where CASTOR_CACHE_DIR is set and empty, or there is no home.
std::filesystem::path program_cache_folder();

}  // namespace castor
