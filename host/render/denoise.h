#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/denoise.h"
#include "castor/renderer.h"

namespace castor {

class DeviceContext;

/// The name among aov_names() of the picture before noise was removed, in a film of which it is.
inline constexpr const char* kNoisyPlane = "noisy";

/// Returns the planes that a render makes for these options: those of aov_names() that are asked for, and those that
/// denoising takes, but not kNoisyPlane, which denoising makes.
std::vector<std::string> rendered_aovs(const RenderOptions& options);

/// Returns the values of one of the denoiser_planes, so many a pixel. Throws UsageError where the film has no pixels,
/// no such plane, or another number of values in it.
const float* denoiser_plane(const Film& film, Denoiser denoiser, std::string_view name, std::size_t channels);

/// Removes noise as castor::denoise does, on one device.
void denoise(Film& film, DeviceContext& context);

/// Leaves the planes that are asked for, in their order, and those of lights, in a film that was made with
/// rendered_aovs. Calls `remove_noise(film)` if it is complete; "noisy" is what it was before.
void finish_denoised(Film& film, const std::vector<std::string>& aovs, const std::function<void(Film&)>& remove_noise);

}  // namespace castor
