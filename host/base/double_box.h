#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <limits>

namespace castor {

/// An axis-aligned box in double precision; the default one is empty.
struct DoubleBox {
    glm::dvec3 lower{std::numeric_limits<double>::infinity()};
    glm::dvec3 upper{-std::numeric_limits<double>::infinity()};

    void include(const glm::dvec3& point) {
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
    }
    /// Corner `number` of 8: bit i is set where it is the upper one along axis i.
    glm::dvec3 corner(int number) const {
        return {(number & 1 ? upper : lower).x, (number & 2 ? upper : lower).y, (number & 4 ? upper : lower).z};
    }
    bool is_empty() const { return !(lower.x <= upper.x); }
    glm::dvec3 center() const { return 0.5 * (lower + upper); }
    glm::dvec3 extent() const { return upper - lower; }
};

}  // namespace castor
