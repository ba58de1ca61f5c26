#pragma once

#include <filesystem>
#include <vector>

#include "castor/scene.h"

namespace castor {

/// Makes negative radiances 0, which conversions between colour spaces leave in pictures, and warns of them.
void clamp_radiances(Image& image, std::vector<Warning>& warnings);

/// Adds light from all directions to a scene, by a picture of them in which 1 is white: floats are linear, bytes are
/// encoded by sRGB's curve. Throws SceneError.
void add_environment(Scene& scene, const std::filesystem::path& picture);

/// Adds the light of a neutral studio, for scenes that have none. With y up and +z the front, and a white of 1, its
/// radiance from the direction d is
///
///     0.31 + 0.09 d.y + 2.2 (d.k)^12 + 0.9 (d.f)^8 + 1.2 (d.r)^16
///
/// where products below 0 count as 0: a grey room that is lighter above, a key light k, a fill f and a rim light r. A
/// white surface that faces up sends 0.7.
void add_studio(Scene& scene);

}  // namespace castor
