#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace castor::reference {

/// Returns whether two answers are equal: the same bits, or both NaN.
inline bool same_float(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b) || (std::isnan(a) && std::isnan(b));
}

/// Returns the distance from `exact` to `found` in units in the last place of a float at `exact`: 0 if both are NaN or
/// the same infinity, infinity if only one is NaN. An infinity counts as the largest float plus one unit.
inline double ulp_error(float found, long double exact) {
    constexpr float kLargest = std::numeric_limits<float>::max();
    if (std::isnan(found) || std::isnan(exact))
        return std::isnan(found) && std::isnan(exact) ? 0.0 : std::numeric_limits<double>::infinity();
    // The next step beyond the largest float.
    constexpr long double kBeyond = static_cast<long double>(kLargest) + 0x1p104L;
    const auto limited = [&](long double value) { return std::fmax(-kBeyond, std::fmin(kBeyond, value)); };
    const float magnitude = std::fmin(std::fabs(static_cast<float>(exact)), std::nextafter(kLargest, 0.0f));
    const long double unit = static_cast<long double>(std::nextafter(magnitude, kLargest)) - magnitude;
    return static_cast<double>(std::fabs(limited(found) - limited(exact)) / unit);
}

}  // namespace castor::reference
