#pragma once

// Cases of rays and triangles, and the judge of the triangle tests.
#include <array>
#include <cmath>
#include <glm/vec3.hpp>
#include <limits>
#include <string>
#include <vector>

#include "reference/intersect.h"
#include "reference/kernel_runner.h"
#include "reference/random_source.h"
#include "reference/rays.h"

namespace castor::reference::triangle_cases {

using glm::vec3;
using shared::Ray;

inline constexpr std::array<const char*, 3> kFunctions{"intersect_triangle", "intersect_triangle_plane",
                                                       "intersect_triangle_cramer"};
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Case {
    Ray ray;
    std::array<vec3, 3> p;
};

struct Answer {
    float t, u, v, from_behind;
    bool hit() const { return !std::isnan(t); }
};

inline std::vector<Answer> run(KernelRunner& fixture, cl_uint function, const std::vector<Case>& cases) {
    std::vector<Ray> rays;
    std::vector<vec3> vertices;
    float largest = 0.0f;
    for (const Case& one : cases) {
        rays.push_back(one.ray);
        for (vec3 p : one.p) {
            vertices.push_back(p);
            for (int k = 0; k < 3; ++k) largest = std::fmax(largest, std::fabs(p[k]));
        }
    }
    return fixture.run<Answer>("doctor/intersect_triangle_test", cases.size(), function, largest, rays, vertices);
}

inline std::array<vec3, 3> random_triangle(RandomSource& random) {
    const vec3 p0 = random.in_box(-1, 1), p1 = random.in_box(-1, 1);
    return {p0, p1, random.in_box(-1, 1)};
}

/// Makes a case near the origin, now and then with a range of t.
inline Case random_case(RandomSource& random, std::size_t i) {
    const vec3 origin = random.in_box(-2, 2);
    const vec3 direction = i % 2 ? random.direction() : random.in_box(-1, 1) - origin;
    const float t_min = i % 3 ? 0.0f : random.uniform_float(-1, 1);
    const float t_max = i % 3 ? kInfinity : random.uniform_float(0, 2);
    return {make_ray(origin, direction, t_min, t_max), random_triangle(random)};
}

inline std::string describe(const Case& one) {
    return to_text(one.ray) + " at " + to_text(one.p[0]) + " " + to_text(one.p[1]) + " " + to_text(one.p[2]);
}

// The error is that of a few roundings in float, amplified by the case's condition.
inline constexpr double kRoundings = 16 * 0x1p-24;

inline bool agrees(const Case& one, const Answer& answer) {
    const auto exact =
        reference::intersect_triangle(origin_of(one.ray), direction_of(one.ray), one.p[0], one.p[1], one.p[2]);
    if (!exact) return true;  // edge-on in double precision: rounding decides
    const double tolerance = kRoundings * exact->condition;
    const double t_tolerance = tolerance * (1.0 + std::fabs(exact->t));
    const double in_range = std::fmin(exact->t - one.ray.t_min, one.ray.t_max - exact->t);
    const bool surely_hit = exact->inside() > tolerance && in_range > t_tolerance;
    const bool surely_missed = exact->inside() < -tolerance || in_range < -t_tolerance;
    if (!answer.hit()) return !surely_hit;
    return !surely_missed && std::fabs(answer.t - exact->t) <= t_tolerance &&
           std::fabs(answer.u - exact->u) <= tolerance && std::fabs(answer.v - exact->v) <= tolerance &&
           (answer.from_behind != 0.0f) == exact->from_behind;
}

/// A named case with its exact answer.
struct Named {
    const char* name;
    Case input;
    bool hit;
    float t = 0, u = 0, v = 0;
};

inline bool is_right(const Named& named, const Answer& found) {
    return found.hit() == named.hit && (!named.hit || (found.t == named.t && found.u == named.u && found.v == named.v));
}

inline std::vector<Named> named_cases() {
    const std::array<vec3, 3> p{vec3(0, 0, 0), vec3(4, 0, 0), vec3(0, 4, 0)};
    const vec3 down(0, 0, -1);
    return {
        {"inside", {make_ray({1, 1, 3}, down), p}, true, 3, 0.25f, 0.25f},
        {"from behind", {make_ray({1, 1, -3}, {0, 0, 2}), p}, true, 1.5f, 0.25f, 0.25f},
        {"edge 01", {make_ray({2, 0, 3}, down), p}, true, 3, 0.5f, 0},
        {"edge 12", {make_ray({2, 2, 3}, down), p}, true, 3, 0.5f, 0.5f},
        {"edge 20", {make_ray({0, 2, 3}, down), p}, true, 3, 0, 0.5f},
        {"vertex 0", {make_ray({0, 0, 3}, down), p}, true, 3, 0, 0},
        {"vertex 1", {make_ray({4, 0, 3}, down), p}, true, 3, 1, 0},
        {"vertex 2", {make_ray({0, 4, 3}, down), p}, true, 3, 0, 1},
        {"just outside an edge", {make_ray({2, -0x1p-10f, 3}, down), p}, false},
        {"behind the origin", {make_ray({1, 1, -3}, down), p}, false},
        {"behind the origin, negative t_min", {make_ray({1, 1, -3}, down, -5), p}, true, -3, 0.25f, 0.25f},
        {"starts on it", {make_ray({1, 1, 0}, down), p}, true, 0, 0.25f, 0.25f},
        {"t_min exactly", {make_ray({1, 1, 3}, down, 3), p}, true, 3, 0.25f, 0.25f},
        {"t_min just beyond", {make_ray({1, 1, 3}, down, std::nextafter(3.0f, 4.0f)), p}, false},
        {"t_max exactly", {make_ray({1, 1, 3}, down, 0, 3), p}, true, 3, 0.25f, 0.25f},
        {"t_max just before", {make_ray({1, 1, 3}, down, 0, std::nextafter(3.0f, 0.0f)), p}, false},
        {"t_max before t_min", {make_ray({1, 1, 3}, down, 5, 1), p}, false},
        {"edge-on", {make_ray({-1, 1, 0}, {1, 0, 0}), p}, false},
        {"parallel", {make_ray({-1, 1, 1}, {1, 0, 0}), p}, false},
        {"negative zero components", {make_ray({1, 1, 3}, {-0.0f, -0.0f, -1}), p}, true, 3, 0.25f, 0.25f},
        {"long direction", {make_ray({1, 1, 3}, {0, 0, -0x1p120f}), p}, true, 0x1.8p-119f, 0.25f, 0.25f},
        {"short direction", {make_ray({1, 1, 3}, {0, 0, -0x1p-120f}), p}, true, 0x1.8p121f, 0.25f, 0.25f},
        {"zero direction", {make_ray({1, 1, 0}, {0, 0, 0}), p}, false},
        {"denormal direction", {make_ray({1, 1, 1e-42f}, {0, 0, -1e-42f}), p}, false},
        {"infinite direction", {make_ray({1, 1, 3}, {0, 0, -kInfinity}), p}, false},
        {"NaN direction", {make_ray({1, 1, 3}, {kNaN, 0, -1}), p}, false},
        {"NaN origin", {make_ray({1, kNaN, 3}, down), p}, false},
        {"infinite origin", {make_ray({1, 1, kInfinity}, down), p}, false},
        {"NaN t_min", {make_ray({1, 1, 3}, down, kNaN), p}, false},
        {"NaN t_max", {make_ray({1, 1, 3}, down, 0, kNaN), p}, false},
        {"degenerate to a segment", {make_ray({1, 0, 3}, down), {p[0], p[1], vec3(2, 0, 0)}}, false},
        {"degenerate to a point", {make_ray({0, 0, 3}, down), {p[0], p[0], p[0]}}, false},
    };
}

}  // namespace castor::reference::triangle_cases
