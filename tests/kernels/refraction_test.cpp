// Reflection and refraction by dielectrics against double precision: Snell, Fresnel, Beer, and rough directions.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <vector>

#include "reference/random_source.h"
#include "reference/rays.h"
#include "reference/shading.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec2;
using glm::vec3;
using glm::vec4;

constexpr double kEpsilon = 0x1p-24;

struct Case {
    float index = 1.5f;
    vec3 normal{0, 0, 1};
    vec3 wo{0, 0, 1};
    vec3 absorption{0};
    float length = 1.0f;
    float roughness = 0.0f;
    vec2 point{0.5f};
};

struct Result {
    vec3 direction;
    float reflectance;
    vec4 left;
    vec4 rough;
};

std::vector<Result> run(const std::vector<Case>& cases) {
    std::vector<vec4> normal_index, wo_length, absorption_roughness;
    std::vector<vec2> points;
    for (const Case& one : cases) {
        normal_index.emplace_back(one.normal, one.index);
        wo_length.emplace_back(one.wo, one.length);
        absorption_roughness.emplace_back(one.absorption, one.roughness);
        points.push_back(one.point);
    }
    KernelFixture fixture;
    return fixture.run<Result>("refraction_test", cases.size(), normal_index, wo_length, absorption_roughness, points);
}

vec3 unit(RandomSource& random) {
    return glm::normalize(random.in_box(-1, 1) + vec3(1e-4f));
}

}  // namespace

TEST_CASE("refract agrees with double precision", "[kernels][oclgrind]") {
    RandomSource random(81);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(50'000); ++i) {
        cases.push_back({random.uniform_float(0.4f, 3.0f), unit(random), unit(random)});
        if (i % 5 == 0) cases.back().index = 1.0f;
    }
    const std::vector<Result> found = run(cases);
    std::size_t total = 0, refracted = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Case& one = cases[i];
        const reference::Refraction exact = reference::refract(one.index, one.normal, one.wo);
        const double c = std::fabs(glm::dot(dvec3(one.normal), dvec3(one.wo)));
        const double ratio = glm::dot(one.normal, one.wo) > 0 ? 1.0 / one.index : one.index;
        const double d2 = 1.0 - ratio * ratio * (1.0 - c * c);  // the square of the other cosine
        CAPTURE(i, one.index, c, d2, found[i].reflectance, exact.reflectance);
        REQUIRE(found[i].reflectance >= 0.0f);
        REQUIRE(found[i].reflectance <= 1.0f);
        if (std::fabs(d2) < 1e-4 || c < 1e-2) continue;  // where rounding decides, and slopes are steep
        if (d2 < 0.0) {
            ++total;
            REQUIRE(found[i].reflectance == 1.0f);
            continue;
        }
        ++refracted;
        // Some roundings of the sine's square become errors of the cosine, the larger the smaller it is.
        const double error = 16 * kEpsilon * (1.0 + ratio * ratio) / d2 / c;
        REQUIRE(std::fabs(found[i].reflectance - exact.reflectance) <= error);
        REQUIRE(glm::length(dvec3(found[i].direction) - exact.direction) <= error);
    }
    CHECK(total > cases.size() / 20);
    CHECK(refracted > cases.size() / 2);
}

TEST_CASE("refract settles the named cases", "[kernels][oclgrind]") {
    const vec3 up(0, 0, 1), down(0, 0, -1), grazing(1, 0, 0), oblique(0.6f, 0, 0.8f);
    // At normal incidence ((n-1)/(n+1))^2; nothing is reflected where both sides are alike.
    const std::vector<Case> cases{{1.5f, up, up},       {1.5f, up, down},     {1.0f, up, oblique},
                                  {1.5f, up, grazing},  {1.5f, up, -oblique}, {0.0f, up, oblique},
                                  {0.0f, up, -oblique}, {3e38f, up, oblique}, {3e38f, up, -oblique}};
    const std::vector<Result> found = run(cases);
    CHECK(std::fabs(found[0].reflectance - 0.04f) <= 4 * kEpsilon);
    CHECK(found[0].direction == down);
    CHECK(std::fabs(found[1].reflectance - 0.04f) <= 4 * kEpsilon);
    CHECK(found[1].direction == up);
    CHECK(found[2].reflectance <= 4 * kEpsilon);
    CHECK(glm::length(found[2].direction + oblique) <= 4 * kEpsilon);
    CHECK(found[3].reflectance == 1.0f);
    CHECK(found[4].reflectance < 0.2f);  // sin 0.9: just below the critical angle
    for (std::size_t i = 5; i < cases.size(); ++i) {
        CAPTURE(i, found[i].reflectance);
        CHECK(found[i].reflectance >= 0.0f);
        CHECK(found[i].reflectance <= 1.0f);
    }
}

TEST_CASE("transmittance is Beer's law, also of no and of infinite ways", "[kernels][oclgrind]") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::vector<Case> cases;
    for (const float length : {0.0f, 1e-6f, 0.3f, 10.0f, 1000.0f, kInfinity}) {
        cases.emplace_back();
        cases.back().absorption = {0.0f, 0.1f, 2.5f};
        cases.back().length = length;
    }
    const std::vector<Result> found = run(cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        CAPTURE(cases[i].length);
        CHECK(found[i].left.x == 1.0f);
        for (int k = 1; k < 3; ++k) {
            const double way = double(cases[i].absorption[k]) * cases[i].length;
            const double tolerance = std::isinf(way) ? 0.0 : (2 + way) * kEpsilon * std::exp(-way) + 1e-44;
            CHECK(std::fabs(found[i].left[k] - std::exp(-way)) <= tolerance);
        }
    }
}

TEST_CASE("rough directions fill a square around the smooth one", "[kernels][oclgrind]") {
    RandomSource random(82);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(20'000); ++i) {
        cases.emplace_back();
        cases.back().wo = i % 7 ? unit(random) : vec3(0, 0, i % 2 ? 1 : -1);
        cases.back().roughness = i % 3 ? random.uniform_float(0.0f, 2.0f) : 0.0f;
        cases.back().point = {random.uniform_float(0, 1), random.uniform_float(0, 1)};
    }
    const std::vector<Result> found = run(cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Case& one = cases[i];
        const dvec3 d(one.wo), rough(found[i].rough);
        CAPTURE(i, one.roughness, one.point.x, one.point.y);
        if (one.roughness == 0.0f) {
            REQUIRE(vec3(found[i].rough) == one.wo);
            continue;
        }
        // The way from d, perpendicular to it, is roughness times the point less its centre.
        const dvec3 offset = rough / glm::dot(rough, d) - d;
        const double expected = one.roughness * std::hypot(one.point.x - 0.5, one.point.y - 0.5);
        REQUIRE(std::fabs(glm::length(rough) - 1.0) <= 4 * kEpsilon);
        REQUIRE(std::fabs(glm::length(offset) - expected) <= 32 * kEpsilon);
    }
}

}  // namespace castor::test
