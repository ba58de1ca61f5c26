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

// One function a format: the whole file in memory, so that the disk is met in one place only. Each throws Error with a
// reason, but no file name, where the format cannot hold the picture.

/// 8 bits a channel: 3 * width * height values, row 0 on top.
Bytes encode_png(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb);
Bytes encode_ppm(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb);

/// Radiance's shared-exponent format, which knows neither negative nor infinite values: NaN and negative
/// become 0, and what is too large becomes the largest value.
Bytes encode_hdr(std::uint32_t width, std::uint32_t height, std::span<const float> rgb);

/// `channel_count` is 1 or 3.
Bytes encode_pfm(std::uint32_t width, std::uint32_t height, std::size_t channel_count, std::span<const float> values);

/// One value a channel and pixel, 32 bits each, either floats or unsigned integers.
Bytes encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& channels,
                 std::span<const float> values);
Bytes encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& channels,
                 std::span<const std::uint32_t> values);

}  // namespace castor
