#pragma once

#include <functional>
#include <string>
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

/// Removes noise as castor::denoise does, on one device.
void denoise(Film& film, DeviceContext& context);

/// Leaves the planes that are asked for, in their order, and those of lights, in a film that was made with
/// rendered_aovs. Calls `remove_noise(film)` if it is complete; "noisy" is what it was before.
void finish_denoised(Film& film, const std::vector<std::string>& aovs, const std::function<void(Film&)>& remove_noise);

}  // namespace castor
