#pragma once

#include <cstdint>

#include "scene/scene_arrays.h"

namespace castor {

/// A number that two scenes share only if all that decides their pictures is the same, or by an accident of 2^-64.
/// Looks at every byte, in parallel.
std::uint64_t fingerprint(const SceneArrays& arrays);

}  // namespace castor
