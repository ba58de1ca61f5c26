// Encodes PNG and Radiance HDR with stb_image_write. Only this file includes that header.
#include <algorithm>
#include <cmath>
#include <limits>

#include "castor/error.h"
#include "image/encode.h"

// Static, so that a program that links Castor may bring its own copy.
#define STBIWDEF [[maybe_unused]] static
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-variable"
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace castor {

namespace {

void append(void* bytes, void* data, int size) {
    const auto* first = static_cast<const std::byte*>(data);
    static_cast<Bytes*>(bytes)->insert(static_cast<Bytes*>(bytes)->end(), first, first + size);
}

/// Throws Error for a size that stb cannot count: it uses int, and its compressor doubles its buffer.
void require_countable(std::uint64_t bytes, const char* format) {
    if (bytes > std::numeric_limits<int>::max() / 4)
        throw Error(std::string("the picture is too large for ") + format +
                    " files; .pfm, .ppm and .exr have no such limit");
}

/// Clamps a value to the range of HDR, whose exponents end below 2^127.
float representable(float value) {
    constexpr float kLargest = 0x1.fep126f;
    return value > 0.0f ? std::min(value, kLargest) : 0.0f;  // NaN is not above zero
}

}  // namespace

Bytes encode_png(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb) {
    require_countable((std::uint64_t{width} * 3 + 1) * height, "PNG");
    Bytes bytes;
    const int stride = static_cast<int>(3 * width);
    if (!stbi_write_png_to_func(append, &bytes, static_cast<int>(width), static_cast<int>(height), 3, rgb.data(),
                                stride))
        throw Error("the picture cannot be compressed as PNG: out of memory");
    return bytes;
}

Bytes encode_hdr(std::uint32_t width, std::uint32_t height, std::span<const float> rgb) {
    require_countable(std::uint64_t{width} * height * 4, "HDR");
    std::vector<float> limited(rgb.size());
    std::transform(rgb.begin(), rgb.end(), limited.begin(), representable);
    Bytes bytes;
    if (!stbi_write_hdr_to_func(append, &bytes, static_cast<int>(width), static_cast<int>(height), 3, limited.data()))
        throw Error("the picture cannot be written as HDR: out of memory");
    return bytes;
}

}  // namespace castor
