#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>
#include <string>

namespace castor {

inline bool is_finite(const glm::vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

template <std::size_t N>
bool is_finite(const float (&v)[N]) {
    return std::all_of(v, v + N, [](float x) { return std::isfinite(x); });
}

/// Returns "(1, 2.5, 3)", with as many digits as tell the numbers from all others.
inline std::string text(const glm::vec3& v) {
    return fmt::format("({}, {}, {})", v.x, v.y, v.z);
}

}  // namespace castor
