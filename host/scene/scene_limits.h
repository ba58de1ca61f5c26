#pragma once

#include <cstdint>

#include "castor/shared/constants.h"

namespace castor {

// What a scene file may ask for. The messages that refuse more name these numbers.
inline constexpr std::int64_t kMaxImageResolution = 65536;  // pixels in one direction
inline constexpr std::int64_t kMaxSamplesPerPixel = 1048576;
inline constexpr std::int64_t kMaxRecursionDepth = 65535;
inline constexpr std::int64_t kMaxNoiseOctaves = CASTOR_MAX_NOISE_OCTAVES;

}  // namespace castor
