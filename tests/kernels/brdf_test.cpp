// The models of BrdfModel against double precision, and against what each is known to do.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <iterator>
#include <numbers>
#include <vector>

#include "reference/random_source.h"
#include "reference/rays.h"
#include "reference/shading.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec3;
using glm::vec4;

constexpr std::uint32_t kModels[] = {CASTOR_BRDF_MODIFIED_BLINN_PHONG,
                                     CASTOR_BRDF_MODIFIED_BLINN_PHONG | CASTOR_BRDF_NORMALIZED,
                                     CASTOR_BRDF_PHONG,
                                     CASTOR_BRDF_MODIFIED_PHONG,
                                     CASTOR_BRDF_MODIFIED_PHONG | CASTOR_BRDF_NORMALIZED,
                                     CASTOR_BRDF_TORRANCE_SPARROW,
                                     CASTOR_BRDF_TORRANCE_SPARROW | CASTOR_BRDF_DIFFUSE_FRESNEL};

struct Case {
    shared::Light light{};
    shared::Material material{};
    vec3 normal{0, 0, 1};
    vec3 wo{0, 0, 1};
};

void store(float (&to)[3], const vec3& from) {
    for (int i = 0; i < 3; ++i) to[i] = from[i];
}

Case make_case(std::uint32_t brdf, const vec3& normal, const vec3& wo, const vec3& wi) {
    Case one;
    one.light.kind = CASTOR_LIGHT_DIRECTIONAL;
    store(one.light.direction, -wi);
    store(one.light.intensity, vec3(1, 2, 3));
    one.material.brdf = brdf;
    store(one.material.diffuse, {0.5f, 0.4f, 0.3f});
    store(one.material.specular, {0.2f, 0.3f, 0.4f});
    one.material.phong_exponent = 20.0f;
    one.material.refraction_index = 0.37f;
    one.material.absorption_index = 2.82f;
    one.normal = normal;
    one.wo = wo;
    return one;
}

std::vector<vec4> run(const std::vector<Case>& cases) {
    std::vector<shared::Light> lights;
    std::vector<shared::Material> materials;
    std::vector<vec4> normals, wos;
    for (const Case& one : cases) {
        lights.push_back(one.light);
        materials.push_back(one.material);
        normals.emplace_back(one.normal, 0.0f);
        wos.emplace_back(one.wo, 0.0f);
    }
    KernelFixture fixture;
    return fixture.run<vec4>("brdf_test", cases.size(), lights, materials, normals, wos);
}

}  // namespace

TEST_CASE("models of reflection agree with double precision", "[kernels][oclgrind]") {
    RandomSource random(91);
    const auto unit = [&] { return glm::normalize(random.in_box(-1, 1) + vec3(1e-4f)); };
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(30'000); ++i) {
        cases.push_back(make_case(kModels[i % std::size(kModels)], unit(), unit(), unit()));
        cases.back().material.phong_exponent = random.uniform_float(0, 200);
        cases.back().material.refraction_index = random.uniform_float(0.1f, 4);
        cases.back().material.absorption_index = i % 2 ? random.uniform_float(0, 5) : 0.0f;
    }
    const std::vector<vec4> found = run(cases);
    std::size_t compared = 0, lit = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Case& one = cases[i];
        const reference::LightSample light = reference::sample_light(one.light, dvec3(0.0));
        const dvec3 normal(one.normal), wo(one.wo), sum = light.wi + wo;
        const double l = glm::dot(normal, light.wi), v = glm::dot(normal, wo);
        // Where rounding decides on which side something is.
        const double h = glm::dot(normal, glm::normalize(sum)), r = glm::dot(2.0 * l * normal - light.wi, wo);
        const double least = std::min({std::fabs(l), std::fabs(v), std::fabs(h), std::fabs(r)});
        if (least < 1e-3 || glm::length(sum) < 1e-1) continue;
        ++compared;
        const dvec3 exact = reference::brdf(one.material, normal, wo, light);
        lit += exact.x > 0.0;
        // The power multiplies a relative error of its base by the exponent; a lobe's edge is where the base vanishes.
        const double tolerance = 3.0 * (64 + 64.0 * one.material.phong_exponent) * 0x1p-24 *
                                 (1.0 + one.material.phong_exponent) / std::min(1.0, std::fabs(v));
        CAPTURE(i, one.material.brdf, one.material.phong_exponent, l, v, found[i].x, exact.x);
        REQUIRE(glm::length(dvec3(found[i]) - exact) <= tolerance);
    }
    CHECK(compared > cases.size() * 9 / 10);
    CHECK(lit > cases.size() / 3);
}

TEST_CASE("models of reflection have the values that are derived by hand", "[kernels][oclgrind]") {
    // Light, normal and view along one line: all cosines are 1. kd = 0.5, ks = 0.2, p = 20, E = 1 in red.
    const double pi = std::numbers::pi, f = (0.63 * 0.63 + 2.82 * 2.82) / (1.37 * 1.37 + 2.82 * 2.82);
    const double expected[] = {0.7,
                               (0.5 + 0.2 * 28 / 8) / pi,
                               0.7,
                               0.7,
                               (0.5 + 0.2 * 22 / 2) / pi,
                               (0.5 + 0.2 * 22 / 2 * f / 4) / pi,
                               (0.5 * (1 - f) + 0.2 * 22 / 2 * f / 4) / pi};
    const vec3 up(0, 0, 1);
    std::vector<Case> cases;
    for (const std::uint32_t model : kModels) cases.push_back(make_case(model, up, up, up));
    for (const std::uint32_t model : kModels) cases.push_back(make_case(model, up, up, -up));  // lit from behind
    for (const std::uint32_t model : kModels) cases.push_back(make_case(model, up, -up, up));  // seen from behind
    const std::vector<vec4> found = run(cases);
    for (std::size_t i = 0; i < std::size(kModels); ++i) {
        CAPTURE(kModels[i]);
        CHECK(std::fabs(found[i].x - expected[i]) <= 1e-6);
        CHECK(vec3(found[std::size(kModels) + i]) == vec3(0));
        for (int k = 0; k < 3; ++k) CHECK(std::isfinite(found[2 * std::size(kModels) + i][k]));
    }
}

}  // namespace castor::test
