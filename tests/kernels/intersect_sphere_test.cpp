#include <cmath>
#include <glm/vec4.hpp>
#include <limits>
#include <vector>

#include "reference/intersect.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/random_source.h"
#include "support/rays.h"

namespace castor::test {
namespace {

using glm::vec3;
using glm::vec4;
using shared::Ray;

struct Case {
    Ray ray;
    vec4 sphere;  // centre and radius
};

std::vector<float> run(KernelFixture& fixture, const std::vector<Case>& cases) {
    std::vector<Ray> rays;
    std::vector<vec4> spheres;
    float largest = 0.0f;
    for (const Case& one : cases) {
        rays.push_back(one.ray);
        spheres.push_back(one.sphere);
        for (int k = 0; k < 3; ++k) largest = std::fmax(largest, std::fabs(one.sphere[k]) + one.sphere.w);
    }
    return fixture.run<float>("intersect_sphere_test", cases.size(), largest, rays, spheres);
}

// A few roundings at the end, and the error of a discriminant of 48 bits.
bool agrees(const Case& one, float t) {
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

void check_all(const std::vector<Case>& cases) {
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < cases.size() && wrong < 3; ++i) {
        if (agrees(cases[i], found[i])) continue;
        ++wrong;
        const auto exact = reference::intersect_sphere(origin_of(cases[i].ray), direction_of(cases[i].ray),
                                                       vec3(cases[i].sphere), cases[i].sphere.w);
        CAPTURE(i, to_text(cases[i].ray), to_text(vec3(cases[i].sphere)), cases[i].sphere.w, found[i], exact.near_t,
                exact.far_t, exact.grazing);
        CHECK(agrees(cases[i], found[i]));
    }
}

}  // namespace

TEST_CASE("intersect_sphere finds points of spheres of all sizes and distances", "[kernels][oclgrind]") {
    RandomSource random(21);
    for (float distance : {1.0f, 1e3f, 1e6f}) {
        for (float radius : {1e-3f, 1.0f, 1e3f, 1e6f}) {
            CAPTURE(distance, radius);
            std::vector<Case> cases;
            for (std::size_t i = 0; i < test_size(20'000, 64); ++i) {
                const vec3 center = random.in_box(-1, 1) * radius;
                const vec3 target = center + random.direction() * radius;
                const vec3 origin = target + random.direction() * distance;
                const vec3 direction = (target - origin) * (i % 2 ? 1.0f : random.uniform_float(1e-3f, 1e3f));
                cases.push_back({make_ray(origin, direction), vec4(center, radius)});
            }
            check_all(cases);
        }
    }
}

TEST_CASE("intersect_sphere agrees with extended precision on random rays", "[kernels][oclgrind]") {
    RandomSource random(22);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(200'000); ++i) {
        const float t_min = i % 3 ? 0.0f : random.uniform_float(-1, 1);
        const float t_max = i % 3 ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 2);
        cases.push_back({make_ray(random.in_box(-2, 2), random.direction(), t_min, t_max),
                         vec4(random.in_box(-1, 1), random.uniform_float(0.01f, 1.5f))});
    }
    check_all(cases);
}

TEST_CASE("intersect_sphere settles the named cases", "[kernels][oclgrind]") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity(), kMiss = std::numeric_limits<float>::quiet_NaN();
    const vec4 unit(0, 0, 0, 1);
    struct Named {
        const char* name;
        Case input;
        float t;
    };
    const std::vector<Named> named{
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
    KernelFixture fixture;
    std::vector<Case> cases;
    for (const Named& one : named) cases.push_back(one.input);
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < named.size(); ++i) {
        CAPTURE(named[i].name, found[i], named[i].t);
        CHECK((std::isnan(named[i].t) ? std::isnan(found[i]) : found[i] == named[i].t));
    }
}

}  // namespace castor::test
