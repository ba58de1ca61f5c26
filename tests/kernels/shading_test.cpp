#include "reference/shading.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <vector>

#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec3;
using glm::vec4;

constexpr double kEpsilon = 0x1p-24;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Case {
    shared::Light light{};
    shared::Material material{};
    cl_uint rules = 0;
    vec3 position{0};
    vec3 normal{0, 0, 1};
    vec3 wo{0, 0, 1};
    float cos_angle = 1.0f;  // of spot_falloff, conductor_reflectance and mirror_factor
};

struct Result {
    vec3 wi;
    float distance;
    vec3 irradiance;
    float falloff;
    vec3 reflected;
    float reflectance;
    vec3 mirror_factor;
    float unused;
};

std::vector<Result> run(KernelFixture& fixture, const std::vector<Case>& cases) {
    std::vector<shared::Light> lights;
    std::vector<shared::Material> materials;
    std::vector<cl_uint> rules;
    std::vector<vec4> positions, normal_cos_angle, wos;
    for (const Case& one : cases) {
        lights.push_back(one.light);
        materials.push_back(one.material);
        rules.push_back(one.rules);
        positions.emplace_back(one.position, 0.0f);
        normal_cos_angle.emplace_back(one.normal, one.cos_angle);
        wos.emplace_back(one.wo, 0.0f);
    }
    return fixture.run<Result>("shading_test", cases.size(), lights, materials, rules, positions, normal_cos_angle,
                               wos);
}

Result run(const Case& one) {
    KernelFixture fixture;
    return run(fixture, {one})[0];
}

void store(float (&to)[3], vec3 from) {
    for (int k = 0; k < 3; ++k) to[k] = from[k];
}

shared::Light make_light(cl_uint kind, vec3 position, vec3 intensity, vec3 direction = {0, 0, -1}) {
    shared::Light light{};
    light.kind = kind;
    store(light.position, position);
    store(light.intensity, intensity);
    store(light.direction, direction);
    return light;
}

shared::Material make_material(vec3 diffuse, vec3 specular, float exponent) {
    shared::Material material{};
    store(material.diffuse, diffuse);
    store(material.specular, specular);
    material.phong_exponent = exponent;
    return material;
}

/// On a grid so coarse that differences of two such points are exact.
vec3 grid_point(RandomSource& random) {
    return glm::round(random.in_box(-8, 8) * 1024.0f) / 1024.0f;
}

Case random_case(RandomSource& random) {
    Case one;
    one.light = make_light(random.below(3), grid_point(random), random.in_box(0, 1000), random.direction());
    one.light.cos_coverage = random.uniform_float(-1, 0.8f);
    one.light.cos_falloff = one.light.cos_coverage + random.uniform_float(0.1f, 1 - one.light.cos_coverage);
    const float exponents[] = {0, 1, 2.5f, 50, 1000, 10000};
    one.material = make_material(random.in_box(0, 1), random.in_box(0, 1), exponents[random.below(6)]);
    one.material.refraction_index = random.uniform_float(0.01f, 4);
    one.material.absorption_index = random.uniform_float(0, 8);
    one.rules = random.below(2) ? CASTOR_RULE_HIGHLIGHT_BEHIND : 0;
    one.position = grid_point(random);
    one.normal = random.direction();
    one.wo = random.direction();
    if (random.below(2)) {  // near the highlight
        const dvec3 wi = reference::sample_light(one.light, one.position).wi;
        one.wo = vec3(glm::normalize(2 * glm::dot(wi, dvec3(one.normal)) * dvec3(one.normal) - wi +
                                     dvec3(random.in_box(-0.01f, 0.01f))));
    }
    one.cos_angle = random.uniform_float(0, 1);
    return one;
}

double largest(dvec3 v) {
    return std::fmax(std::fabs(v.x), std::fmax(std::fabs(v.y), std::fabs(v.z)));
}

}  // namespace

TEST_CASE("sample_light agrees with double precision", "[kernels][oclgrind]") {
    RandomSource random(41);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(50'000); ++i) cases.push_back(random_case(random));
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const shared::Light& light = cases[i].light;
        const reference::LightSample exact = reference::sample_light(light, cases[i].position);
        CAPTURE(i, light.kind, to_text(cases[i].position), found[i].distance, exact.distance);
        // The offset is exact; then three roundings of its square, a root, a quotient and a product.
        REQUIRE(largest(dvec3(found[i].wi) - exact.wi) <= 6 * kEpsilon);
        if (light.kind == CASTOR_LIGHT_DIRECTIONAL)
            REQUIRE(found[i].distance == kInfinity);
        else
            REQUIRE(std::fabs(found[i].distance - exact.distance) <= 4 * kEpsilon * exact.distance);
        // A spot light's cosine has an error of some roundings, which the fourth power's slope amplifies.
        const dvec3 unshaded = light.kind == CASTOR_LIGHT_DIRECTIONAL
                                   ? exact.irradiance
                                   : reference::to_dvec3(light.intensity) / (exact.distance * exact.distance);
        const double slope = light.kind == CASTOR_LIGHT_SPOT ? 4.0 / (light.cos_falloff - light.cos_coverage) : 0.0;
        REQUIRE(largest(dvec3(found[i].irradiance) - exact.irradiance) <=
                (8 + 16 * slope) * kEpsilon * largest(unshaded));
    }
}

TEST_CASE("sample_light settles lights at the surface, and sums that would overflow", "[kernels][oclgrind]") {
    struct Named {
        const char* name;
        vec3 light, position, intensity;
        float distance;
        vec3 wi, irradiance;
    };
    const std::vector<Named> named{
        {"overhead", {0, 0, 2}, {0, 0, 0}, {4, 8, 12}, 2, {0, 0, 1}, {1, 2, 3}},
        {"at the surface", {1, 2, 3}, {1, 2, 3}, {1, 1, 1}, 0, {0, 0, 0}, {0, 0, 0}},
        {"so near that the square vanishes", {0x1p-100f, 0, 0}, {0, 0, 0}, {1, 1, 1}, 0, {0, 0, 0}, {0, 0, 0}},
        {"limited irradiance", {0x1p-60f, 0, 0}, {0, 0, 0}, {1, 0, -1}, 0x1p-60f, {1, 0, 0}, {1e30f, 0, -1e30f}},
        {"limited intensity", {0, 0x1p-4f, 0}, {0, 0, 0}, {3e38f, 0, 1}, 0x1p-4f, {0, 1, 0}, {1e30f, 0, 256}},
        {"far away", {0, 0, -1e12f}, {0, 0, 1e12f}, {1e20f, 0, 0}, 2e12f, {0, 0, -1}, {0.25e-4f, 0, 0}},
    };
    std::vector<Case> cases;
    for (const Named& one : named) {
        cases.emplace_back();
        cases.back().light = make_light(CASTOR_LIGHT_POINT, one.light, one.intensity);
        cases.back().position = one.position;
        cases.back().material = make_material(vec3(1), vec3(1), 10);
        cases.back().rules = CASTOR_RULE_HIGHLIGHT_BEHIND;
    }
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < named.size(); ++i) {
        CAPTURE(named[i].name, to_text(found[i].wi), to_text(found[i].irradiance), found[i].distance);
        CHECK(largest(dvec3(found[i].wi - named[i].wi)) <= 2 * kEpsilon);
        CHECK(largest(dvec3(found[i].irradiance) - dvec3(named[i].irradiance)) <=
              4 * kEpsilon * largest(named[i].irradiance));
        CHECK(std::fabs(double(found[i].distance) - named[i].distance) <= 2 * kEpsilon * named[i].distance);
        CHECK(std::isfinite(largest(found[i].reflected)));
    }
    CHECK(found[1].reflected == vec3(0));
    CHECK(found[2].reflected == vec3(0));
}

TEST_CASE("spot_falloff agrees with double precision, and is exact at the cones", "[kernels][oclgrind]") {
    RandomSource random(42);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(20'000); ++i) {
        cases.push_back(random_case(random));
        Case& one = cases.back();
        const float between = random.uniform_float(one.light.cos_coverage, one.light.cos_falloff);
        const float angles[] = {one.light.cos_falloff, one.light.cos_coverage, between, random.uniform_float(-1, 1)};
        one.cos_angle = angles[i % 4];
        one.light.mapping = i / 4 % 2 ? CASTOR_SPOT_SQUARE : CASTOR_SPOT_FOURTH_POWER;
    }
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const shared::Light& light = cases[i].light;
        const double exact = reference::spot_falloff(cases[i].cos_angle, light);
        CAPTURE(i, cases[i].cos_angle, light.cos_coverage, light.cos_falloff, light.mapping, found[i].falloff, exact);
        // Three roundings, to the fourth power, and two products.
        REQUIRE(std::fabs(found[i].falloff - exact) <= 16 * kEpsilon * exact);
        if (i % 4 == 0) REQUIRE(found[i].falloff == 1.0f);
        if (i % 4 == 1) REQUIRE(found[i].falloff == 0.0f);
    }
}

TEST_CASE("a spot light with equal cones has a sharp edge, and NaN is outside", "[kernels][oclgrind]") {
    Case one;
    one.light.cos_coverage = one.light.cos_falloff = 0.5f;
    one.cos_angle = 0.5f;
    CHECK(run(one).falloff == 1.0f);
    one.cos_angle = std::nextafter(0.5f, 0.0f);
    CHECK(run(one).falloff == 0.0f);
    one.cos_angle = std::numeric_limits<float>::quiet_NaN();
    CHECK(run(one).falloff == 0.0f);
}

TEST_CASE("blinn_phong agrees with double precision for exponents up to 10000", "[kernels][oclgrind]") {
    RandomSource random(43);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(50'000); ++i) cases.push_back(random_case(random));
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    std::size_t compared = 0, highlights = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Case& one = cases[i];
        const reference::LightSample light = reference::sample_light(one.light, one.position);
        const dvec3 n(one.normal), sum = light.wi + dvec3(one.wo);
        const double cos_light = glm::dot(n, light.wi), cos_half = glm::dot(n, glm::normalize(sum));
        // What side the light or the half vector is on may be lost to rounding here.
        if (std::fabs(cos_light) < 1e-5 || std::fabs(cos_half) < 1e-5 || glm::length(sum) < 1e-2) continue;
        ++compared;
        const bool behind = one.rules & CASTOR_RULE_HIGHLIGHT_BEHIND;
        const dvec3 exact = reference::blinn_phong(one.material, behind, n, one.wo, light);
        // An error of some roundings in n.h, more where wi and wo nearly cancel, becomes one of p (n.h)^(p-1) times it.
        const double p = one.material.phong_exponent;
        const double cos_error = 12 * kEpsilon / glm::length(sum) + 2 * kEpsilon;
        const double highlight = cos_half > 0 ? std::pow(cos_half, p) : 0.0;
        const double highlight_error = cos_half > 0 ? (std::exp(p * cos_error / cos_half) - 1) * highlight : 0.0;
        highlights += highlight > 0.1;
        const double slope =
            one.light.kind == CASTOR_LIGHT_SPOT ? 4.0 / (one.light.cos_falloff - one.light.cos_coverage) : 0.0;
        const double distance2 = light.distance * light.distance;
        const dvec3 unshaded = one.light.kind == CASTOR_LIGHT_DIRECTIONAL
                                   ? light.irradiance
                                   : reference::to_dvec3(one.light.intensity) / distance2;
        const double tolerance = largest(unshaded) * (2 * highlight_error + (32 + 32 * slope) * kEpsilon);
        CAPTURE(i, one.light.kind, p, behind, cos_light, cos_half, to_text(found[i].reflected), exact.x, exact.y,
                exact.z, tolerance);
        REQUIRE(largest(dvec3(found[i].reflected) - exact) <= tolerance);
    }
    CHECK(compared > cases.size() * 9 / 10);
    CHECK(highlights > cases.size() / 20);
}

TEST_CASE("blinn_phong settles the named cases", "[kernels][oclgrind]") {
    const vec3 grazing(1, 0, 0), up(0, 0, 1), down(0, 0, -1), half(0.6f, 0, 0.8f);
    struct Named {
        const char* name;
        vec3 wi, wo;
        float exponent;
        cl_uint rules;
        float reflected;  // diffuse 1, specular 2, irradiance 1
    };
    const cl_uint behind = CASTOR_RULE_HIGHLIGHT_BEHIND;
    const std::vector<Named> named{
        {"light and viewer overhead", up, up, 50, 0, 3},
        {"exponent 0", up, grazing, 0, 0, 3},
        {"exponent 0 and a half vector behind", half, down, 0, 0, 0.8f},
        {"exponent 10000 beside the highlight", up, grazing, 10000, 0, 1},
        {"exponent 10000 in the highlight", half, {-0.6f, 0, 0.8f}, 10000, 0, 2.8f},
        {"n.l = 0", grazing, up, 0, 0, 0},
        {"n.l = 0, highlights behind count", grazing, up, 0, behind, 2},
        {"light behind", down, up, 1, 0, 0},
        {"light behind, opposite the viewer", down, up, 1, behind, 0},
        {"light behind, highlights behind count", {0.6f, 0, -0.8f}, up, 0, behind, 2},
        {"viewer and light cancel", up, down, 1, 0, 1},
    };
    std::vector<Case> cases;
    for (const Named& one : named) {
        cases.emplace_back();
        cases.back().light = make_light(CASTOR_LIGHT_DIRECTIONAL, vec3(0), vec3(1), -one.wi);
        cases.back().material = make_material(vec3(1), vec3(2), one.exponent);
        cases.back().rules = one.rules;
        cases.back().wo = one.wo;
    }
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < named.size(); ++i) {
        CAPTURE(named[i].name, to_text(found[i].reflected));
        // The half vector of "in the highlight" is the normal but for roundings, of which 10000 are allowed to tell.
        CHECK(found[i].reflected.x == Approx(named[i].reflected).epsilon(1e-3));
        CHECK((named[i].reflected != 0.0f || found[i].reflected == vec3(0)));
    }
}

TEST_CASE("the brightest light and the strongest material stay finite", "[kernels][oclgrind]") {
    Case one;
    one.light = make_light(CASTOR_LIGHT_POINT, {0, 0, 0x1p-50f}, vec3(3e38f));
    one.material = make_material(vec3(0, 1, 1e6f), vec3(0, 1, 1e6f), 0);
    const Result found = run(one);
    CHECK(found.reflected.x == 0.0f);
    CHECK(found.reflected.y == Approx(2e30f));
    CHECK(found.reflected.z == Approx(2e36f));
}

TEST_CASE("conductor_reflectance agrees with double precision and with limits", "[kernels][oclgrind]") {
    RandomSource random(44);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(20'000); ++i) cases.push_back(random_case(random));
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const double n = cases[i].material.refraction_index, k = cases[i].material.absorption_index;
        const double exact = reference::conductor_reflectance(n, k, cases[i].cos_angle);
        CAPTURE(i, n, k, cases[i].cos_angle, found[i].reflectance, exact);
        // Both terms are quotients whose numerators may cancel but not exceed their denominators.
        REQUIRE(std::fabs(found[i].reflectance - exact) <= 8 * kEpsilon);
    }

    struct Named {
        const char* name;
        float n, k, cos_angle, reflectance;
    };
    const std::vector<Named> named{{"no change of medium", 1, 0, 1, 0},  {"grazing", 0.2f, 3, 0, 1},
                                   {"no indices", 0, 0, 0.5f, 1},        {"no indices, grazing", 0, 0, 0, 1},
                                   {"huge indices", 1e25f, 1e25f, 1, 1}, {"huge absorption", 0.2f, 3e38f, 0.5f, 1},
                                   {"tiny indices", 1e-30f, 0, 0, 1}};
    for (const Named& one : named) {
        Case input;
        input.material.refraction_index = one.n;
        input.material.absorption_index = one.k;
        input.cos_angle = one.cos_angle;
        CAPTURE(one.name);
        CHECK(run(input).reflectance == one.reflectance);
    }
}

TEST_CASE("mirror_factor follows kind and rules", "[kernels][oclgrind]") {
    const cl_uint kinds[] = {CASTOR_MATERIAL_PLAIN, CASTOR_MATERIAL_MIRROR, CASTOR_MATERIAL_CONDUCTOR,
                             CASTOR_MATERIAL_DIELECTRIC};
    const cl_uint any = CASTOR_RULE_MIRROR_ANY_MATERIAL, conductor = CASTOR_RULE_MIRROR_CONDUCTOR;
    const vec3 mirror(0.25f, 0.5f, 1);
    std::vector<Case> cases;
    std::vector<vec3> expected;
    for (cl_uint kind : kinds)
        for (cl_uint rules : {0u, any, conductor, any | conductor})
            for (float cos_angle : {0.75f, -0.75f}) {  // the back of a surface reflects as its front
                Case one;
                one.material.kind = kind;
                one.material.refraction_index = 0.2f;
                one.material.absorption_index = 3.0f;
                store(one.material.mirror, mirror);
                one.rules = rules;
                one.cos_angle = cos_angle;
                cases.push_back(one);
                expected.emplace_back(0);
                if ((rules & any) || kind == CASTOR_MATERIAL_MIRROR)
                    expected.back() = mirror;
                else if (kind == CASTOR_MATERIAL_CONDUCTOR && (rules & conductor))
                    expected.back() = mirror * static_cast<float>(reference::conductor_reflectance(0.2f, 3.0, 0.75));
            }
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        CAPTURE(cases[i].material.kind, cases[i].rules, cases[i].cos_angle, to_text(found[i].mirror_factor),
                to_text(expected[i]));
        CHECK(largest(dvec3(found[i].mirror_factor - expected[i])) <= 8 * kEpsilon);
    }
}

}  // namespace castor::test
