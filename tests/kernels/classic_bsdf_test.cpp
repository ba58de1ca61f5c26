// Materials of the scene format: that directions are drawn with the density that is stated, and that what they weigh is
// value over density.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "castor/shared/types.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "support/direction_bins.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec2;
using glm::dvec3;
using glm::vec3;
using glm::vec4;
using reference::RandomSource;

constexpr double kPi = std::numbers::pi;
constexpr std::uint32_t kModels[] = {CASTOR_BRDF_BLINN_PHONG,
                                     CASTOR_BRDF_MODIFIED_BLINN_PHONG,
                                     CASTOR_BRDF_MODIFIED_BLINN_PHONG | CASTOR_BRDF_NORMALIZED,
                                     CASTOR_BRDF_PHONG,
                                     CASTOR_BRDF_MODIFIED_PHONG,
                                     CASTOR_BRDF_MODIFIED_PHONG | CASTOR_BRDF_NORMALIZED,
                                     CASTOR_BRDF_TORRANCE_SPARROW,
                                     CASTOR_BRDF_TORRANCE_SPARROW | CASTOR_BRDF_DIFFUSE_FRESNEL};

struct Case {
    shared::Material material{};
    vec3 wo{0, 0, 1};
    std::uint32_t flags = CASTOR_PATH_BY_BRDF;
};

struct Result {
    vec4 wi_density, weight, evaluated;

    dvec3 wi() const { return dvec3(wi_density); }
    double pdf() const { return wi_density.w; }
};

void store(float (&to)[3], const vec3& from) {
    for (int i = 0; i < 3; ++i) to[i] = from[i];
}

/// Every model, exponent and incidence. With one of the exponents there is a mirror too.
std::vector<Case> all_cases() {
    std::vector<Case> cases;
    for (const std::uint32_t model : kModels)
        for (const float exponent : {4.0f, 60.0f, 1000.0f})
            for (const double degrees : {0.0, 30.0, 60.0, 85.0}) {
                const double theta = degrees * kPi / 180.0;
                Case one;
                one.wo = vec3(dvec3(std::sin(theta) * 0.6, std::sin(theta) * 0.8, std::cos(theta)));
                one.material.brdf = model;
                one.material.phong_exponent = exponent;
                one.material.refraction_index = 1.5f;
                store(one.material.diffuse, {0.5f, 0.4f, 0.3f});
                store(one.material.specular, {0.2f, 0.3f, 0.4f});
                if (exponent == 60.0f) {
                    one.material.kind = CASTOR_MATERIAL_MIRROR;
                    store(one.material.mirror, {0.1f, 0.2f, 0.3f});
                }
                cases.push_back(one);
            }
    return cases;
}

/// `choices`, `wis`: as many, a multiple of 16.
std::vector<Result> run(const Case& one, const std::vector<vec4>& choices, const std::vector<vec4>& wis) {
    static KernelFixture fixture;
    shared::PathParams path{};
    path.flags = one.flags;
    std::vector<vec4> wo_choice, points;
    for (const vec4& choice : choices) {
        wo_choice.emplace_back(one.wo, choice.z);
        points.emplace_back(choice.x, choice.y, 0.0f, 0.0f);
    }
    const std::uint32_t lanes = fixture.context().quirks().lanes;
    const std::string name = "classic_bsdf_test", width = std::to_string(lanes);
    return fixture.run_kernel<Result>(name + ".x" + width, lanes > 1 ? name + width : name, choices.size(),
                                      shared::RenderParams{}, path, std::vector{one.material}, wo_choice, points, wis);
}

std::vector<Result> draw(const Case& one, std::size_t count, std::uint64_t seed) {
    RandomSource random(seed);
    const auto unit = [&] { return static_cast<float>(random.bits() >> 8) * 0x1p-24f; };
    std::vector<vec4> choices;
    for (std::size_t i = 0; i < count; ++i) {
        const float x = unit(), y = unit();
        choices.emplace_back(x, y, unit(), 0.0f);
    }
    return run(one, choices, std::vector<vec4>(count, vec4(0.0f)));
}

std::vector<Result> evaluate(const Case& one, const std::vector<vec3>& wis) {
    std::vector<vec4> rows;
    for (const vec3& wi : wis) rows.emplace_back(wi, 1.0f);
    return run(one, std::vector<vec4>(wis.size(), vec4(0.5f)), rows);
}

/// The chart of a highlight: x = 1 - cos^(p + 1) and azimuth, around the mirrored direction (Phong) or, of half
/// vectors, around the normal.
Chart highlight(const Case& one) {
    const std::uint32_t model = one.material.brdf & CASTOR_BRDF_MODEL_MASK;
    const bool is_phong = model == CASTOR_BRDF_PHONG || model == CASTOR_BRDF_MODIFIED_PHONG;
    const double power = double(one.material.phong_exponent) + 1.0;
    const dvec3 wo = glm::normalize(dvec3(one.wo)), mirrored(-wo.x, -wo.y, wo.z);
    const dvec3 axis = is_phong ? mirrored : dvec3(0, 0, 1);
    const dvec3 u = glm::normalize(glm::cross(axis, dvec3(0.8, -0.6, 0))), v = glm::cross(axis, u);
    return {[=](const dvec3& wi) {
                const dvec3 at = is_phong ? wi : glm::normalize(wo + wi);
                const double cosine = glm::dot(at, axis);
                if (!(wi.z > 0.0 && cosine > 0.0)) return dvec2(-1);
                return dvec2(1 - std::pow(cosine, power),
                             0.5 + std::atan2(glm::dot(at, v), glm::dot(at, u)) / (2 * kPi));
            },
            [=](const dvec2& square) {
                const double cosine = std::pow(1 - square.x, 1 / power), sine = std::sqrt(1 - cosine * cosine);
                const double phi = 2 * kPi * (square.y - 0.5);
                const dvec3 at = cosine * axis + sine * (std::cos(phi) * u + std::sin(phi) * v);
                const double angle = 2 * kPi * cosine / (power * (1 - square.x)), along = glm::dot(wo, at);
                if (is_phong) return std::pair(at, angle);
                return std::pair(2 * along * at - wo, along > 0.0 ? 4 * along * angle : 0.0);
            }};
}

}  // namespace

TEST_CASE("directions are drawn with the density that classic_densities states", "[kernels][classic_bsdf]") {
    constexpr std::size_t kCount = 20'000;
    std::vector<Case> cases = all_cases();
    for (std::size_t i = 0; i < 4; ++i) {
        cases.push_back(cases[i]);
        cases.back().flags = 0;  // uniformly
    }
    const double significance = 1 - std::pow(1 - 0.01, 1.0 / double(cases.size()));  // Sidak
    double least = 1.0;
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const Case& one = cases[k];
        const std::vector<Result> samples = draw(one, kCount, 300 + k);
        const auto densities_of = [&](const std::vector<vec3>& wis) {
            std::vector<double> densities;
            for (const Result& result : evaluate(one, wis)) densities.push_back(result.evaluated.w);
            return densities;
        };
        Bins bins;
        std::vector<Chart> charts{hemisphere(1)};
        if (one.flags & CASTOR_PATH_BY_BRDF) {
            const Chart bright = up_to(highlight(one), 0.99);
            charts = {bright, without(hemisphere(1), {bright})};
        }
        for (const Chart& chart : charts) add_chart(bins, chart, samples, densities_of, 10);
        const double p = chi_square(bins, kCount);
        least = std::min(least, p);
        CAPTURE(one.material.brdf, one.material.phong_exponent, one.material.kind, one.wo.z, one.flags, p,
                significance);
        CHECK(p >= significance);
    }
    WARN("chi-square of " << cases.size() << " cases with " << kCount << " directions each: least p " << least
                          << ", allowed " << significance);
}

TEST_CASE("what a classic direction weighs is its value over its density", "[kernels][classic_bsdf]") {
    RandomSource random(8);
    std::size_t mirrored = 0;
    const std::vector<Case> cases = all_cases();
    constexpr std::size_t kCount = 320;
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const Case& one = cases[k];
        CAPTURE(one.material.brdf, one.material.phong_exponent, one.wo.z);
        std::size_t drawn = 0;
        for (const Result& result : draw(one, kCount, k)) {
            CAPTURE(result.wi().x, result.wi().y, result.wi().z, result.pdf());
            REQUIRE(std::fabs(glm::length(result.wi()) - 1.0) <= 0x1p-20);
            if (result.pdf() == 0.0 && vec3(result.weight) != vec3(0)) {
                ++mirrored;
                REQUIRE(glm::length(result.wi() - dvec3(-one.wo.x, -one.wo.y, one.wo.z)) <= 0x1p-20);
            }
            if (!(result.pdf() > 0.0)) continue;
            ++drawn;
            REQUIRE(result.evaluated.w == result.wi_density.w);
            for (int channel = 0; channel < 3; ++channel) {
                const double expected = double(result.evaluated[channel]) / result.pdf();
                REQUIRE(std::fabs(result.weight[channel] - expected) <= 0x1p-22 * expected);
            }
        }
        CHECK(drawn > kCount / 4);
        // Whatever reflects light is drawn.
        std::vector<vec3> wis;
        for (std::size_t i = 0; i < kCount; ++i) wis.push_back(random.direction());
        for (const Result& result : evaluate(one, wis)) {
            const double value = result.evaluated.x;
            REQUIRE((value > 0.0) == (result.evaluated.w > 0.0f));
        }
    }
    // The largest channels decide: 0.3 of 1.2.
    CHECK(std::fabs(double(mirrored) / double(kCount * cases.size() / 3) - 0.25) <= 0.02);
}

}  // namespace castor::test
