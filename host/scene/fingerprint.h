#pragma once

#include <cstdint>

#include "scene/scene_arrays.h"

namespace castor {

/// Returns a number that two scenes share only if all columns made by `flatten` and the settings are the same, or by an
/// accident of 2^-64. Reads every byte, in parallel.
std::uint64_t fingerprint(const SceneArrays& arrays);

}  // namespace castor
