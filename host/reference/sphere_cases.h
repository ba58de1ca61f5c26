#pragma once

// Cases of rays and spheres, and the judge of intersect_sphere.
#include <array>
#include <cmath>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <string>
#include <vector>

#include "reference/intersect.h"
#include "reference/kernel_runner.h"
#include "reference/random_source.h"
#include "reference/rays.h"

namespace castor::reference::sphere_cases {

using glm::vec3;
using glm::vec4;
using shared::Ray;

struct Case {
    Ray ray;
    vec4 sphere;  // centre and radius
};

inline std::vector<float> run(KernelRunner& fixture, const std::vector<Case>& cases) {
    std::vector<Ray> rays;
    std::vector<vec4> spheres;
    float largest = 0.0f;
    for (const Case& one : cases) {
        rays.push_back(one.ray);
        spheres.push_back(one.sphere);
        for (int k = 0; k < 3; ++k) largest = std::fmax(largest, std::fabs(one.sphere[k]) + one.sphere.w);
    }
    return fixture.run<float>("doctor/intersect_sphere_test", cases.size(), largest, rays, spheres);
}

/// Makes a case near the origin, now and then with a range of t.
inline Case random_case(RandomSource& random, std::size_t i) {
    const float t_min = i % 3 ? 0.0f : random.uniform_float(-1, 1);
    const float t_max = i % 3 ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 2);
    const vec3 origin = random.in_box(-2, 2), direction = random.direction(), center = random.in_box(-1, 1);
    return {make_ray(origin, direction, t_min, t_max), vec4(center, random.uniform_float(0.01f, 1.5f))};
}

inline std::string describe(const Case& one) {
    return to_text(one.ray) + " at the sphere about " + to_text(vec3(one.sphere)) + " with radius " +
           std::to_string(one.sphere.w);
}

// The error is that of a few final roundings and of a discriminant with 48 bits.
inline bool agrees(const Case& one, float t) {
    const auto exact =
        reference::intersect_sphere(origin_of(one.ray), direction_of(one.ray), vec3(one.sphere), one.sphere.w);
    constexpr long double kDiscriminantError = 0x1p-44L;
    if (std::fabs(exact.grazing) < kDiscriminantError) return true;
    if (exact.grazing < 0) return std::isnan(t);
    const auto tolerance = [&](long double root) {
        return 4 * 0x1p-24L * std::fabs(root) + kDiscriminantError * exact.sensitivity;
    };
    const auto allowed = [&](long double root) {
        return root >= one.ray.t_min - tolerance(root) && root <= one.ray.t_max + tolerance(root);
    };
    const auto sure = [&](long double root) {
        return root >= one.ray.t_min + tolerance(root) && root <= one.ray.t_max - tolerance(root);
    };
    if (std::isnan(t)) return !sure(exact.near_t) && !sure(exact.far_t);
    if (allowed(exact.near_t) && std::fabs(t - exact.near_t) <= tolerance(exact.near_t)) return true;
    return !sure(exact.near_t) && allowed(exact.far_t) && std::fabs(t - exact.far_t) <= tolerance(exact.far_t);
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
    const vec4 unit(0, 0, 0, 1);
    return {
        {"through the centre", {make_ray({0, 0, 3}, {0, 0, -1}), unit}, 2},
        {"direction not normalised", {make_ray({0, 0, 3}, {0, 0, -4}), unit}, 0.5f},
        {"from inside", {make_ray({0, 0, 0}, {0, 0, -1}), unit}, 1},
        {"behind", {make_ray({0, 0, 3}, {0, 0, 1}), unit}, kMiss},
        {"behind, negative t_min", {make_ray({0, 0, 3}, {0, 0, 1}, -10), unit}, -4},
        {"near root before t_min", {make_ray({0, 0, 3}, {0, 0, -1}, 2.5f), unit}, 4},
        {"t_min at the near root", {make_ray({0, 0, 3}, {0, 0, -1}, 2), unit}, 2},
        {"t_min at the far root", {make_ray({0, 0, 3}, {0, 0, -1}, 4), unit}, 4},
        {"t_min beyond", {make_ray({0, 0, 3}, {0, 0, -1}, std::nextafter(4.0f, 5.0f)), unit}, kMiss},
        {"t_max at the near root", {make_ray({0, 0, 3}, {0, 0, -1}, 0, 2), unit}, 2},
        {"t_max before", {make_ray({0, 0, 3}, {0, 0, -1}, 0, std::nextafter(2.0f, 0.0f)), unit}, kMiss},
        {"between the roots", {make_ray({0, 0, 3}, {0, 0, -1}, 2.5f, 3.5f), unit}, kMiss},
        {"grazing", {make_ray({1, 0, 3}, {0, 0, -1}), unit}, 3},
        {"passing by", {make_ray({1.0001f, 0, 3}, {0, 0, -1}), unit}, kMiss},
        {"starts on it, outwards", {make_ray({0, 0, 1}, {0, 0, 1}), unit}, 0},
        {"starts on it, inwards", {make_ray({0, 0, 1}, {0, 0, -1}), unit}, 0},
        {"starts on it, inwards, t_min above 0", {make_ray({0, 0, 1}, {0, 0, -1}, 0.001f), unit}, 2},
        {"far away", {make_ray({0, 0, 1e6f}, {0, 0, -1}), unit}, 999999},
        {"large", {make_ray({0, 0, 1e6f + 1}, {0, 0, -1}), vec4(0, 0, 0, 1e6f)}, 1},
        {"zero direction", {make_ray({0, 0, 1}, {0, 0, 0}), unit}, kMiss},
        {"infinite direction", {make_ray({0, 0, 3}, {0, 0, -kInfinity}), unit}, kMiss},
        {"NaN direction", {make_ray({0, 0, 3}, {0, kMiss, -1}), unit}, kMiss},
        {"huge direction", {make_ray({0, 0, 3}, {0, 0, -0x1p120f}), unit}, 0x1p-119f},
        {"tiny direction", {make_ray({0, 0, 3}, {0, 0, -0x1p-120f}), unit}, 0x1p121f},
    };
}

}  // namespace castor::reference::sphere_cases
