#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>

namespace castor {

/// An axis-aligned box; the default one is empty. Everything here is min, max and single rounded operations, so that a
/// box is exactly the one that a device computes from the same numbers.
struct Box {
    glm::vec3 lower{std::numeric_limits<float>::infinity()};
    glm::vec3 upper{-std::numeric_limits<float>::infinity()};

    void extend(const glm::vec3& point) {
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
    }
    void extend(const Box& box) {
        lower = glm::min(lower, box.lower);
        upper = glm::max(upper, box.upper);
    }
    bool operator==(const Box&) const = default;
};

/// Half of the surface of a box that is not empty.
inline float half_area(const Box& box) {
    const glm::vec3 extent = box.upper - box.lower;
    return extent.x * extent.y + extent.y * extent.z + extent.z * extent.x;
}

inline Box triangle_box(const glm::vec3& p0, const glm::vec3& p1, const glm::vec3& p2) {
    return {glm::min(glm::min(p0, p1), p2), glm::max(glm::max(p0, p1), p2)};
}

/// Each bound rounded to nearest; center in xyz, radius in w.
inline Box sphere_box(const glm::vec4& center_radius) {
    const glm::vec3 center(center_radius);
    return {center - center_radius.w, center + center_radius.w};
}

/// The largest magnitude of any coordinate of a box that is not empty.
inline float largest_coordinate(const Box& box) {
    const glm::vec3 farthest = glm::max(glm::abs(box.lower), glm::abs(box.upper));
    return glm::max(glm::max(farthest.x, farthest.y), farthest.z);
}

}  // namespace castor
