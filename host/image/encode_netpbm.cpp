// Encodes the formats of the Netpbm family: PPM as text, and PFM.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <iterator>

#include "image/encode.h"

namespace castor {

namespace {

Bytes to_bytes(const fmt::memory_buffer& text) {
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    return Bytes(first, first + text.size());
}

}  // namespace

Bytes encode_ppm(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb) {
    constexpr std::size_t kValuesPerLine = 15;  // the format asks for lines of at most 70 characters
    fmt::memory_buffer text;
    fmt::format_to(std::back_inserter(text), "P3\n{} {}\n255\n", width, height);
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const bool ends_line = (i + 1) % kValuesPerLine == 0 || i + 1 == rgb.size();
        fmt::format_to(std::back_inserter(text), "{}{}", rgb[i], ends_line ? '\n' : ' ');
    }
    return to_bytes(text);
}

Bytes encode_pfm(std::uint32_t width, std::uint32_t height, std::size_t channel_count, std::span<const float> values) {
    static_assert(std::endian::native == std::endian::little, "the scale -1 below says so");
    fmt::memory_buffer header;
    fmt::format_to(std::back_inserter(header), "{}\n{} {}\n-1.0\n", channel_count == 3 ? "PF" : "Pf", width, height);
    Bytes bytes = to_bytes(header);
    const std::size_t row = channel_count * width;
    bytes.resize(header.size() + row * height * sizeof(float));
    std::byte* target = bytes.data() + header.size();
    for (std::size_t y = height; y-- > 0; target += row * sizeof(float))  // the bottom row comes first
        std::memcpy(target, values.data() + y * row, row * sizeof(float));
    return bytes;
}

}  // namespace castor
