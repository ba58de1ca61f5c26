#include "tune/kernel_cases.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "reference/intersect.h"
#include "tune/random.h"

namespace castor {

namespace {

using glm::dvec3;
using glm::vec3;
using glm::vec4;
using shared::Ray;

constexpr double kUnit = 0x1p-24;  // the largest relative error of one rounding
constexpr double kInfinity = std::numeric_limits<double>::infinity();

float random_float(Random& random, float low, float high) {
    return low + (high - low) * static_cast<float>(random.uniform());
}

vec3 random_point(Random& random, float low, float high) {
    // One statement each, because the order of evaluation of arguments is not defined.
    const float x = random_float(random, low, high), y = random_float(random, low, high);
    return {x, y, random_float(random, low, high)};
}

dvec3 origin_of(const Ray& ray) {
    return {ray.origin[0], ray.origin[1], ray.origin[2]};
}
dvec3 direction_of(const Ray& ray) {
    return {ray.direction[0], ray.direction[1], ray.direction[2]};
}

std::vector<vec4> make_triangles(std::size_t count, std::uint32_t seed) {
    Random random(seed);
    std::vector<vec4> rows;
    for (std::size_t i = 0; i < 3 * count; ++i) rows.emplace_back(random_point(random, -1, 1), 0.0f);
    return rows;
}

std::vector<vec4> make_spheres(std::size_t count, std::uint32_t seed) {
    Random random(seed);
    std::vector<vec4> rows;
    for (std::size_t i = 0; i < count; ++i) {
        const vec3 center = random_point(random, -1, 1);
        rows.emplace_back(center, random_float(random, 0.05f, 0.5f));
    }
    return rows;
}

std::vector<vec4> make_planes(std::size_t count, std::uint32_t seed) {
    Random random(seed);
    std::vector<vec4> rows;
    for (std::size_t i = 0; i < count; ++i) {
        rows.emplace_back(random_point(random, -1, 1), 0.0f);
        rows.emplace_back(glm::normalize(random_point(random, -1, 1) + vec3(0.0f, 0.0f, 1e-3f)), 0.0f);
    }
    return rows;
}

std::vector<vec4> make_boxes(std::size_t count, std::uint32_t seed) {
    Random random(seed);
    std::vector<vec4> rows;
    for (std::size_t i = 0; i < count; ++i) {
        const vec3 one = random_point(random, -1, 1), other = one + random_point(random, -0.5f, 0.5f);
        rows.emplace_back(glm::min(one, other), 0.0f);
        rows.emplace_back(glm::max(one, other), 0.0f);
    }
    return rows;
}

/// Returns the verdict for a hit at t with an error of at most `error`: it may be a hit if `is_near`, and must be one
/// if `is_sure`, each only if t lies in the ray's range.
Verdict at(double t, double error, bool is_near, bool is_sure) {
    return {is_near && t >= -error, is_sure && t > error, t - error, t + error};
}

Verdict judge_triangle(const Ray& ray, const vec4* rows) {
    const auto exact = reference::intersect_triangle(origin_of(ray), direction_of(ray), dvec3(rows[0]), dvec3(rows[1]),
                                                     dvec3(rows[2]));
    if (!exact) return {true, false, -kInfinity, kInfinity};  // edge-on: rounding decides
    const double error = 16 * kUnit * exact->condition;
    return at(exact->t, error * (1.0 + std::fabs(exact->t)), exact->inside() >= -error, exact->inside() > error);
}

Verdict judge_sphere(const Ray& ray, const vec4* rows) {
    const auto exact =
        reference::intersect_sphere(vec3(origin_of(ray)), vec3(direction_of(ray)), vec3(rows[0]), rows[0].w);
    constexpr double kDiscriminantError = 0x1p-44;
    if (std::fabs(double(exact.grazing)) < kDiscriminantError) return {true, false, -kInfinity, kInfinity};
    if (exact.grazing < 0) return {};
    const double sensitivity = double(exact.sensitivity) * kDiscriminantError;
    const double near_t = double(exact.near_t), far_t = double(exact.far_t);
    const double near_error = 4 * kUnit * std::fabs(near_t) + sensitivity,
                 far_error = 4 * kUnit * std::fabs(far_t) + sensitivity;
    if (near_t > near_error) return at(near_t, near_error, true, true);
    if (near_t < -near_error) return at(far_t, far_error, true, true);
    return {true, far_t > far_error, near_t - near_error, far_t + far_error};  // begins on the sphere
}

Verdict judge_plane(const Ray& ray, const vec4* rows) {
    const dvec3 n(rows[1]), d = direction_of(ray), s = dvec3(rows[0]) - origin_of(ray);
    const double along = glm::dot(n, d), t = glm::dot(n, s) / along;
    const double along_error = glm::dot(glm::abs(n), glm::abs(d)) / std::fabs(along);
    if (!(along_error * 4 * kUnit < 0.5)) return {true, false, -kInfinity, kInfinity};  // parallel within rounding
    return at(t, 4 * kUnit * (glm::dot(glm::abs(n), glm::abs(s)) / std::fabs(along) + std::fabs(t) * along_error), true,
              true);
}

Verdict judge_box(const Ray& ray, const vec4* rows) {
    // The largest enlargement of a box that the comments of ray.cl allow.
    const dvec3 o = origin_of(ray), d = direction_of(ray), lower(rows[0]), upper(rows[1]);
    const double most = 1.5 * 0x1p-18 * (kLargestCoordinate + 2.0);
    const auto exact = reference::intersect_box(o, d, lower, upper),
               enlarged = reference::intersect_box(o, d, lower - most, upper + most);
    const bool may_hit = std::max(enlarged.entry, 0.0) <= enlarged.exit,
               must_hit = std::max(exact.entry, 0.0) <= exact.exit;
    return {may_hit, must_hit, std::max(enlarged.entry, 0.0), must_hit ? std::max(exact.entry, 0.0) : enlarged.exit};
}

}  // namespace

const std::array<TestedFunction, 6> kTestedFunctions{{
    {"intersect_triangle", 3, make_triangles, judge_triangle},
    {"intersect_triangle_plane", 3, make_triangles, judge_triangle},
    {"intersect_triangle_cramer", 3, make_triangles, judge_triangle},
    {"intersect_sphere", 1, make_spheres, judge_sphere},
    {"intersect_plane", 2, make_planes, judge_plane},
    {"box_interval", 2, make_boxes, judge_box},
}};

std::vector<Ray> make_case_rays(std::size_t count, std::uint32_t seed) {
    Random random(seed);
    std::vector<Ray> rays;
    rays.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const vec3 o = random_point(random, -2, 2), d = random_point(random, -1, 1) - o;
        rays.push_back({{o.x, o.y, o.z}, 0.0f, {d.x, d.y, d.z}, std::numeric_limits<float>::infinity()});
    }
    return rays;
}

}  // namespace castor
