// Physically based materials: that directions are drawn with the density that is stated, that energy is kept, and that
// nothing depends on the number of lanes. The statistics' full form, a million directions for each lobe, roughness and
// incidence, is the hidden tag [bsdf_full].
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "castor/shared/principled_material.h"
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
using shared::PrincipledMaterial;

constexpr double kPi = std::numbers::pi;
constexpr double kEpsilon = 0x1p-24;
constexpr float kRoughness[] = {0.03f, 0.1f, 0.3f, 0.6f, 1.0f};
constexpr double kDegrees[] = {0.0, 30.0, 60.0, 85.0};

struct Request {
    vec3 wo{0, 0, 1};
    std::uint32_t material = 0;
    bool is_inside = false;
};

struct Sample {
    vec4 wi_pdf;
    vec4 weight_delta;
    vec4 found;  // what evaluate_bsdf says

    dvec3 wi() const { return dvec3(wi_pdf); }
    double pdf() const { return wi_pdf.w; }
    bool is_delta() const { return weight_delta.w != 0.0f; }
};

PrincipledMaterial plain_material() {
    PrincipledMaterial material{};
    std::fill_n(material.base_color, 3, 1.0f);
    std::fill_n(material.specular_color, 3, 1.0f);
    std::fill_n(material.diffuse_transmission_color, 3, 1.0f);
    material.specular = 1.0f;
    material.roughness = 1.0f;
    material.refraction_index = 1.5f;
    return material;
}

vec3 direction(double degrees, double azimuth = 0.7) {
    const double theta = degrees * kPi / 180.0;
    return vec3(dvec3(std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth), std::cos(theta)));
}

/// Runs the kernels for some materials.
class Bsdfs {
public:
    /// `coat_normals`: of the first materials; (0,0,0): the coat has not its own.
    explicit Bsdfs(std::vector<PrincipledMaterial> materials, const std::vector<vec3>& coat_normals = {},
                   std::uint32_t lanes = 0)
        : materials_(std::move(materials)),
          coat_normals_(materials_.size(), vec4(0)),
          lanes_(lanes ? lanes : fixture().context().quirks().lanes) {
        for (std::size_t i = 0; i < coat_normals.size(); ++i)
            if (coat_normals[i] != vec3(0)) coat_normals_[i] = vec4(coat_normals[i], 1);
    }

    /// Draws `count` directions, a multiple of 16, for each of the requests, one request after the other.
    std::vector<Sample> sample(const std::vector<Request>& requests, std::size_t count, std::uint64_t seed) {
        RandomSource random(seed);
        std::vector<vec4> first, second;
        first.reserve(requests.size() * count);
        second.reserve(requests.size() * count);
        for (const Request& request : requests)
            for (std::size_t i = 0; i < count; ++i) {
                const auto unit = [&] { return static_cast<float>(random.bits() >> 8) * 0x1p-24f; };
                first.emplace_back(request.wo, unit());
                const float x = unit();
                second.emplace_back(x, unit(), request.material, request.is_inside);
            }
        return run<Sample>("sample_bsdf_test", first, second);
    }

    /// Returns values and densities of directions. Their number is a multiple of 16.
    std::vector<vec4> evaluate(const Request& request, const std::vector<vec3>& wis) {
        std::vector<vec4> first(wis.size(), vec4(request.wo, request.material)), second;
        for (const vec3& wi : wis) second.emplace_back(wi, request.is_inside);
        return run<vec4>("evaluate_bsdf_test", first, second);
    }

    template <class Out>
    std::vector<Out> run(const std::string& kernel, const std::vector<vec4>& first, const std::vector<vec4>& second) {
        REQUIRE(first.size() % 16 == 0);
        return fixture().run_kernel<Out>(program(), kernel + suffix(), first.size(), materials_, coat_normals_, first,
                                         second);
    }
    std::vector<vec4> albedos(const std::vector<vec4>& rows) {
        REQUIRE(rows.size() % 16 == 0);
        return fixture().run_kernel<vec4>(program(), "albedo_test" + suffix(), rows.size(), rows);
    }

    static KernelFixture& fixture() {
        static KernelFixture one;
        return one;
    }

private:
    std::string suffix() const { return lanes_ > 1 ? std::to_string(lanes_) : ""; }
    std::string program() const { return "principled_bsdf_test.x" + std::to_string(lanes_); }

    std::vector<PrincipledMaterial> materials_;
    std::vector<vec4> coat_normals_;
    std::uint32_t lanes_;
};

/// Normals of facets with the density D(h) cos h (but x = 1 - sqrt(1 - u), where u is the share of flatter ones: steep
/// facets are seen so often that u's density has no bound), and what they reflect, refract, or let pass through a thin
/// wall. `eta`: 0 for reflection, 1 for a thin wall, else of what is behind against what wo is in.
Chart facets(const vec3& wo_float, double alpha_x, double alpha_y, double eta) {
    const dvec3 wo = glm::normalize(dvec3(wo_float));
    const bool is_refracted = eta != 0.0 && eta != 1.0;
    return {[=](const dvec3& wi) {
                if ((wi.z > 0.0) != (eta == 0.0)) return dvec2(-1);
                const dvec3 beyond = eta == 1.0 ? dvec3(wi.x, wi.y, -wi.z) : wi;
                dvec3 h = glm::normalize(is_refracted ? wo + eta * wi : wo + beyond);
                if (h.z < 0.0) h = -h;
                const double x = h.x / alpha_x / h.z, y = h.y / alpha_y / h.z, q = x * x + y * y;
                return dvec2(1 - 1 / std::sqrt(1 + q), 0.5 + std::atan2(y, x) / (2 * kPi));
            },
            [=](const dvec2& at) {
                const double rest = 1 - at.x, steeper = rest * rest, phi = 2 * kPi * (at.y - 0.5);
                const double slope = std::sqrt(1 / steeper - 1);
                const double x = alpha_x * slope * std::cos(phi), y = alpha_y * slope * std::sin(phi);
                const dvec3 h = glm::normalize(dvec3(x, y, 1));
                const double density =
                    steeper * steeper / (kPi * alpha_x * alpha_y * std::pow(h.z, 3.0)) / (2 * rest);  // D(h) cos h
                const double cos_wo = glm::dot(wo, h);
                if (!(cos_wo > 0.0)) return std::pair(dvec3(0), 0.0);
                if (!is_refracted) {
                    const dvec3 wi = 2 * cos_wo * h - wo;
                    return std::pair(dvec3(wi.x, wi.y, eta == 1.0 ? -wi.z : wi.z), 4 * cos_wo / density);
                }
                const double squared = 1 - (1 - cos_wo * cos_wo) / (eta * eta);
                if (!(squared > 0.0)) return std::pair(dvec3(0), 0.0);
                const double cos_wi = std::sqrt(squared);
                const dvec3 wi = (cos_wo / eta - cos_wi) * h - wo / eta;
                return std::pair(wi, std::pow(cos_wo - eta * cos_wi, 2.0) / (eta * eta * cos_wi) / density);
            }};
}

/// Returns the rotation that turns z to a direction.
glm::dmat3 turn_from_z(const dvec3& to) {
    const dvec3 x = glm::normalize(glm::cross(dvec3(0, 1, 0), to));
    return {x, glm::cross(to, x), to};
}

/// The chart of the facets of a coat with this normal.
Chart turned_facets(const vec3& wo, double alpha, const vec3& normal) {
    const glm::dmat3 turn = turn_from_z(glm::normalize(dvec3(normal)));
    const Chart chart = facets(vec3(glm::transpose(turn) * dvec3(wo)), alpha, alpha, 0.0);
    return {[=](const dvec3& wi) { return chart.to_square(glm::transpose(turn) * wi); },
            [=](const dvec2& at) {
                const auto [wi, angle] = chart.from_square(at);
                return std::pair(turn * wi, angle);
            }};
}

struct Lobe {
    std::string name;
    PrincipledMaterial material;
    /// The alphas of the facets; 0: the lobe is broad.
    double alpha_x = 0.0, alpha_y = 0.0;
    /// Of a lobe that also transmits, as in facets().
    double eta = 0.0;
    bool is_inside = false;
    vec3 coat_normal{0};    // (0,0,0): that of the base
    bool is_mixed = false;  // facets over what is diffuse
    bool is_dispersive = false;
};

/// Returns the lobes for a roughness, each alone.
std::vector<Lobe> lobes(float roughness) {
    const double alpha = double(roughness) * roughness;
    std::vector<Lobe> all;
    const auto add = [&](const char* name, auto&& change, double alpha_x, double alpha_y, double eta = 0.0,
                         bool is_inside = false) {
        Lobe lobe{name, plain_material(), alpha_x, alpha_y, eta, is_inside};
        lobe.material.roughness = roughness;
        change(lobe.material);
        all.push_back(lobe);
    };
    add(
        "eon", [&](auto& m) { m.specular = 0, m.diffuse_roughness = roughness; }, 0, 0);
    add(
        "diffuse transmission",
        [&](auto& m) { m.specular = 0, m.diffuse_transmission = 0.7f, m.diffuse_roughness = roughness; }, 0, 0, 1);
    // Where facets are smooth they have a chart of their own beside the hemisphere's.
    const double beside_diffuse = roughness < 0.3f ? alpha : 0.0;
    add(
        "dielectric", [&](auto&) {}, beside_diffuse, beside_diffuse);
    all.back().is_mixed = beside_diffuse > 0.0;
    add(
        "metal", [&](auto& m) { m.metallic = 1; }, alpha, alpha);
    add(
        "anisotropic metal", [&](auto& m) { m.metallic = 1, m.anisotropy = 0.5f; }, alpha + 0.25 * (1 - alpha), alpha);
    add(
        "conductor", [&](auto& m) { m.metallic = 1, m.refraction_index = 0.37f, m.absorption_index = 2.82f; }, alpha,
        alpha);
    add(
        "glass", [&](auto& m) { m.transmission = 1; }, alpha, alpha, 1.5);
    add(
        "glass from inside", [&](auto& m) { m.transmission = 1; }, alpha, alpha, 1 / 1.5, true);
    const auto stretched = [&](auto& m) { m.transmission = 1, m.anisotropy = 0.5f; };
    const double along = alpha + 0.25 * (1 - alpha);
    add("anisotropic glass", stretched, along, alpha, 1.5);
    add("anisotropic glass from inside", stretched, along, alpha, 1 / 1.5, true);
    add(
        "anisotropic thin glass", [&](auto& m) { stretched(m), m.flags = CASTOR_PRINCIPLED_THIN; }, along, alpha, 1);
    add(
        "thin glass", [&](auto& m) { m.transmission = 1, m.flags = CASTOR_PRINCIPLED_THIN; }, alpha, alpha, 1);
    add(
        "clearcoat on black",
        [&](auto& m) {
            m.clearcoat = 1, m.clearcoat_roughness = roughness, m.specular = 0;
            std::fill_n(m.base_color, 3, 0.0f);
        },
        alpha, alpha);
    add(
        "sheen on black",
        [&](auto& m) {
            m.specular = 0, m.sheen_roughness = roughness;
            std::fill_n(m.base_color, 3, 0.0f);
            std::fill_n(m.sheen_color, 3, 1.0f);
        },
        0, 0);
    const auto film = [](auto& m, float index, float thickness) {
        m.iridescence = 1, m.iridescence_index = index, m.iridescence_thickness_maximum = thickness;
    };
    add(
        "iridescent metal", [&](auto& m) { m.metallic = 1, m.base_color[1] = 0.7f, film(m, 1.33f, 400); }, alpha,
        alpha);
    add(
        "iridescent dielectric", [&](auto& m) { film(m, 1.8f, 350); }, beside_diffuse, beside_diffuse);
    all.back().is_mixed = beside_diffuse > 0.0;
    add(
        "iridescent glass", [&](auto& m) { m.transmission = 1, film(m, 1.8f, 350); }, alpha, alpha, 1.5);
    add(
        "iridescent glass from inside", [&](auto& m) { m.transmission = 1, film(m, 1.8f, 350); }, alpha, alpha, 1 / 1.5,
        true);
    add(
        "clearcoat with its own normal",
        [&](auto& m) {
            m.clearcoat = 1, m.clearcoat_roughness = roughness, m.specular = 0;
            std::fill_n(m.base_color, 3, 0.0f);
        },
        alpha, alpha);
    // Seen at 85 degrees it is still turned to the viewer.
    all.back().coat_normal = glm::normalize(vec3(0.5f, 0.2f, 1));
    for (const bool is_inside : {false, true}) {
        add(
            is_inside ? "dispersive glass from inside" : "dispersive glass",
            [&](auto& m) { m.transmission = 1, m.dispersion = 1; }, alpha, alpha, is_inside ? 1 / 1.5 : 1.5, is_inside);
        all.back().is_dispersive = true;
    }
    // A mixture of all of them, as far as bins are fine enough for its facets.
    if (roughness >= 0.3f)
        add(
            "everything",
            [&](auto& m) {
                m.metallic = 0.3f, m.transmission = 0.4f, m.clearcoat = 0.7f, m.clearcoat_roughness = 1.0f;
                m.sheen_roughness = 0.5f, m.diffuse_roughness = 0.8f, m.diffuse_transmission = 0.3f;
                m.dispersion = 1, film(m, 1.5f, 300), m.iridescence = 0.5f;
                std::fill_n(m.sheen_color, 3, 0.6f);
            },
            0, 0, 1.5);
    return all;
}

/// A chart, and how many times as many points its bins need in a row.
struct LobeChart {
    Chart chart;
    int closer = 1;
};

/// Returns the charts that the directions of a lobe lie on.
std::vector<LobeChart> charts_of(const Lobe& lobe, const vec3& wo) {
    if (lobe.coat_normal != vec3(0)) return {{turned_facets(wo, lobe.alpha_x, lobe.coat_normal)}};
    const auto of_facets = [&](double eta) { return facets(wo, lobe.alpha_x, lobe.alpha_y, eta); };
    const bool is_broad = lobe.alpha_x == 0.0;
    if (lobe.is_mixed) {
        // Facets of slopes up to 0.15, but for 1 in 2500.
        const Chart chart = up_to(of_facets(0.0), 1 - std::max(1 / std::hypot(1, 0.15 / lobe.alpha_x), 0.02));
        return {{chart, 3}, {without(hemisphere(1), {chart}), 2}};
    }
    std::vector<LobeChart> charts{is_broad ? LobeChart{hemisphere(1), 3} : LobeChart{of_facets(0.0)}};
    if (lobe.eta == 0.0) return charts;
    if (is_broad || (lobe.is_dispersive && lobe.alpha_x >= 0.3)) {
        // There are many directions to which green is not refracted, and which are on no chart of its facets.
        // Where they are seen at 85 degrees and rough, some lie close together.
        charts.push_back({hemisphere(-1), lobe.alpha_x == 1.0 && !lobe.is_inside && wo.z < 0.1f ? 8 : 3});
    } else if (lobe.is_dispersive && lobe.alpha_x < 0.005) {
        // The bins of one channel are too coarse for the others.
        std::vector<Chart> passed;
        for (const double index : {1.5, 1.4875, 1.5125}) {
            passed.push_back(without(up_to(of_facets(lobe.is_inside ? 1 / index : index), 0.8), passed));
            charts.push_back({passed.back()});
        }
    } else {
        charts.push_back({of_facets(lobe.eta)});
    }
    return charts;
}

/// Tests every lobe, roughness and incidence.
/// `points`: in a row and a column of a bin, for the integral of the density.
void check_densities(std::size_t count, int points, std::uint64_t seed) {
    struct Case {
        Lobe lobe;
        float roughness;
        double degrees;
    };
    std::vector<Case> cases;
    std::vector<PrincipledMaterial> materials;
    std::vector<vec3> coat_normals;
    std::vector<Request> requests;
    for (const float roughness : kRoughness)
        for (const Lobe& lobe : lobes(roughness))
            for (const double degrees : kDegrees) {
                cases.push_back({lobe, roughness, degrees});
                requests.push_back({direction(degrees), static_cast<std::uint32_t>(materials.size()), lobe.is_inside});
                materials.push_back(lobe.material);
                coat_normals.push_back(lobe.coat_normal);
            }
    Bsdfs bsdfs(materials, coat_normals);
    const double significance = 1 - std::pow(1 - 0.01, 1.0 / double(cases.size()));  // Sidak
    double least = 1.0;
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const Case& one = cases[k];
        const std::vector<Sample> samples = bsdfs.sample({requests[k]}, count, seed + k);
        Bins bins;
        const auto densities_of = [&](const std::vector<vec3>& wis) {
            std::vector<double> densities;
            for (const vec4& found : bsdfs.evaluate(requests[k], wis)) densities.push_back(found.w);
            return densities;
        };
        for (const auto& [chart, closer] : charts_of(one.lobe, requests[k].wo))
            add_chart(bins, chart, samples, densities_of, closer * points);
        const double p = chi_square(bins, count);
        least = std::min(least, p);
        CAPTURE(one.lobe.name, one.roughness, one.degrees, p, significance);
        CHECK(p >= significance);
    }
    WARN("chi-square of " << cases.size() << " cases with " << count << " directions each: least p " << least
                          << ", allowed " << significance);
}

/// Returns well spread points of the unit cube (Halton).
vec3 halton(std::size_t i) {
    const auto inverse = [&](std::size_t base) {
        double value = 0.0, part = 1.0;
        for (std::size_t n = i + 1; n > 0; n /= base) value += double(n % base) * (part /= double(base));
        return std::min(static_cast<float>(value), 0x1.fffffep-1f);
    };
    return {inverse(2), inverse(3), inverse(5)};
}

/// Returns the mean weights, of the largest channel, of `count` directions for each request: the directional albedos.
std::vector<double> albedos_of(Bsdfs& bsdfs, const std::vector<Request>& requests, std::size_t count) {
    std::vector<vec4> first, second;
    for (const Request& request : requests)
        for (std::size_t i = 0; i < count; ++i) {
            const vec3 at = halton(i);
            first.emplace_back(request.wo, at.x);
            second.emplace_back(at.y, at.z, request.material, request.is_inside);
        }
    const std::vector<Sample> samples = bsdfs.run<Sample>("sample_bsdf_test", first, second);
    std::vector<double> means;
    for (std::size_t k = 0; k < requests.size(); ++k) {
        dvec3 sum(0.0);
        for (std::size_t i = 0; i < count; ++i) sum += dvec3(samples[k * count + i].weight_delta);
        means.push_back(std::max({sum.x, sum.y, sum.z}) / double(count));
    }
    return means;
}

/// Every lobe, roughness and incidence, and smooth surfaces too.
struct AllLobes {
    std::vector<Lobe> lobes_of;
    std::vector<PrincipledMaterial> materials;
    std::vector<vec3> coat_normals;
    std::vector<Request> requests;
    std::vector<double> degrees;

    AllLobes() {
        for (const float roughness : {0.0f, 0.03f, 0.1f, 0.3f, 0.6f, 1.0f})
            for (const Lobe& lobe : lobes(roughness)) {
                for (const double angle : kDegrees) {
                    lobes_of.push_back(lobe);
                    requests.push_back(
                        {direction(angle), static_cast<std::uint32_t>(materials.size()), lobe.is_inside});
                    degrees.push_back(angle);
                }
                materials.push_back(lobe.material);
                coat_normals.push_back(lobe.coat_normal);
            }
    }
};

dvec3 half_vector(const dvec3& wo, const dvec3& wi, double eta) {
    const dvec3 h = glm::normalize(wo + eta * wi);
    return h.z < 0.0 ? -h : h;
}

double density_of_normals(const dvec3& h, double alpha) {
    const double cos2 = h.z * h.z, tan2 = (h.x * h.x + h.y * h.y) / cos2;
    const double spread = alpha * (1 + tan2 / (alpha * alpha));
    return 1 / (kPi * cos2 * cos2 * spread * spread);
}

double lambda(const dvec3& w, double alpha) {
    return (std::sqrt(1 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)) - 1) / 2;
}

double schlick(double f0, double cosine) {
    return f0 + (1 - f0) * std::pow(1 - cosine, 5.0);
}

}  // namespace

TEST_CASE("directions are drawn with the density that evaluate_bsdf states", "[kernels][bsdf]") {
    check_densities(20'000, 10, 1000);
}

TEST_CASE("a million directions are drawn with the density that evaluate_bsdf states", "[.bsdf_full]") {
    check_densities(1'000'000, 20, 5000);
}

TEST_CASE("what a drawn direction weighs agrees with value and density", "[kernels][bsdf]") {
    const AllLobes all;
    Bsdfs bsdfs(all.materials, all.coat_normals);
    const std::vector<Sample> samples = bsdfs.sample(all.requests, 320, 7);
    std::size_t drawn = 0, deltas = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Sample& sample = samples[i];
        const Lobe& lobe = all.lobes_of[i / 320];
        CAPTURE(lobe.name, lobe.material.roughness, all.degrees[i / 320], i, sample.wi().z, sample.pdf());
        REQUIRE(std::isfinite(sample.wi_pdf.w));
        if (!(sample.pdf() > 0.0)) {
            REQUIRE(vec3(sample.weight_delta) == vec3(0));
            continue;
        }
        REQUIRE(std::fabs(glm::length(sample.wi()) - 1.0) <= 16 * kEpsilon);
        deltas += sample.is_delta();
        if (sample.is_delta()) continue;
        ++drawn;
        REQUIRE(sample.found.w == sample.wi_pdf.w);
        for (int k = 0; k < 3; ++k) {
            const double expected = double(sample.found[k]) * std::fabs(sample.wi().z) / sample.pdf();
            REQUIRE(std::fabs(sample.weight_delta[k] - expected) <= 4 * kEpsilon * expected + 1e-37);
        }
    }
    CHECK(drawn > samples.size() / 2);
    CHECK(deltas > samples.size() / 20);
}

TEST_CASE("no lobe reflects and transmits more than it receives", "[kernels][bsdf]") {
    const AllLobes all;
    Bsdfs bsdfs(all.materials, all.coat_normals);
    const std::vector<double> found = albedos_of(bsdfs, all.requests, 2048);
    double largest = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        CAPTURE(all.lobes_of[i].name, all.lobes_of[i].material.roughness, all.degrees[i], found[i]);
        CHECK(found[i] <= 1.01);
        CHECK(found[i] >= 0.0);
        largest = std::max(largest, found[i]);
    }
    CHECK(largest > 0.99);
}

TEST_CASE("a white surface in a white furnace cannot be seen", "[kernels][bsdf]") {
    enum class Body { opaque, wall, solid, from_inside };
    std::vector<PrincipledMaterial> materials;
    std::vector<Request> requests;
    for (const float metallic : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f})
        for (const float roughness : {0.0f, 0.03f, 0.1f, 0.2f, 0.3f, 0.45f, 0.6f, 0.8f, 1.0f})
            for (const Body body : {Body::opaque, Body::wall, Body::solid, Body::from_inside}) {
                for (const double degrees : kDegrees)
                    requests.push_back(
                        {direction(degrees), static_cast<std::uint32_t>(materials.size()), body == Body::from_inside});
                materials.push_back(plain_material());
                materials.back().metallic = metallic;
                materials.back().roughness = roughness;
                materials.back().transmission = body == Body::opaque ? 0.0f : 1.0f;
                materials.back().flags = body == Body::wall ? CASTOR_PRINCIPLED_THIN : 0;
            }
    Bsdfs bsdfs(materials);
    const std::vector<double> found = albedos_of(bsdfs, requests, 4096);
    double largest = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const PrincipledMaterial& material = materials[requests[i].material];
        CAPTURE(material.metallic, material.roughness, material.transmission, material.flags, requests[i].is_inside,
                requests[i].wo.z, found[i]);
        const bool is_solid = material.transmission > 0.0f && material.flags == 0;  // its table is coarser
        CHECK(std::fabs(found[i] - 1.0) <= (is_solid ? 0.012 : 0.005));
        largest = std::max(largest, std::fabs(found[i] - 1.0));
    }
    CAPTURE(largest);
    CHECK(largest > 0.0);
}

TEST_CASE("white metal with scratches cannot be seen in a white furnace", "[kernels][bsdf]") {
    std::vector<PrincipledMaterial> materials;
    std::vector<Request> requests;
    for (const float anisotropy : {0.2f, 0.5f, 1.0f})
        for (const float roughness : {0.1f, 0.3f, 0.6f, 1.0f}) {
            for (const double degrees : kDegrees)
                for (const double azimuth : {0.0, 0.4, 1.0, kPi / 2})
                    requests.push_back(
                        {direction(degrees, azimuth), static_cast<std::uint32_t>(materials.size()), false});
            materials.push_back(plain_material());
            materials.back().metallic = 1.0f;
            materials.back().roughness = roughness;
            materials.back().anisotropy = anisotropy;
        }
    Bsdfs bsdfs(materials);
    const std::vector<double> found = albedos_of(bsdfs, requests, 4096);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const PrincipledMaterial& material = materials[requests[i].material];
        const vec3& wo = requests[i].wo;
        CAPTURE(material.anisotropy, material.roughness, wo.x, wo.y, wo.z, found[i]);
        CHECK(std::fabs(found[i] - 1.0) <= 0.025);
    }
}

TEST_CASE("white glass with scratches, or a specular colour, cannot be seen in a white furnace", "[kernels][bsdf]") {
    std::vector<PrincipledMaterial> materials;
    std::vector<Request> requests;
    struct Specular {
        float factor, color;
    };
    for (const float index : {1.1f, 1.5f, 2.4f})
        for (const auto& [anisotropy, specular] :
             {std::pair(0.2f, Specular{1, 1}), std::pair(0.6f, Specular{1, 1}), std::pair(1.0f, Specular{1, 1}),
              std::pair(0.0f, Specular{1, 5}), std::pair(0.0f, Specular{1, 25}), std::pair(0.0f, Specular{0, 1}),
              std::pair(0.0f, Specular{0.5f, 1}), std::pair(0.6f, Specular{0.5f, 3})})
            for (const float roughness : {0.1f, 0.4f, 1.0f}) {
                for (const bool is_inside : {false, true})
                    for (const double degrees : {0.0, 30.0, 60.0, 85.0})
                        for (const double azimuth : {0.0, 0.7, kPi / 2})
                            requests.push_back(
                                {direction(degrees, azimuth), static_cast<std::uint32_t>(materials.size()), is_inside});
                materials.push_back(plain_material());
                materials.back().transmission = 1.0f;
                materials.back().refraction_index = index;
                materials.back().roughness = roughness;
                materials.back().anisotropy = anisotropy;
                materials.back().specular = specular.factor;
                std::fill_n(materials.back().specular_color, 3, specular.color);
            }
    Bsdfs bsdfs(materials);
    const std::vector<double> found = albedos_of(bsdfs, requests, 1024);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const PrincipledMaterial& material = materials[requests[i].material];
        const vec3& wo = requests[i].wo;
        CAPTURE(material.refraction_index, material.anisotropy, material.specular, material.specular_color[0],
                material.roughness, requests[i].is_inside, wo.x, wo.y, wo.z, found[i]);
        CHECK(std::fabs(found[i] - 1.0) <= 0.02);
    }
}

TEST_CASE("the specular colour of glass scales what it reflects head-on, and not at grazing angles",
          "[kernels][bsdf]") {
    std::vector<PrincipledMaterial> materials;
    std::vector<Request> requests;
    for (const float specular : {1.0f, 0.5f, 0.0f})
        for (const float color : {1.0f, 3.0f, 0.0f, 100.0f})
            for (const bool is_thin : {false, true}) {
                for (const double degrees : {0.0, 60.0, 85.0}) {
                    requests.push_back({direction(degrees, 0.3), static_cast<std::uint32_t>(materials.size())});
                    if (!is_thin && degrees < 40.0) {
                        requests.push_back(requests.back());
                        requests.back().is_inside = true;
                    }
                }
                materials.push_back(plain_material());
                materials.back().roughness = 0.0f;
                materials.back().transmission = 1.0f;
                materials.back().specular = specular;
                std::fill_n(materials.back().specular_color, 3, color);
                materials.back().flags = is_thin ? CASTOR_PRINCIPLED_THIN : 0;
            }
    Bsdfs bsdfs(materials);
    constexpr std::size_t kSamples = 4096;
    const std::vector<Sample> samples = bsdfs.sample(requests, kSamples, 5);
    for (std::size_t i = 0; i < requests.size(); ++i) {
        const PrincipledMaterial& material = materials[requests[i].material];
        double reflected = 0.0;
        for (std::size_t k = 0; k < kSamples; ++k) {
            const Sample& sample = samples[i * kSamples + k];
            if (sample.wi().z > 0.0) reflected += double{sample.weight_delta.x} / kSamples;
        }
        const double eta = requests[i].is_inside ? 1 / 1.5 : 1.5, cosine = double{requests[i].wo.z};
        const double there = std::sqrt(1 - (1 - cosine * cosine) / (eta * eta));
        const double s = (cosine - eta * there) / (cosine + eta * there),
                     p = (eta * cosine - there) / (eta * cosine + there), fresnel = (s * s + p * p) / 2;
        const double head_on = 0.04, grazing = (fresnel - head_on) / (1 - head_on);
        const double specular = double{material.specular}, color = double{material.specular_color[0]};
        const double once = specular * ((1 - grazing) * std::min(head_on * color, 1.0) + grazing);
        const double expected = material.flags ? 2 * once / (1 + once) : once;
        CAPTURE(specular, color, material.flags, requests[i].is_inside, cosine, reflected, expected);
        CHECK(std::fabs(reflected - expected) <= 5 * std::sqrt(expected * (1 - expected) / kSamples) + 1e-4);
    }
}

TEST_CASE("lobes are reciprocal", "[kernels][bsdf]") {
    for (const float roughness : {0.1f, 0.3f, 1.0f})
        for (const Lobe& lobe : lobes(roughness)) {
            RandomSource random(12);
            if (lobe.name == "everything" || lobe.name.ends_with("thin glass") || lobe.name.ends_with("dielectric"))
                continue;
            if (lobe.name.starts_with("anisotropic glass")) continue;  // scaled by what wo sees
            if (lobe.coat_normal != vec3(0)) continue;                 // the cosine is not that of z
            const bool is_glass = lobe.material.transmission > 0.0f;
            const bool is_scaled = lobe.material.metallic > 0.0f;
            Bsdfs bsdfs({lobe.material});
            std::vector<vec4> there_wo, there_wi, back_wo, back_wi, places_wo, places_wi;
            const double index = 1.5 - 0.0125 * double(lobe.material.dispersion);  // of red
            const double eta = lobe.is_inside ? 1 / index : index;
            const double scaling_eta = lobe.is_inside ? 1 / 1.5 : 1.5;  // that of green
            for (int i = 0; i < 512; ++i) {
                vec3 wo = random.direction(), wi = random.direction();
                wo.z = std::fabs(wo.z);
                const bool is_through = (is_glass || lobe.material.diffuse_transmission > 0.0f) && i % 2;
                wi.z = is_through ? -std::fabs(wi.z) : std::fabs(wi.z);
                there_wo.emplace_back(wo, 0);
                there_wi.emplace_back(wi, lobe.is_inside);
                // The frame's z is on the side of wo.
                const vec3 flip = is_through ? vec3(1, 1, -1) : vec3(1);
                back_wo.emplace_back(wi * flip, 0);
                back_wi.emplace_back(wo * flip, lobe.is_inside != is_through);
            }
            const auto place_of = [&](const vec4& w, double index_there) {
                const double on_surface = std::hypot(w.x, w.y), strength = lobe.material.anisotropy;
                return vec4(std::fabs(w.z), roughness, strength > 0.0 ? std::fabs(w.x) / on_surface : index_there,
                            strength);
            };
            for (int i = 0; i < 512; ++i) {
                places_wo.push_back(place_of(there_wo[i], scaling_eta));
                places_wi.push_back(place_of(there_wi[i], there_wi[i].z < 0.0f ? 1 / scaling_eta : scaling_eta));
            }
            const std::vector<vec4> there = bsdfs.run<vec4>("evaluate_bsdf_test", there_wo, there_wi),
                                    back = bsdfs.run<vec4>("evaluate_bsdf_test", back_wo, back_wi),
                                    e_wo = bsdfs.albedos(places_wo), e_wi = bsdfs.albedos(places_wi);
            std::size_t compared = 0;
            for (std::size_t i = 0; i < there.size(); ++i) {
                const double radiance = is_glass && there_wi[i].z < 0.0f ? eta * eta : 1.0;
                double of_there = there[i].x / radiance, of_back = back[i].x;
                if (is_scaled) {  // by the energy scale along wo
                    const double f0 = lobe.material.absorption_index > 0.0f
                                          ? (0.63 * 0.63 + 2.82 * 2.82) / (1.37 * 1.37 + 2.82 * 2.82)
                                          : 1.0;
                    of_there /= 1 + f0 * (1 / double(e_wo[i].x) - 1);
                    of_back /= 1 + f0 * (1 / double(e_wi[i].x) - 1);
                }
                if (is_glass && lobe.material.iridescence == 0.0f) of_there *= e_wo[i].w, of_back *= e_wi[i].w;
                // 64 ulp; where light is refracted, half vectors of both ways are rounded differently, and so are
                // Fresnel's terms, whose slopes are steep where little is left.
                const double tolerance = is_glass ? 1e-3 * std::max(of_there, of_back) + 1e-5
                                                  : 128 * kEpsilon * std::max(of_there, of_back) + 1e-30;
                CAPTURE(lobe.name, roughness, i, there_wo[i].z, there_wi[i].z, of_there, of_back);
                REQUIRE(std::fabs(of_there - of_back) <= tolerance);
                compared += of_there > 0.0;
            }
            CHECK(compared > there.size() / 3);
        }
}

TEST_CASE("values agree with the papers' formulas in double precision", "[kernels][bsdf]") {
    RandomSource random(13);
    for (const float roughness : {0.1f, 0.3f, 0.6f, 1.0f}) {
        const double alpha = double(roughness) * roughness, n = 1.5;
        std::vector<PrincipledMaterial> materials(3, plain_material());
        for (PrincipledMaterial& material : materials) material.roughness = roughness;
        materials[0].metallic = 1;
        std::fill_n(materials[0].base_color, 3, 0.5f);
        materials[1].transmission = 1;
        materials[2].specular = 0;  // Lambert
        std::fill_n(materials[2].base_color, 3, 0.5f);
        Bsdfs bsdfs(materials);
        std::vector<vec4> wos, wis, places;
        for (int i = 0; i < 3 * 512; ++i) {
            vec3 wo = random.direction(), wi = random.direction();
            wo.z = std::max(std::fabs(wo.z), 0.02f);
            if (i % 3 != 1) wi.z = std::max(std::fabs(wi.z), 0.02f);
            wo = glm::normalize(wo), wi = glm::normalize(wi);
            wos.emplace_back(wo, i % 3);
            wis.emplace_back(wi, 0);
            places.emplace_back(wo.z, roughness, n, 0);
        }
        const std::vector<vec4> found = bsdfs.run<vec4>("evaluate_bsdf_test", wos, wis), e = bsdfs.albedos(places);
        for (std::size_t i = 0; i < found.size(); ++i) {
            const dvec3 wo(wos[i]), wi(wis[i]);
            const double cosines = wo.z * std::fabs(wi.z);
            const double shadowed = 1 / (1 + lambda(wo, alpha) + lambda(wi, alpha));
            double expected = 0.0;
            if (i % 3 == 0) {
                const dvec3 h = half_vector(wo, wi, 1);
                expected = density_of_normals(h, alpha) * shadowed * schlick(0.5, glm::dot(wo, h)) / (4 * cosines) *
                           (1 + 0.5 * (1 / double(e[i].x) - 1));
            } else if (i % 3 == 1) {
                const dvec3 h = half_vector(wo, wi, wi.z > 0 ? 1 : n);
                const double o = glm::dot(wo, h), in = glm::dot(wi, h);
                const double there = std::sqrt(1 - (1 - o * o) / (n * n));
                const double s = (o - n * there) / (o + n * there), p = (n * o - there) / (n * o + there);
                const double reflected = (s * s + p * p) / 2;
                if (wi.z > 0)
                    expected = density_of_normals(h, alpha) * shadowed * reflected / (4 * cosines);
                else if (o > 0 && in < 0)
                    expected = density_of_normals(h, alpha) * shadowed * (1 - reflected) * o * -in * n * n / cosines /
                               std::pow(o + n * in, 2.0);
                expected /= double(e[i].w);
            } else {
                expected = 0.5 / kPi;
            }
            CAPTURE(roughness, i % 3, wo.z, wi.z, found[i].x, expected);
            // Rounding of the half vector, against the width of the lobe.
            REQUIRE(std::fabs(found[i].x - expected) <= (64 + 64 / alpha) * kEpsilon * expected + 1e-5);
        }
    }
}

namespace {

/// What a thin film on a surface reflects in a channel (Belcour, Barla 2017, as KHR_materials_iridescence states it).
/// `f0`: of the surface alone, head-on.
double iridescence(double index, double thickness, double f0, double cosine, int channel) {
    const auto square = [](double x) { return x * x; };
    const double inside = std::sqrt(1 - (1 - cosine * cosine) / (index * index));
    const double r12 = schlick(square((index - 1) / (index + 1)), cosine), t121 = 1 - r12;
    const double base = (1 + std::sqrt(f0)) / (1 - std::sqrt(f0));
    const double r23 = schlick(square((base - index) / (base + index)), inside);
    const double shift = kPi + (base < index ? kPi : 0.0);
    const double r123 = std::clamp(r12 * r23, 1e-5, 0.9999), rs = square(t121) * r23 / (1 - r123);
    const auto sensitivity = [&](int m) {
        constexpr double kValue[] = {5.4856e-13, 4.4201e-13, 5.2481e-13, 9.7470e-14};
        constexpr double kPlace[] = {1.6810e6, 1.7953e6, 2.2084e6, 2.2399e6};
        constexpr double kVariance[] = {4.3278e9, 9.3046e9, 6.6121e9, 4.5282e9};
        constexpr double kRgb[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                       {-0.9692660, 1.8760108, 0.0415560},
                                       {0.0556434, -0.2040259, 1.0572252}};
        const double phase = 2 * kPi * m * 2 * index * thickness * inside * 1e-9;
        double sum = 0.0;
        for (int i = 0; i < 4; ++i)
            sum += kRgb[channel][i % 3] * kValue[i] * std::sqrt(2 * kPi * kVariance[i]) *
                   std::cos(kPlace[i] * phase + m * shift) * std::exp(-square(phase) * kVariance[i]) / 1.0685e-7;
        return sum;
    };
    const double waves = std::sqrt(r123) * 2 * sensitivity(1) + r123 * 2 * sensitivity(2);
    return std::clamp(r12 + rs + (rs - t121) * waves, 0.0, 1.0);
}

}  // namespace

TEST_CASE("thin films reflect what the paper's formula says, in double precision", "[kernels][bsdf]") {
    RandomSource random(17);
    constexpr float kRough = 0.5f;
    constexpr double kAlpha = 0.25;
    std::vector<PrincipledMaterial> materials;
    std::vector<vec4> wos, wis, places;
    for (int i = 0; i < 1024; ++i) {
        PrincipledMaterial material = plain_material();
        const bool is_metal = i % 2;
        material.metallic = is_metal ? 1.0f : 0.0f;
        material.roughness = kRough;
        for (float& channel : material.base_color) channel = is_metal ? random.uniform_float(0, 1) : 0.0f;
        material.refraction_index = random.uniform_float(1.1f, 2.5f);
        material.iridescence = i % 3 ? 1.0f : 0.25f;
        material.iridescence_index = random.uniform_float(1, 2.5f);
        material.iridescence_thickness_maximum = random.uniform_float(1, 1200);
        materials.push_back(material);
        vec3 wo = random.direction(), wi = random.direction();
        wo.z = std::fabs(wo.z) + 0.02f, wi.z = std::fabs(wi.z) + 0.02f;
        wos.emplace_back(glm::normalize(wo), i);
        wis.emplace_back(glm::normalize(wi), 0);
        places.emplace_back(wos.back().z, kRough, 0, 0);
    }
    Bsdfs bsdfs(materials);
    const std::vector<vec4> found = bsdfs.run<vec4>("evaluate_bsdf_test", wos, wis), e = bsdfs.albedos(places);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const PrincipledMaterial& m = materials[i];
        const dvec3 wo(wos[i]), wi(wis[i]), h = half_vector(wo, wi, 1);
        const double shadowed = 1 / (1 + lambda(wo, kAlpha) + lambda(wi, kAlpha));
        const double facets_alone = density_of_normals(h, kAlpha) * shadowed / (4 * wo.z * wi.z);
        for (int k = 0; k < 3; ++k) {
            const double n = m.refraction_index, ratio = (n - 1) / (n + 1);
            const double f0 = m.metallic > 0 ? double(m.base_color[k]) : ratio * ratio, cosine = glm::dot(wo, h);
            const double film =
                iridescence(m.iridescence_index, m.iridescence_thickness_maximum, std::min(f0, 0.9999), cosine, k);
            const double plain = schlick(f0, cosine);
            const double expected =
                facets_alone * (plain + m.iridescence * (film - plain)) * (1 + f0 * (1 / double(e[i].x) - 1));
            CAPTURE(i, k, f0, cosine, m.iridescence_index, m.iridescence_thickness_maximum, found[i][k], expected);
            // The phase has a rounding error of some 100 radians.
            REQUIRE(std::fabs(found[i][k] - expected) <= 1e-4 * expected + 5e-5 * facets_alone);
        }
    }
}

TEST_CASE("no thin film makes light", "[kernels][bsdf]") {
    RandomSource random(19);
    std::vector<PrincipledMaterial> materials;
    std::vector<Request> requests;
    for (std::uint32_t i = 0; i < 96; ++i) {
        PrincipledMaterial material = plain_material();
        material.roughness = random.uniform_float(0, 1);
        material.metallic = i % 3 == 0 ? 0.5f : 0.0f;
        material.transmission = i % 3 == 1 ? 1.0f : 0.0f;
        material.refraction_index = random.uniform_float(1.1f, 2.5f);
        material.iridescence = 1;
        material.iridescence_index = random.uniform_float(1, 2.5f);
        material.iridescence_thickness_maximum = random.uniform_float(1, 1000);
        materials.push_back(material);
        for (const double degrees : kDegrees) requests.push_back({direction(degrees), i, i % 6 == 4});
    }
    Bsdfs bsdfs(materials);
    const std::vector<double> found = albedos_of(bsdfs, requests, 1024);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const PrincipledMaterial& m = materials[requests[i].material];
        CAPTURE(m.roughness, m.metallic, m.transmission, m.refraction_index, m.iridescence_index,
                m.iridescence_thickness_maximum, requests[i].wo.z, found[i]);
        CHECK(found[i] <= 1.01);
    }
}

TEST_CASE("a coat with a normal of its own is the same coat, turned", "[kernels][bsdf]") {
    RandomSource random(18);
    PrincipledMaterial material = plain_material();
    material.clearcoat = 1;
    material.specular = 0;
    material.clearcoat_roughness = 0.4f;
    constexpr double kAlpha = 0.16;
    std::fill_n(material.base_color, 3, 0.0f);
    std::vector<PrincipledMaterial> materials(512, material);
    std::vector<vec3> normals;
    std::vector<vec4> wos, wis, turned_wos, turned_wis;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        vec3 normal = random.direction(), wo = random.direction();
        normal.z = std::fabs(normal.z), wo.z = std::fabs(wo.z);
        const vec3 wi = random.direction();  // also below the base
        const glm::dmat3 back = glm::transpose(turn_from_z(glm::normalize(dvec3(normal))));
        normals.push_back(normal);
        wos.emplace_back(wo, i);
        wis.emplace_back(wi, 0);
        turned_wos.emplace_back(vec3(back * dvec3(wo)), 0);
        turned_wis.emplace_back(vec3(back * dvec3(wi)), 0);
    }
    const std::vector<vec4> found = Bsdfs(materials, normals).run<vec4>("evaluate_bsdf_test", wos, wis),
                            expected = Bsdfs({material}).run<vec4>("evaluate_bsdf_test", turned_wos, turned_wis);
    std::size_t lit = 0, below = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double cosine = double(turned_wis[i].z), arriving = double(found[i].x) * std::fabs(wis[i].z);
        const double tolerance = (64 + 64 / kAlpha) * kEpsilon;
        CAPTURE(i, wos[i].z, wis[i].z, turned_wos[i].z, cosine, found[i].x, expected[i].x);
        if (std::min(turned_wos[i].z, std::fabs(turned_wis[i].z)) < 0.01f || wos[i].z < 0.01f) continue;
        REQUIRE(std::fabs(arriving - expected[i].x * cosine) <= tolerance * arriving + 1e-7);
        REQUIRE(std::fabs(found[i].w - expected[i].w) <= tolerance * found[i].w + 1e-7);
        lit += arriving > 0.0;
        below += arriving > 0.0 && wis[i].z < 0.0f;
    }
    CHECK(lit > 50);
    CHECK(below > 5);
}

TEST_CASE("smooth glass refracts each channel with its own index", "[kernels][bsdf]") {
    PrincipledMaterial material = plain_material();
    material.roughness = 0;
    material.transmission = 1;
    material.dispersion = 2;  // (n - 1) / 10 between blue and red
    Bsdfs bsdfs({material});
    const double sine = std::sin(kPi / 3);
    const std::vector<Sample> samples = bsdfs.sample({{direction(60, 0.0), 0}}, 4096, 4);
    std::array<int, 3> refracted{};
    for (const Sample& sample : samples) {
        const vec3 weight(sample.weight_delta);
        CAPTURE(weight.x, weight.y, weight.z);
        REQUIRE(sample.is_delta());
        if (sample.wi().z > 0.0) {
            REQUIRE((weight.x < weight.y && weight.y < weight.z));  // blue, of the largest index, is reflected most
            continue;
        }
        const int channel = weight.x > 0.0f ? 0 : weight.y > 0.0f ? 1 : 2;
        ++refracted[std::size_t(channel)];
        for (int k = 0; k < 3; ++k) REQUIRE(std::fabs(weight[k] - (k == channel ? 3.0 : 0.0)) <= 1e-5);
        const double n = 1.5 + 0.025 * (channel - 1);
        REQUIRE(glm::length(sample.wi() - dvec3(-sine / n, 0, -std::sqrt(1 - sine * sine / (n * n)))) <= 16 * kEpsilon);
    }
    for (const int count : refracted) CHECK(std::abs(count - 4096 * 0.91 / 3) <= 5 * std::sqrt(4096 * 0.91 / 3));
}

TEST_CASE("smooth surfaces are mirrors, panes and refracting bodies", "[kernels][bsdf]") {
    std::vector<PrincipledMaterial> materials(4, plain_material());
    for (PrincipledMaterial& material : materials) material.roughness = 0.0f;
    materials[0].metallic = 1;
    materials[1].transmission = 1;
    materials[2].transmission = 1;
    materials[2].flags = CASTOR_PRINCIPLED_THIN;
    materials[3].transmission = 1;  // of the same index as what is around it: nothing is seen of it, however rough
    materials[3].refraction_index = 1;
    materials[3].roughness = 0.5f;
    Bsdfs bsdfs(materials);
    const double sine = std::sin(kPi / 6), cosine = std::cos(kPi / 6);
    std::vector<Request> requests;
    for (std::uint32_t material = 0; material < 4; ++material) requests.push_back({direction(30, 0.0), material});
    requests.push_back({direction(60, 0.0), 1, true});  // beyond the critical angle
    const std::vector<Sample> samples = bsdfs.sample(requests, 4096, 3);
    std::array<double, 5> reflected{};
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const std::size_t request = i / 4096;
        const Sample& sample = samples[i];
        const dvec3 wi = sample.wi();
        CAPTURE(request, i, wi.x, wi.y, wi.z);
        REQUIRE(sample.is_delta());
        REQUIRE(sample.pdf() > 0.0);
        reflected[request] += wi.z > 0.0;
        REQUIRE(std::fabs(sample.weight_delta.x - 1.0) <= 1e-5);
        const dvec3 wo(requests[request].wo), mirrored(-wo.x, -wo.y, wo.z);
        const dvec3 bent(-sine / 1.5, 0, -std::sqrt(1 - sine * sine / 2.25));
        const dvec3 expected = wi.z > 0.0 ? mirrored : request == 1 ? bent : -wo;
        REQUIRE(glm::length(wi - expected) <= 16 * kEpsilon);
    }
    CHECK(reflected[0] == 4096);
    CHECK(reflected[3] == 0);
    CHECK(reflected[4] == 4096);
    // Fresnel's reflectance, and what a pane reflects with all that goes to and fro in it: 2F / (1 + F).
    const double there = std::sqrt(1 - sine * sine / 2.25);
    const double s = (cosine - 1.5 * there) / (cosine + 1.5 * there),
                 p = (1.5 * cosine - there) / (1.5 * cosine + there);
    const double f = (s * s + p * p) / 2;
    for (const auto& [found, expected] : {std::pair(reflected[1], f), std::pair(reflected[2], 2 * f / (1 + f))})
        CHECK(std::fabs(found / 4096 - expected) <= 5 * std::sqrt(expected / 4096));
}

TEST_CASE("materials scatter the same with one lane and with sixteen", "[kernels][bsdf]") {
    if (Bsdfs::fixture().device().platform_name == "rusticl") return;  // it compiles for minutes what has vectors
    const AllLobes all;
    Bsdfs one(all.materials, all.coat_normals, 1), sixteen(all.materials, all.coat_normals, 16);
    const std::vector<Sample> found = one.sample(all.requests, 64, 21), in_lanes = sixteen.sample(all.requests, 64, 21);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Lobe& lobe = all.lobes_of[i / 64];
        CAPTURE(lobe.name, lobe.material.roughness, all.degrees[i / 64], i % 64, found[i].wi_pdf.w,
                in_lanes[i].wi_pdf.w);
        REQUIRE(std::memcmp(&found[i], &in_lanes[i], sizeof(Sample)) == 0);
    }
}

TEST_CASE("degenerate materials and directions give neither NaN nor infinity", "[kernels][bsdf]") {
    std::vector<PrincipledMaterial> materials;
    std::vector<vec3> coat_normals;
    RandomSource random(31);
    constexpr float kShares[] = {0.0f, 1e-6f, 0.5f, 1.0f}, kSmall[] = {0.0f, 1e-20f, 1e-3f, 0.01f, 0.011f, 1.0f};
    constexpr float kIndices[] = {0.0f, 1e-10f, 0.5f, 1.0f, 1.000001f, 1.01f, 1.5f, 1e10f};
    for (int i = 0; i < 256; ++i) {
        PrincipledMaterial material{};
        const auto share = [&] { return kShares[random.below(4)]; };
        const auto small = [&] { return kSmall[random.below(6)]; };
        for (int k = 0; k < 3; ++k) {
            material.base_color[k] = share();
            material.specular_color[k] = share();
            material.sheen_color[k] = share();
            material.diffuse_transmission_color[k] = share();
        }
        material.metallic = share(), material.specular = share(), material.sheen_roughness = small();
        material.diffuse_transmission = share(), material.roughness = small(), material.anisotropy = share();
        material.diffuse_roughness = small(), material.transmission = share();
        material.refraction_index = kIndices[random.below(8)], material.absorption_index = share();
        material.clearcoat = share(), material.clearcoat_roughness = small();
        material.flags = random.below(2);
        material.dispersion = i % 3 ? 0.0f : kIndices[random.below(8)];
        material.iridescence = i % 2 ? 0.0f : share();
        material.iridescence_index = 1.0f + kIndices[random.below(8)];
        material.iridescence_thickness_maximum = 400.0f * kIndices[random.below(8)];
        const vec3 normals[] = {{0, 0, 1}, {0, 0, 0}, {0.6f, 0, 0.8f}, {-1, 0, 0}};
        coat_normals.push_back(normals[random.below(4)]);
        materials.push_back(material);
    }
    const vec3 wos[] = {{0, 0, 1},      {1, 0, 0},        {0, 0, -1},      {1, 0, 1e-7f}, {0, 1, 1.1e-6f},
                        {1, 0, 1e-40f}, {0.6f, 0, -0.8f}, {0.6f, 0, 0.8f}, {0, 0, 0},     {1, 1e-3f, 1e-3f}};
    const float units[] = {0.0f, 0x1p-24f, 0.25f, 0.5f, 0x1.fffffep-1f};
    std::vector<vec4> first, second, wo_material, wi_inside;
    for (int i = 0; i < 16 * 2000; ++i) {
        const vec3 wo = wos[random.below(10)];
        const auto material = static_cast<float>(random.below(256));
        const auto unit = [&] { return units[random.below(5)]; };
        const auto inside = static_cast<float>(random.below(2));
        first.emplace_back(wo, i % 2 ? unit() : random.uniform_float(0, 0.9999f));
        const float x = unit();
        second.emplace_back(x, unit(), material, inside);
        wo_material.emplace_back(wo, material);
        // Mirrored, back, straight through, any.
        const vec3 wi = i % 4 == 0 ? vec3(-wo.x, -wo.y, wo.z) : i % 4 == 1 ? wo : i % 4 == 2 ? -wo : random.direction();
        wi_inside.emplace_back(wi, inside);
    }
    Bsdfs bsdfs(materials, coat_normals);
    const auto check = [&](const vec4& row, bool is_direction) {
        for (int k = 0; k < 4; ++k) {
            REQUIRE(std::isfinite(row[k]));
            if (!is_direction || k == 3) REQUIRE(row[k] >= 0.0f);
        }
    };
    const std::vector<Sample> samples = bsdfs.run<Sample>("sample_bsdf_test", first, second);
    const std::vector<vec4> found = bsdfs.run<vec4>("evaluate_bsdf_test", wo_material, wi_inside);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        CAPTURE(i, first[i].x, first[i].y, first[i].z, second[i].x, second[i].y, second[i].z, wi_inside[i].x);
        check(samples[i].wi_pdf, true);
        check(samples[i].weight_delta, false);
        check(samples[i].found, false);
        check(found[i], false);
        if (samples[i].pdf() > 0.0) REQUIRE(first[i].z > 0.0f);
    }
}

TEST_CASE("tables of albedos agree with integrals", "[kernels][bsdf]") {
    // Over normals with the density D cos h, which is not how the tables were made.
    RandomSource random(41);
    std::vector<vec4> places;
    for (int i = 0; i < 48; ++i) {
        const float index = random.uniform_float(1.2f, 2.5f);
        places.emplace_back(random.uniform_float(0.03f, 1), random.uniform_float(0.06f, 1), i % 2 ? index : 1 / index,
                            0);
    }
    Bsdfs bsdfs({plain_material()});
    const std::vector<vec4> found = bsdfs.albedos(places);
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double z = places[i].x, alpha = double(places[i].y) * places[i].y, eta = places[i].z;
        const dvec3 wo(std::sqrt(1 - z * z), 0, z);
        double all = 0.0, grazing = 0.0, of_glass = 0.0;
        constexpr int kSteps = 160;
        for (int x = 0; x < kSteps; ++x)
            for (int y = 0; y < kSteps; ++y) {
                const double rest = 1 - (x + 0.5) / kSteps, phi = 2 * kPi * (y + 0.5) / kSteps;
                const double slope = alpha * std::sqrt(1 / (rest * rest) - 1);
                const dvec3 h = glm::normalize(dvec3(slope * std::cos(phi), slope * std::sin(phi), 1));
                const double o = glm::dot(wo, h);
                if (!(o > 0.0)) continue;
                const double share = 2 * rest * o / (z * h.z) / (kSteps * kSteps);
                const auto unshadowed = [&](const dvec3& wi) {
                    return 1 / (1 + lambda(wo, alpha) + lambda(wi, alpha));
                };
                const dvec3 mirrored = 2 * o * h - wo;
                const double reflected = mirrored.z > 0.0 ? unshadowed(mirrored) : 0.0;
                all += share * reflected;
                grazing += share * reflected * std::pow(1 - o, 5.0);
                const double squared = 1 - (1 - o * o) / (eta * eta), there = std::sqrt(std::max(squared, 0.0));
                const dvec3 bent = (o / eta - there) * h - wo / eta;
                const double s = (o - eta * there) / (o + eta * there), p = (eta * o - there) / (eta * o + there);
                const double fresnel = squared > 0.0 ? (s * s + p * p) / 2 : 1.0;
                of_glass += share * (fresnel * reflected + (1 - fresnel) * (bent.z < 0.0 ? unshadowed(bent) : 0.0));
            }
        CAPTURE(z, places[i].y, eta, all, found[i].x, grazing, found[i].y, of_glass, found[i].w);
        CHECK(std::fabs(found[i].x - all) <= 0.004);
        CHECK(std::fabs(found[i].y - grazing) <= 0.004);
        CHECK(std::fabs(found[i].w - of_glass) <= 0.008);
    }
}

TEST_CASE("the table of stretched facets agrees with integrals", "[kernels][bsdf]") {
    RandomSource random(42);
    std::vector<vec4> places;
    for (int i = 0; i < 48; ++i)
        places.emplace_back(random.uniform_float(0.05f, 1), random.uniform_float(0.1f, 1), random.uniform_float(0, 1),
                            random.uniform_float(0.1f, 1));
    const std::vector<vec4> found = Bsdfs({plain_material()}).albedos(places);
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double z = places[i].x, alpha = double(places[i].y) * places[i].y, along = places[i].z;
        const double alpha_x = alpha + (1 - alpha) * double(places[i].w) * places[i].w, sine = std::sqrt(1 - z * z);
        const dvec3 wo(sine * along, sine * std::sqrt(1 - along * along), z);
        const auto lambda_of = [&](const dvec3& w) {
            return (std::sqrt(1 + (std::pow(alpha_x * w.x, 2.0) + std::pow(alpha * w.y, 2.0)) / (w.z * w.z)) - 1) / 2;
        };
        double all = 0.0;
        constexpr int kSteps = 240;
        for (int x = 0; x < kSteps; ++x)
            for (int y = 0; y < kSteps; ++y) {
                const double rest = 1 - (x + 0.5) / kSteps, phi = 2 * kPi * (y + 0.5) / kSteps;
                const double slope = std::sqrt(1 / (rest * rest) - 1);
                const dvec3 h =
                    glm::normalize(dvec3(alpha_x * slope * std::cos(phi), alpha * slope * std::sin(phi), 1));
                const double o = glm::dot(wo, h);
                const dvec3 wi = 2 * o * h - wo;
                if (!(o > 0.0) || !(wi.z > 0.0)) continue;
                all += 2 * rest * o / (z * h.z) / (kSteps * kSteps) / (1 + lambda_of(wo) + lambda_of(wi));
            }
        CAPTURE(z, places[i].y, along, places[i].w, all, found[i].x);
        CHECK(std::fabs(found[i].x - all) <= 0.015);
    }
}

}  // namespace castor::test
