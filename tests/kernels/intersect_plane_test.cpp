#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/random_source.h"
#include "support/rays.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec3;
using shared::Ray;

struct Case {
    Ray ray;
    vec3 point, normal;
};

std::vector<float> run(KernelFixture& fixture, const std::vector<Case>& cases) {
    std::vector<Ray> rays;
    std::vector<vec3> points, normals;
    for (const Case& one : cases) {
        rays.push_back(one.ray);
        points.push_back(one.point);
        normals.push_back(one.normal);
    }
    return fixture.run<float>("intersect_plane_test", cases.size(), rays, points, normals);
}

// t = n.(p - o) / n.d; each dot product is off by a few roundings of its terms' magnitudes.
bool agrees(const Case& one, float found) {
    const dvec3 n(one.normal), d(direction_of(one.ray)), s = dvec3(one.point) - dvec3(origin_of(one.ray));
    const double above = glm::dot(n, s), along = glm::dot(n, d), t = above / along;
    const double along_error = glm::dot(glm::abs(n), glm::abs(d)) / std::fabs(along);
    const double tolerance =
        4 * 0x1p-24 * (glm::dot(glm::abs(n), glm::abs(s)) / std::fabs(along) + std::fabs(t) * along_error);
    if (!(along_error * 4 * 0x1p-24 < 0.5)) return true;  // parallel but for rounding
    if (std::isnan(found)) return t < one.ray.t_min + tolerance || t > one.ray.t_max - tolerance;
    return found >= one.ray.t_min && found <= one.ray.t_max && std::fabs(found - t) <= tolerance;
}

}  // namespace

TEST_CASE("intersect_plane agrees with double precision", "[kernels][oclgrind]") {
    RandomSource random(31);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(200'000); ++i) {
        const float scale = std::exp2(random.uniform_float(-10, 20));
        const float t_min = i % 3 ? 0.0f : random.uniform_float(-1, 1) * scale;
        const float t_max = i % 3 ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 3) * scale;
        cases.push_back({make_ray(random.in_box(-scale, scale), random.direction(), t_min, t_max),
                         random.in_box(-scale, scale), random.direction()});
    }
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < cases.size() && wrong < 3; ++i) {
        if (agrees(cases[i], found[i])) continue;
        ++wrong;
        CAPTURE(i, to_text(cases[i].ray), to_text(cases[i].point), to_text(cases[i].normal), found[i]);
        CHECK(agrees(cases[i], found[i]));
    }
}

TEST_CASE("intersect_plane settles the named cases", "[kernels][oclgrind]") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity(), kMiss = std::numeric_limits<float>::quiet_NaN();
    const vec3 point(5, 1, -7), up(0, 1, 0);
    struct Named {
        const char* name;
        Case input;
        float t;
    };
    const std::vector<Named> named{
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
