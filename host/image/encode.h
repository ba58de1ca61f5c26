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

/// Encode one value for each channel of a pixel, 32 bits each, either floats or unsigned integers.
Bytes encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& channels,
                 std::span<const float> values);
Bytes encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& channels,
                 std::span<const std::uint32_t> values);

}  // namespace castor
