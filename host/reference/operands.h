#pragma once

// Floats that expose faults of arithmetic.
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "reference/random_source.h"

namespace castor::reference {

inline std::vector<float> special_values() {
    using Limits = std::numeric_limits<float>;
    std::vector<float> values;
    for (float value : {0.0f,
                        1.0f,
                        2.0f,
                        3.0f,
                        0.1f,
                        16777215.0f,
                        16777216.0f,
                        Limits::min(),
                        std::nextafter(Limits::min(), 0.0f),
                        std::nextafter(Limits::min(), 1.0f),
                        Limits::denorm_min(),
                        3 * Limits::denorm_min(),
                        Limits::max(),
                        std::nextafter(Limits::max(), 0.0f),
                        0x1.fffffep63f,
                        0x1p64f,
                        0x1.6a09e6p0f,
                        Limits::infinity(),
                        Limits::quiet_NaN(),
                        std::nextafter(1.0f, 2.0f),
                        std::nextafter(1.0f, 0.0f),
                        0x1p-126f,
                        0x1p127f}) {
        values.push_back(value);
        values.push_back(-value);
    }
    return values;
}

// Any bit pattern; operands whose quotient is near the smallest normal, where results round to denormals; denormals.
inline float random_operand(RandomSource& random, std::size_t kind) {
    if (kind == 0) return random.any_float();
    if (kind == 1) return random.uniform_float(1.0f, 2.0f) * (random.bits() & 1 ? 0x1p-100f : 0x1p26f);
    if (kind == 2) return std::bit_cast<float>(random.bits() & 0x80ffffffu);
    return random.uniform_float(-100.0f, 100.0f);
}

}  // namespace castor::reference
