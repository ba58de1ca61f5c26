#include "opencl/program_cache.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <span>
#include <system_error>

#include "base/atomic_file.h"
#include "base/checksum.h"
#include "base/user_folder.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

constexpr char kMagic[8] = {'C', 'A', 'S', 'T', 'O', 'R', 'P', 'C'};
constexpr std::uint32_t kFormatVersion = 1;

/// What a file begins with; the key and then the binary follow. In the byte order of the machine, as the binary is.
struct Header {
    char magic[8];
    std::uint32_t format_version;
    std::uint32_t header_bytes;
    std::uint64_t key_bytes;
    std::uint64_t binary_bytes;
    std::uint64_t binary_checksum;
};

std::string_view text_of(const ProgramCache::Binary& binary) {
    return {reinterpret_cast<const char*>(binary.data()), binary.size()};
}

Header make_header(std::string_view key, std::string_view binary) {
    Header header{};
    std::memcpy(header.magic, kMagic, sizeof(kMagic));
    header.format_version = kFormatVersion;
    header.header_bytes = sizeof(Header);
    header.key_bytes = key.size();
    header.binary_bytes = binary.size();
    header.binary_checksum = checksum(binary);
    return header;
}

/// The binary in a file's contents, if they are what store() wrote for `key`: the header is the one that it would write
/// for them.
std::optional<std::string_view> binary_of(std::string_view contents, std::string_view key) {
    if (contents.size() < sizeof(Header) + key.size()) return std::nullopt;
    const std::string_view binary = contents.substr(sizeof(Header) + key.size());
    const Header expected = make_header(key, binary);
    if (std::memcmp(contents.data(), &expected, sizeof(Header)) != 0) return std::nullopt;
    if (contents.substr(sizeof(Header), key.size()) != key) return std::nullopt;
    return binary;
}

std::string read_file(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

fs::path ProgramCache::file_of(std::string_view key) const {
    return folder_ / fmt::format("{:016x}.bin", checksum(key));
}

std::optional<ProgramCache::Binary> ProgramCache::find(std::string_view key) const noexcept {
    if (!is_on()) return std::nullopt;
    try {
        const std::string contents = read_file(file_of(key));
        if (const auto binary = binary_of(contents, key)) return Binary(binary->begin(), binary->end());
        if (!contents.empty()) forget(key);
    } catch (const std::exception&) {
        // As good as missing.
    }
    return std::nullopt;
}

void ProgramCache::store(std::string_view key, const Binary& binary) const noexcept {
    if (!is_on()) return;
    try {
        const Header header = make_header(key, text_of(binary));
        std::string contents(reinterpret_cast<const char*>(&header), sizeof(header));
        contents += key;
        contents += text_of(binary);
        fs::create_directories(folder_);
        write_file_atomically(file_of(key), std::as_bytes(std::span(contents)));
    } catch (const std::exception&) {
        // The next process compiles again.
    }
}

void ProgramCache::forget(std::string_view key) const noexcept {
    if (!is_on()) return;
    try {
        std::error_code ignored;
        fs::remove(file_of(key), ignored);
    } catch (const std::exception&) {
        // It will be found wrong again.
    }
}

std::string program_cache_key(const Device& device, std::string_view source, std::string_view options) {
    return fmt::format("castor {}\ndevice {}\ndevice version {}\ndriver {}\nplatform {} {}\noptions {}\n{}",
                       CASTOR_VERSION, device.name, device.device_version, device.driver_version, device.platform_name,
                       device.platform_version, options, source);
}

fs::path program_cache_folder() {
    return user_folder("CASTOR_CACHE_DIR", "XDG_CACHE_HOME", ".cache", "programs");
}

}  // namespace castor
