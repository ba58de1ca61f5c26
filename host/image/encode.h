#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "castor/film.h"
#include "castor/image_io.h"

namespace castor {

using Bytes = std::vector<std::byte>;

// One function for each format. Each returns the whole file in memory, so that one place alone writes to the disk. Each
// throws Error with a reason, but without a file name, if the format cannot hold the picture.

/// Encode 8 bits a channel: 3 * width * height values, row 0 on top.
Bytes encode_png(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb);
Bytes encode_ppm(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb);

/// Encodes Radiance's shared-exponent format, which has neither negative nor infinite values: NaN and negative values
/// become 0, and values that are too large become the largest one.
Bytes encode_hdr(std::uint32_t width, std::uint32_t height, std::span<const float> rgb);

/// Encodes floats; `channel_count` is 1 or 3.
Bytes encode_pfm(std::uint32_t width, std::uint32_t height, std::size_t channel_count, std::span<const float> values);

/// A channel of an EXR file, of floats or of integers: of these values every `stride`-th, from the first on.
struct ExrChannel {
    std::string name;
    std::span<const float> floats;            // empty if it has integers
    std::span<const std::uint32_t> integers;  // empty if it has floats
    std::size_t stride = 1;
};
/// Encodes channels of 32 bits a value.
Bytes encode_exr(std::uint32_t width, std::uint32_t height, std::vector<ExrChannel> channels);

}  // namespace castor
