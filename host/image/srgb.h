#pragma once

#include <cstdint>

namespace castor {

/// The linear value in [0, 1] of a byte that sRGB's curve encodes (IEC 61966-2-1), from a table.
float linear_of_srgb(std::uint8_t byte);

}  // namespace castor
