#pragma once

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>

#include "castor/shared/types.h"

namespace castor {

/// An axis-aligned box; the default one is empty. Everything here is min, max and single rounded operations, so that a
/// box is exactly the one that a device computes from the same numbers. The fourth lane makes of each bound one
/// vector register; it has no meaning in a box.
struct alignas(16) Box {
    static constexpr float kInfinity = std::numeric_limits<float>::infinity();
    float lower[4] = {kInfinity, kInfinity, kInfinity, kInfinity};
    float upper[4] = {-kInfinity, -kInfinity, -kInfinity, -kInfinity};

    void extend(const Box& box) {
        for (int i = 0; i < 4; ++i) lower[i] = box.lower[i] < lower[i] ? box.lower[i] : lower[i];
        for (int i = 0; i < 4; ++i) upper[i] = box.upper[i] > upper[i] ? box.upper[i] : upper[i];
    }
};

inline Box point_box(const glm::vec3& p) {
    return {{p.x, p.y, p.z, 0.0f}, {p.x, p.y, p.z, 0.0f}};
}

inline Box triangle_box(const glm::vec3& p0, const glm::vec3& p1, const glm::vec3& p2) {
    Box box = point_box(p0);
    box.extend(point_box(p1));
    box.extend(point_box(p2));
    return box;
}

/// Each bound rounded to nearest; center in xyz, radius in w.
inline Box sphere_box(const glm::vec4& c) {
    return {{c.x - c.w, c.y - c.w, c.z - c.w, 0.0f}, {c.x + c.w, c.y + c.w, c.z + c.w, 0.0f}};
}

inline Box box_of(const shared::BvhNode& node) {
    return {{node.lower[0], node.lower[1], node.lower[2], 0.0f}, {node.upper[0], node.upper[1], node.upper[2], 0.0f}};
}

/// Half of the surface of a box that is not empty; in double precision, where neither tiny nor huge boxes
/// lose theirs.
inline double half_area(const Box& box) {
    const double x = box.upper[0] - box.lower[0], y = box.upper[1] - box.lower[1], z = box.upper[2] - box.lower[2];
    return x * y + y * z + z * x;
}

/// The largest magnitude of any coordinate of a box that is not empty.
inline float largest_coordinate(const Box& box) {
    float largest = 0.0f;
    for (int i = 0; i < 3; ++i) largest = std::max({largest, std::abs(box.lower[i]), std::abs(box.upper[i])});
    return largest;
}

}  // namespace castor
