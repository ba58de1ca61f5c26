#include "render/noise.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace castor {

bool looks_at_noise(std::uint32_t samples) {
    return samples >= kFewestSamplesToStop && std::has_single_bit(samples);
}

std::uint32_t next_look_at_noise(std::uint32_t samples) {
    return std::max(kFewestSamplesToStop, std::bit_floor(samples) * 2);
}

double noise_of_block(const PixelBlocks& blocks, std::uint32_t block, std::uint32_t samples,
                      std::span<const glm::vec4> sums) {
    double luminance = 0.0, deviations = 0.0;
    blocks.for_each_row(block, 0, [&](std::size_t, std::size_t slot, std::uint32_t count) {
        for (std::size_t i = slot; i < slot + count; ++i) {
            luminance += 0.2126 * double{sums[i].x} + 0.7152 * double{sums[i].y} + 0.0722 * double{sums[i].z};
            deviations += double{sums[i].w};
        }
    });
    const double pixels = blocks.pixels_in_picture(block), count = samples;
    const double variance = deviations / (pixels * (count - 1.0) * count);
    const double mean = std::abs(luminance / (pixels * count));
    // Not std::max, which would lose a mean that is not a number.
    return std::sqrt(variance) / (mean < kDarkestLuminance ? kDarkestLuminance : mean);
}

}  // namespace castor
