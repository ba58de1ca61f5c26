#pragma once

// Cases of rays and planes, and the judge of intersect_plane.
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <string>
#include <vector>

#include "reference/kernel_runner.h"
#include "reference/random_source.h"
#include "reference/rays.h"

namespace castor::reference::plane_cases {

using glm::dvec3;
using glm::vec3;
using shared::Ray;

struct Case {
    Ray ray;
    vec3 point, normal;
};

inline std::vector<float> run(KernelRunner& fixture, const std::vector<Case>& cases) {
    std::vector<Ray> rays;
    std::vector<vec3> points, normals;
    for (const Case& one : cases) {
        rays.push_back(one.ray);
        points.push_back(one.point);
        normals.push_back(one.normal);
    }
    return fixture.run<float>("doctor/intersect_plane_test", cases.size(), rays, points, normals);
}

/// Makes a case of any scale, now and then with a range of t.
inline Case random_case(RandomSource& random, std::size_t i) {
    const float scale = std::exp2(random.uniform_float(-10, 20));
    const float t_min = i % 3 ? 0.0f : random.uniform_float(-1, 1) * scale;
    const float t_max = i % 3 ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 3) * scale;
    const vec3 origin = random.in_box(-scale, scale), direction = random.direction();
    const vec3 point = random.in_box(-scale, scale);
    return {make_ray(origin, direction, t_min, t_max), point, random.direction()};
}

inline std::string describe(const Case& one) {
    return to_text(one.ray) + " at the plane through " + to_text(one.point) + " with normal " + to_text(one.normal);
}

// t = n.(p - o) / n.d; each dot product is off by a few roundings of its terms' magnitudes.
inline bool agrees(const Case& one, float found) {
    const dvec3 n(one.normal), d(direction_of(one.ray)), s = dvec3(one.point) - dvec3(origin_of(one.ray));
    const double above = glm::dot(n, s), along = glm::dot(n, d), t = above / along;
    const double along_error = glm::dot(glm::abs(n), glm::abs(d)) / std::fabs(along);
    const double tolerance =
        4 * 0x1p-24 * (glm::dot(glm::abs(n), glm::abs(s)) / std::fabs(along) + std::fabs(t) * along_error);
    if (!(along_error * 4 * 0x1p-24 < 0.5)) return true;  // parallel within rounding
    if (std::isnan(found)) return t < one.ray.t_min + tolerance || t > one.ray.t_max - tolerance;
    return found >= one.ray.t_min && found <= one.ray.t_max && std::fabs(found - t) <= tolerance;
}

/// A named case with its exact answer.
struct Named {
    const char* name;
    Case input;
    float t;
};

inline bool is_right(const Named& named, float t) {
    return std::isnan(named.t) ? std::isnan(t) : t == named.t;
}

inline std::vector<Named> named_cases() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity(), kMiss = std::numeric_limits<float>::quiet_NaN();
    const vec3 point(5, 1, -7), up(0, 1, 0);
    return {
        {"from above", {make_ray({0, 3, 0}, {0, -1, 0}), point, up}, 2},
        {"from below", {make_ray({0, -3, 0}, {0, 2, 0}), point, up}, 2},
        {"slanting", {make_ray({0, 3, 0}, {1, -1, 1}), point, up}, 2},
        {"away", {make_ray({0, 3, 0}, {0, 1, 0}), point, up}, kMiss},
        {"away, negative t_min", {make_ray({0, 3, 0}, {0, 1, 0}, -9), point, up}, -2},
        {"parallel", {make_ray({0, 3, 0}, {1, 0, 0}), point, up}, kMiss},
        {"parallel, negative zero", {make_ray({0, 3, 0}, {1, -0.0f, 0}), point, up}, kMiss},
        {"within", {make_ray({0, 1, 0}, {1, 0, 0}), point, up}, kMiss},
        {"starts on it", {make_ray({0, 1, 0}, {0, 1, 0}), point, up}, 0},
        {"t_min exactly", {make_ray({0, 3, 0}, {0, -1, 0}, 2), point, up}, 2},
        {"t_min beyond", {make_ray({0, 3, 0}, {0, -1, 0}, std::nextafter(2.0f, 3.0f)), point, up}, kMiss},
        {"t_max exactly", {make_ray({0, 3, 0}, {0, -1, 0}, 0, 2), point, up}, 2},
        {"t_max before", {make_ray({0, 3, 0}, {0, -1, 0}, 0, std::nextafter(2.0f, 0.0f)), point, up}, kMiss},
        {"infinite direction", {make_ray({0, 3, 0}, {0, -kInfinity, 0}), point, up}, kMiss},
        {"NaN direction", {make_ray({0, 3, 0}, {kMiss, -1, 0}), point, up}, kMiss},
        {"zero direction", {make_ray({0, 1, 0}, {0, 0, 0}), point, up}, kMiss},
    };
}

}  // namespace castor::reference::plane_cases
