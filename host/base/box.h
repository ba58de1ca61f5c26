#pragma once

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>

namespace castor {

/// Four lanes, with GCC's and Clang's operators on them: `a < b ? a : b` is one instruction.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = int __attribute__((vector_size(16)));

/// An axis-aligned box; the default one is empty. Everything here is min, max and single rounded operations, so that a
/// box is exactly the one that a device computes from the same numbers. The fourth lane has no meaning in a box.
struct Box {
    static constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Float4 lower{kInfinity, kInfinity, kInfinity, kInfinity};
    Float4 upper{-kInfinity, -kInfinity, -kInfinity, -kInfinity};

    void extend(const Box& box) {
        lower = box.lower < lower ? box.lower : lower;
        upper = box.upper > upper ? box.upper : upper;
    }
    void extend(Float4 point) { extend(Box{point, point}); }
    bool is_empty() const { return lower[0] > upper[0] || lower[1] > upper[1] || lower[2] > upper[2]; }
};

inline Float4 make_float4(float x, float y, float z) {
    return Float4{x, y, z, 0.0f};
}

inline Float4 make_float4(const glm::vec3& p) {
    return make_float4(p.x, p.y, p.z);
}

inline Box triangle_box(const glm::vec3& p0, const glm::vec3& p1, const glm::vec3& p2) {
    Box box{make_float4(p0), make_float4(p0)};
    box.extend(make_float4(p1));
    box.extend(make_float4(p2));
    return box;
}

/// Each bound rounded to nearest; center in xyz, radius in w.
inline Box sphere_box(const glm::vec4& c) {
    return {make_float4(c.x - c.w, c.y - c.w, c.z - c.w), make_float4(c.x + c.w, c.y + c.w, c.z + c.w)};
}

/// Half of the surface of a box that is not empty; in double precision, where neither tiny nor huge boxes
/// lose theirs.
inline double half_area(const Box& box) {
    const Float4 extent = box.upper - box.lower;
    const double x = extent[0], y = extent[1], z = extent[2];
    return x * y + y * z + z * x;
}

/// Of a box that is not empty.
inline float longest_side(const Box& box) {
    const Float4 extent = box.upper - box.lower;
    return std::max({float(extent[0]), float(extent[1]), float(extent[2])});
}

/// The largest magnitude of any coordinate of a box that is not empty.
inline float largest_coordinate(const Box& box) {
    float largest = 0.0f;
    for (int i = 0; i < 3; ++i) largest = std::max({largest, std::abs(box.lower[i]), std::abs(box.upper[i])});
    return largest;
}

}  // namespace castor
