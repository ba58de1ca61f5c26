#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>

#include "render/pixel_blocks.h"

namespace castor {

// Where a picture stops at noise (RenderOptions::noise), each pixel block is looked at after 16, 32, 64 ... samples of
// its pixels, and is done when its error is small enough then. The criterion is that of Dammertz, Hanika, Keller,
// Lensch 2010, "A Hierarchical Automatic Stopping Condition for Monte Carlo Global Illumination", without the
// hierarchy, and with the variance of the samples in place of a second picture.

/// The fewest samples after which a block may stop: with 64 pixels, a thousand to estimate the error from.
inline constexpr std::uint32_t kFewestSamplesToStop = 16;

/// The luminance up to which errors count as relative to it alone: a hundredth of white.
inline constexpr double kDarkestLuminance = 2.55;

/// Returns whether blocks with so many samples are looked at.
bool looks_at_noise(std::uint32_t samples);
/// Returns the first number of samples above `samples` at which blocks are looked at.
std::uint32_t next_look_at_noise(std::uint32_t samples);

/// Returns the estimated relative error of a block with `samples` samples, two at least: the root of the mean, over its
/// pixels in the picture, of the variances of their means, divided by the mean luminance, which counts as
/// kDarkestLuminance at least. `sums`: a slot of the block each, w the sum of squared deviations of luminance (see
/// add_samples.cl). Computed in doubles, in the order of rows: the same everywhere. NaN or infinity where sums are not
/// finite.
double noise_of_block(const PixelBlocks& blocks, std::uint32_t block, std::uint32_t samples,
                      std::span<const glm::vec4> sums);

}  // namespace castor
