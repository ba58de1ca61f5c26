// Solids whose insides scatter light, in path-traced pictures: closed formulas and published values, and the same bytes
// however the work is done. All scenes have the same features, so that the kernels are compiled once.
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "reference/random_source.h"
#include "scene/principled.h"
#include "support/blocks.h"
#include "support/catch.h"
#include "support/divided_scene.h"
#include "support/estimate.h"
#include "support/picture.h"
#include "support/principled_scene.h"
#include "support/same_picture.h"

namespace castor::test {

namespace {

using glm::dvec3;
using glm::vec3;

/// Clear but for what is inside: of index 1, it neither reflects nor refracts. `extinction`: by absorbing and
/// scattering, in a length of 1.
PrincipledMaterial milk(float extinction, float color, float anisotropy = 0.0f) {
    PrincipledMaterial material;
    material.metallic = material.roughness = 0.0f;
    material.transmission = material.thickness = material.ior = 1.0f;
    material.attenuation_color = vec3(std::exp(-1.0f));
    material.attenuation_distance = 1.0f / extinction;
    material.multiscatter_color = vec3(color);
    material.scattering_anisotropy = anisotropy;
    return material;
}

/// The same by the albedo of a single scattering.
PrincipledMaterial milk_of_albedo(float extinction, double albedo, float anisotropy = 0.0f) {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        const bool is_less = double{scattering_albedo_of(milk(extinction, float(middle), anisotropy)).x} < albedo;
        (is_less ? low : high) = middle;
    }
    return milk(extinction, float(high), anisotropy);
}

/// With one material of each kind that kernels are compiled for.
Scene scene_in(float radiance) {
    Scene scene = empty_scene_in(radiance);
    PrincipledMaterial pane = milk(1.0f, 0.0f);
    pane.thickness = 0.0f;
    scene.materials = {material_of(milk(1.0f, 0.5f)), material_of(matt(vec3(0.0f))), material_of(pane)};
    scene.shadow_ray_epsilon = 1e-6f;
    return scene;
}

/// A slab from z = -1 to z = -1 - thickness, without end for what is thin.
Scene slab(const PrincipledMaterial& material, float thickness, float radiance = 1.0f) {
    Scene scene = scene_in(radiance);
    const std::uint32_t number = add_material(scene, material_of(material));
    scene.meshes = {rectangle({0, 0, -1}, {9, 0, 0}, {0, 9, 0}, number),
                    rectangle({0, 0, -1 - thickness}, {0, 9, 0}, {9, 0, 0}, number)};
    return scene;
}

/// What is as good as a half-space: closed, since rays that meet nothing are in no solid.
Scene thick(const PrincipledMaterial& material) {
    Scene scene = scene_in(1.0f);
    scene.spheres = {{{0, 0, -21}, 20.0f, add_material(scene, material_of(material)), 0}};
    return scene;
}

Estimate seen(const Scene& scene, std::uint32_t samples, float z = 0.0f) {
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({0, 0, z}, {0, 0, -1}, 1e-3f, 16);
    camera.path_tracing.emplace().bounces = 8;
    RenderOptions options;
    options.samples_per_pixel = samples;
    return estimate_of(renderer.render(camera, options));
}

/// Chandrasekhar's function H of isotropic scattering (1950, "Radiative Transfer", section 38): the solution of
/// 1/H(m) = sqrt(1 - a) + a/2 * the integral of m' H(m') / (m + m') over [0, 1].
class ChandrasekharH {
public:
    explicit ChandrasekharH(double albedo) : albedo_(albedo), values_(kSteps, 1.0) {
        for (int turn = 0; turn < 100; ++turn) {
            std::vector<double> next(kSteps);
            for (int i = 0; i < kSteps; ++i) next[i] = at((i + 0.5) / kSteps);
            values_ = next;
        }
    }
    double at(double m) const {
        double integral = 0.0;
        for (int i = 0; i < kSteps; ++i) {
            const double other = (i + 0.5) / kSteps;
            integral += other * values_[i] / (m + other) / kSteps;
        }
        return 1.0 / (std::sqrt(1.0 - albedo_) + 0.5 * albedo_ * integral);
    }
    /// What a half-space reflects of light from this direction: sections 33 and 38.
    double reflected(double m) const { return 1.0 - at(m) * std::sqrt(1.0 - albedo_); }
    /// The same of light from all directions.
    double reflected() const {
        double sum = 0.0;
        for (int i = 0; i < kSteps; ++i) sum += 2.0 * (i + 0.5) / kSteps * reflected((i + 0.5) / kSteps) / kSteps;
        return sum;
    }

private:
    static constexpr int kSteps = 300;
    double albedo_;
    std::vector<double> values_;
};

}  // namespace

TEST_CASE("what scatters without absorbing sends as much as it gets", "[scattering]") {
    const auto [name, ior, roughness, anisotropy] =
        GENERATE(table<const char*, float, float, float>({{"of index 1", 1.0f, 0.0f, 0.0f},
                                                          {"forwards", 1.0f, 0.0f, 0.8f},
                                                          {"backwards", 1.0f, 0.0f, -0.5f},
                                                          {"in smooth glass", 1.5f, 0.0f, 0.3f},
                                                          {"in rough glass", 1.3f, 0.3f, 0.0f}}));
    PrincipledMaterial material = milk(3.0f, 1.0f, anisotropy);
    material.ior = ior;
    material.roughness = roughness;
    Scene scene = scene_in(1.0f);
    scene.spheres = {{{0, 0, -3}, 1.0f, add_material(scene, material_of(material)), 0}};
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({}, {0, 0, -1}, 0.2f, 16);
    camera.path_tracing.emplace().bounces = 64;
    RenderOptions options;
    options.samples_per_pixel = 16;
    const Estimate found = estimate_of(renderer.render(camera, options));
    CAPTURE(name, found.mean, found.standard_error);
    CHECK(std::abs(found.mean - 1.0) <= 0.005 + 4.0 * found.standard_error);
    CHECK(found.standard_error <= 0.01);
}

TEST_CASE("a thick medium reflects what Chandrasekhar's function says", "[scattering]") {
    // Seen straight down in light from all sides, by reciprocity with light straight down.
    const double albedo = GENERATE(0.5, 0.9, 0.99);
    const double expected = ChandrasekharH(albedo).reflected(1.0);
    CAPTURE(albedo);
    check_mean(seen(thick(milk_of_albedo(1000.0f, albedo)), 256), expected);
}

TEST_CASE("a slab reflects and transmits what van de Hulst's tables say", "[scattering]") {
    // 1980, "Multiple Light Scattering", as given by Wang, Jacques 1995: optical thickness 2, albedo 0.9, anisotropy
    // 0.75, index 1: 0.09739 is reflected and 0.66096 transmitted.
    Scene scene = slab(milk_of_albedo(200.0f, 0.9, 0.75f), 0.01f);
    check_mean(seen(scene, 64), 0.09739 + 0.66096);
    SECTION("alone") {}
    SECTION("with a pane within, that nobody sees") {
        scene.meshes.push_back(rectangle({0, 0, -1.004f}, {9, 0, 0}, {0, 9, 0}, 2));
        check_mean(seen(scene, 64), 0.09739 + 0.66096);
    }
    scene.meshes.push_back(rectangle({0, 0, -1.1f}, {900, 0, 0}, {0, 900, 0}, 1));  // black
    check_mean(seen(scene, 256), 0.09739);
}

TEST_CASE("an eye just within what scatters sees what one just before it does", "[scattering]") {
    // Of index 1: the tables of the slab, and the function of the half-space.
    check_mean(seen(slab(milk_of_albedo(200.0f, 0.9, 0.75f), 0.01f), 64, -1.0f - 1e-6f), 0.09739 + 0.66096);
    check_mean(seen(thick(milk_of_albedo(1000.0f, 0.9)), 256, -1.0f - 1e-6f), ChandrasekharH(0.9).reflected(1.0));
}

TEST_CASE("an eye in what scatters sees what shines there as if little were between", "[scattering]") {
    // Whatever is scattered gets nowhere but to a black wall: exp(-extinction * distance) of the light is left.
    Scene scene = scene_in(0.0f);
    PrincipledMaterial shining = matt(vec3(0.0f));
    shining.emissive = vec3(3.0f);
    const std::uint32_t lamp = add_material(scene, material_of(shining));
    scene.spheres = {{{0, 0, 0}, 4.0f, add_material(scene, material_of(milk_of_albedo(0.5f, 0.9))), 0},
                     {{0, 0, -2}, 1e-3f, lamp, 0}};
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({}, {0, 0, -1}, 1e-4f, 16);
    camera.path_tracing.emplace().samples_lights = false;
    camera.path_tracing->weighs = false;
    RenderOptions options;
    options.samples_per_pixel = 64;
    options.aovs = {"mean-normal"};
    const Film film = renderer.render(camera, options);
    check_mean(estimate_of(film), 255.0 * 3.0 * std::exp(-0.5 * 1.999));
    // What denoisers are told is what is seen without any scattering.
    REQUIRE(film.planes.size() == 1);
    for (std::size_t i = 2; i < film.planes[0].values.size(); i += 3) CHECK(film.planes[0].values[i] > 0.9f);
}

/// What scatters between a lamp and an eye at (0,0,0).
struct Fog {
    double extinction, albedo, anisotropy;
    double radius;  // of a ball around the eye, of index 1
};

/// The light of 1 from `lamp`, or from infinitely far away in its direction, that an eye sees along `gaze`.
Estimate light_in_fog(const Fog& fog, const dvec3& lamp, bool is_far, const dvec3& gaze) {
    RandomSource random(7);
    const double g = fog.anisotropy;
    const auto to_edge = [&](const dvec3& at, const dvec3& direction) {
        const double b = glm::dot(at, direction);
        return std::sqrt(b * b - glm::dot(at, at) + fog.radius * fog.radius) - b;
    };
    double sum = 0.0, squares = 0.0;
    constexpr int kPaths = 1 << 17;
    for (int path = 0; path < kPaths; ++path) {
        dvec3 at(0.0), direction = glm::normalize(gaze);
        double carried = 1.0, found = 0.0;
        while (carried > 1e-4) {
            const double way = -std::log(1.0 - random.uniform(0.0, 1.0)) / fog.extinction;
            if (way >= to_edge(at, direction)) break;
            at += direction * way;
            carried *= fog.albedo;
            const dvec3 to_lamp = is_far ? lamp : lamp - at;
            const double distance = glm::length(to_lamp);
            const dvec3 wi = to_lamp / distance;
            const double within = is_far ? to_edge(at, wi) : std::min(distance, to_edge(at, wi));
            const auto phase = [&](const dvec3& next) {  // times 4 pi
                return (1.0 - g * g) / std::pow(1.0 + g * g - 2.0 * g * glm::dot(next, direction), 1.5);
            };
            found += carried * phase(wi) / (4.0 * std::numbers::pi) * std::exp(-fog.extinction * within) /
                     (is_far ? 1.0 : distance * distance);
            // The next direction, uniform over the sphere and weighed.
            const double z = random.uniform(-1.0, 1.0), angle = random.uniform(0.0, 2.0 * std::numbers::pi);
            const double r = std::sqrt(1.0 - z * z);
            const dvec3 next(r * std::cos(angle), r * std::sin(angle), z);
            carried *= phase(next);
            direction = next;
        }
        sum += found;
        squares += found * found;
    }
    const double mean = sum / kPaths;
    return {mean, std::sqrt((squares / kPaths - mean * mean) / kPaths)};
}

TEST_CASE("lights that no ray meets light what scatters, from within and through the surface", "[scattering]") {
    const auto [albedo, g] = GENERATE(table<double, float>({{0.05, 0.0f}, {0.8, 0.0f}, {0.5, 0.4f}}));
    struct Lamp {
        const char* name;
        Light light;
        dvec3 at;
        bool is_far;
        float radius;  // of the fog
    };
    const vec3 at(0.7f, 0.3f, -2.0f), outside(2, 1, -4), intensity(5.0f);
    Light spot;  // that shines all around, but for a cone behind it
    spot.kind = Light::Kind::spot;
    spot.spot.position = at;
    spot.spot.intensity = intensity;
    spot.spot.direction = {0, 0, -1};
    spot.spot.coverage_radians = 6.28f;
    spot.spot.falloff_radians = 6.27f;
    const auto& [name, light, lamp, is_far, radius] =
        GENERATE_COPY(values<Lamp>({{"point", point_light(at, intensity), at, false, 50.0f},
                                    {"spot", spot, at, false, 50.0f},
                                    {"point outside", point_light(outside, intensity), outside, false, 3.0f},
                                    {"sun", directional_light(-outside, intensity), outside, true, 3.0f}}));
    Scene scene = scene_in(0.0f);
    scene.spheres = {{{0, 0, 0}, radius, add_material(scene, material_of(milk_of_albedo(0.5f, albedo, g))), 0}};
    scene.lights.push_back(light);
    // Of others nothing arrives; of many lights some are seen from a point.
    for (int i = 0; i < (is_far ? 1 : 6); ++i) scene.lights.push_back(point_light({1e4f, 0, 0}, vec3(1.0f)));
    const Estimate expected = light_in_fog({0.5, albedo, double{g}, double{radius}}, lamp, is_far, {0, 0, -1});
    const Estimate found = seen(scene, 1024);
    CAPTURE(albedo, g, name, found.mean, found.standard_error, expected.mean, expected.standard_error);
    const double error = std::hypot(found.standard_error / 5.0, expected.standard_error);
    CHECK(std::abs(found.mean / 5.0 - expected.mean) <= 4.0 * error);
    CHECK(error <= 0.04 * expected.mean);
}

TEST_CASE("what scatters nothing absorbs as before", "[scattering]") {
    // (attenuation colour)^(thickness / distance), while other solids scatter.
    check_mean(seen(slab(milk(2.0f, 0.0f), 0.5f), 4), std::exp(-1.0));
}

TEST_CASE("a half-space reflects the colour that was asked for", "[scattering]") {
    for (const float color : {0.0f, 0.05f, 0.2f, 0.5f, 0.8f, 0.99f, 1.0f}) {
        const double albedo = scattering_albedo_of(milk(1.0f, color)).x;
        const double reflected = albedo < 1.0 ? ChandrasekharH(albedo).reflected() : 1.0;
        CAPTURE(color, albedo, reflected);
        CHECK(std::abs(reflected - double{color}) <= 0.005);
    }
    CHECK(scattering_albedo_of(milk(1.0f, 0.0f)) == vec3(0.0f));
    CHECK(scattering_albedo_of(milk(1.0f, 1.0f)) == vec3(1.0f));
    // Light that goes on nearly as it was must be scattered more often, to be reflected as much.
    CHECK(scattering_albedo_of(milk(1.0f, 0.5f, 0.8f)).x > scattering_albedo_of(milk(1.0f, 0.5f)).x);
    PrincipledMaterial other = milk(1.0f, 0.5f);
    SECTION("none of a thin wall") {
        other.thickness = 0.0f;
    }
    SECTION("nor without attenuation") {
        other.attenuation_color = vec3(1.0f);
    }
    SECTION("nor where no light gets in") {
        other.transmission = 0.0f;
    }
    CHECK(scattering_albedo_of(other) == vec3(0.0f));
}

TEST_CASE("rays to lights lose what is scattered on their way", "[scattering]") {
    // A lamp in a ball that scatters: by all ways of sampling the same.
    Scene scene = scene_in(0.0f);
    PrincipledMaterial shining = matt(vec3(0.0f));
    shining.emissive = vec3(1.0f);
    const std::uint32_t lamp = add_material(scene, material_of(shining)),
                        floor = add_material(scene, material_of(matt(vec3(0.5f)))),
                        ball = add_material(scene, material_of(milk(0.4f, 0.7f)));
    scene.meshes = {rectangle({0, -0.5f, 0}, {0, 0, 1}, {1, 0, 0}, floor)};
    scene.spheres = {{{0, 0, 0}, 2.0f, ball, 0}};
    scene.meshes.push_back(rectangle({0, 0.8f, 0}, {0.4f, 0, 0}, {0, 0, 0.4f}, lamp));
    SECTION("in the ball") {}
    SECTION("outside of it, too, where other lights shine through its surface") {
        scene.meshes.push_back(rectangle({1.5f, 2.5f, 0}, {0.8f, 0, 0}, {0, 0, 0.8f}, lamp));
        scene.lights.push_back(point_light({0, 5, 0}, vec3(0.0f)));
    }
    add_mesh_lights(scene);
    scene.shadow_ray_epsilon = 1e-5f;
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({0, 3, 3}, {0, -1, -1}, 0.3f, 16);
    const auto pictures = [&](bool samples_lights, bool weighs, std::uint32_t samples) {
        camera.path_tracing.emplace().samples_lights = samples_lights;
        camera.path_tracing->weighs = weighs;
        RenderOptions options;
        options.samples_per_pixel = samples;
        return pictures_of(renderer, camera, options, 8);
    };
    const BlockTest test(pictures(true, true, 128), 2);
    CHECK(test.check("by chance", pictures(false, false, 1024), 0.005, 0.05));
    CHECK(test.check("lights alone", pictures(true, false, 128), 0.005, 0.05));
}

TEST_CASE("what is as dense as can be scatters at its surface", "[scattering]") {
    // A distance of which the inverse is no float, where few scatterings leave nothing of the light.
    PrincipledMaterial material = milk_of_albedo(1.0f, 0.2);
    material.attenuation_distance = 1e-40f;
    Scene scene = scene_in(1.0f);
    scene.spheres = {{{0, 0, -3}, 1.0f, add_material(scene, material_of(material)), 0}};
    const Estimate found = seen(scene, 16);
    CAPTURE(found.mean);
    CHECK(found.mean >= 0.0);
    CHECK(found.mean < 1.0);
}

TEST_CASE("paths that are scattered too often end, and a notice says so", "[scattering]") {
    Scene scene = scene_in(1.0f);
    scene.spheres = {{{0, 0, -3}, 1.0f, add_material(scene, material_of(milk(3000.0f, 1.0f))), 0}};
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.samples_per_pixel = 1;
    const Film film = renderer.render(square_camera({}, {0, 0, -1}, 0.1f, 8), options);
    CHECK(all_finite(film));
    const std::vector<std::string> notices = renderer.statistics().notices;
    REQUIRE(notices.size() == 1);
    CHECK_THAT(notices[0], Catch::StartsWith("paths were scattered more than 16384 times within a solid"));
}

TEST_CASE("pictures of what scatters have the same bytes however the work is done", "[scattering]") {
    const bool is_eye_within = GENERATE(false, true);
    CAPTURE(is_eye_within);
    Scene scene = scene_in(40.0f);
    PrincipledMaterial skin = milk(8.0f, 0.0f, 0.4f);
    skin.multiscatter_color = {0.9f, 0.5f, 0.3f};
    skin.attenuation_color = {0.8f, 0.4f, 0.2f};
    skin.ior = 1.4f;
    skin.roughness = 0.4f;
    PrincipledMaterial cloud = milk(2.0f, 0.95f, -0.3f);
    scene.spheres = {{{-0.4f, 0, -3}, 0.6f, add_material(scene, material_of(skin)), 0},
                     {{0.5f, 0.2f, -3}, 0.5f, add_material(scene, material_of(cloud)), 0},
                     {{0.5f, 0.2f, -3}, 0.2f, add_material(scene, material_of(skin)), 0}};
    scene.spheres[2].motion = {0.2f, 0, 0};
    scene.meshes = {
        rectangle({0, -0.7f, -3}, {2, 0, 0}, {0, 0, -2}, add_material(scene, material_of(matt(vec3(0.6f)))))};
    scene.lights.push_back(point_light({0.2f, 0.6f, -2}, vec3(30.0f)));
    if (is_eye_within)
        scene.spheres.push_back({{0, 0, -1}, 4.0f, add_material(scene, material_of(milk(0.2f, 0.5f))), 0});
    scene.cameras = {square_camera({}, {0, 0, -1}, 0.4f, 12)};
    scene.cameras[0].path_tracing.emplace().bounces = 4;
    const Camera& camera = scene.cameras[0];
    const Device device = test_device();
    RenderOptions options;
    options.samples_per_pixel = 3;
    const Film expected = Renderer(scene, {device}).render(camera, options);
    REQUIRE(all_finite(expected));
    check_every_way(scene, options, expected);
    options.tile_size = 16;
    check_divided(scene, Strategy::wide, 3, options, expected, 10 << 10);
}

TEST_CASE("insides that are none are refused", "[scattering]") {
    const auto [message, color, anisotropy] = GENERATE(table<const char*, float, float>(
        {{"multiscatter colour is", 1.5f, 0.0f}, {"the scattering anisotropy is 1", 0.5f, 1.0f}}));
    Scene scene = scene_in(1.0f);
    add_material(scene, material_of(milk(1.0f, color, anisotropy)));
    CHECK_THROWS_WITH(Renderer(scene, {test_device()}), Catch::Contains(message));
}

}  // namespace castor::test
