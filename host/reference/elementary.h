#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace castor::reference {

/// A function of elementary.lanes.cl, by its number in elementary_test.lanes.cl, and the error that its comment states.
struct ElementaryFunction {
    const char* name;
    std::uint32_t number;
    double stated_error;
    long double (*reference)(long double);
    float largest_argument;
};

inline const ElementaryFunction kElementaryFunctions[] = {
    {"sine", 0, 1.5, std::sin, 1e5f},
    {"cosine", 1, 1.5, std::cos, 1e5f},
    {"arc_sine", 2, 1.6, std::asin, std::numeric_limits<float>::infinity()},
    {"arc_cosine", 3, 1.1, std::acos, std::numeric_limits<float>::infinity()},
    {"exponential", 4, 0.9, std::exp, std::numeric_limits<float>::infinity()},
    {"exponential2", 5, 0.9, std::exp2, std::numeric_limits<float>::infinity()},
    {"logarithm", 6, 0.51, std::log, std::numeric_limits<float>::infinity()},
    {"logarithm2", 7, 0.51, std::log2, std::numeric_limits<float>::infinity()},
    {"rounded_down", 10, 0.0, std::floor, std::numeric_limits<float>::infinity()},
};

/// The functions of two arguments: power(x, y) and arc_tangent2(x, y) with x above y.
inline constexpr std::uint32_t kPower = 8, kArcTangent2 = 9;
inline constexpr std::uint32_t kElementaryCount = 11;
inline constexpr double kPowerError = 1.0, kArcTangent2Error = 1.7;

}  // namespace castor::reference
