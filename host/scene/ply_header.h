#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace castor {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// Returns the number of bytes of one value in a binary file.
constexpr std::size_t size_of(PlyType type) {
    constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return kBytes[static_cast<std::size_t>(type)];
}

inline bool is_integer(PlyType type) {
    return type < PlyType::float32;
}

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;
    bool is_list = false;
    PlyType count_type = PlyType::uint8;  // of a list's length
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;  // as the header claims; not checked
    std::vector<PlyProperty> properties;
    std::size_t line = 0;
};

struct PlyHeader {
    PlyFormat format = PlyFormat::ascii;
    std::vector<PlyElement> elements;
    std::size_t bytes = 0;  // before the first byte of data
};

/// Reads the header of a PLY file. Throws SceneError with `file` and the line if it is wrong.
PlyHeader parse_ply_header(std::string_view file_bytes, const std::string& file);

/// Returns the first 40 characters of a text for a message, with '?' for those that do not print.
std::string printable(std::string_view text);

}  // namespace castor
