// Path tracing: scenes with closed formulas, ways of sampling that must agree, and the same bytes however the work is
// cut. All scenes have the same features, so that the kernels are compiled once.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/cpu_registers.h"
#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/merge.h"
#include "castor/renderer.h"
#include "reference/meshes.h"
#include "support/blocks.h"
#include "support/catch.h"
#include "support/estimate.h"
#include "support/picture.h"
#include "support/principled_scene.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

using glm::dvec3;
using glm::vec3;

Light object_light(Light::Kind kind, std::uint32_t object) {
    Light light;
    light.kind = kind;
    light.object.object = object;
    return light;
}

Material lambert(const vec3& albedo) {
    Material material = diffuse_material(albedo);
    material.brdf = BrdfModel::modified_phong;
    material.brdf_normalized = true;
    return material;
}

Material glass(float index, const vec3& absorption = vec3(0.0f)) {
    Material material;
    material.kind = MaterialKind::dielectric;
    material.refraction_index = index;
    material.absorption = absorption;
    return material;
}

Material lamp(const vec3& radiance) {
    Material material;
    material.emission = radiance;
    return material;
}

/// A scene in light of this radiance from everywhere, with one material of each kind that kernels are compiled for.
Scene scene_in(float radiance) {
    Scene scene = empty_scene_in(radiance);
    scene.materials = {lambert(vec3(1.0f)), glass(1.5f), lamp(vec3(1.0f))};
    return scene;
}

RenderOptions path_options(std::uint32_t samples) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.integrator = Integrator::path;
    return options;
}

/// Light found by directions alone, drawn as surfaces scatter.
PathTracing by_chance() {
    PathTracing tracing;
    tracing.samples_lights = tracing.weighs = false;
    return tracing;
}

/// A closed box with lamps, seen from within: matt and glossy walls, a mirror, metal and glass.
Scene room() {
    Scene scene = scene_in(0.0f);
    Material glossy = lambert({0.2f, 0.3f, 0.5f});
    glossy.specular = vec3(0.4f);
    glossy.phong_exponent = 20.0f;
    Material blinn = glossy;
    blinn.brdf = BrdfModel::modified_blinn_phong;
    blinn.phong_exponent = 8.0f;
    Material metal = mirror_material({0.9f, 0.7f, 0.4f}, MaterialKind::conductor);
    metal.refraction_index = 0.3f;
    metal.absorption_index = 3.0f;
    Material half_mirror = mirror_material(vec3(0.4f));
    half_mirror.diffuse = vec3(0.3f);
    half_mirror.brdf = BrdfModel::modified_phong;
    half_mirror.brdf_normalized = true;
    const std::uint32_t white = add_material(scene, lambert(vec3(0.7f))),
                        red = add_material(scene, lambert({0.7f, 0.2f, 0.1f}));
    const std::uint32_t shiny = add_material(scene, glossy), satin = add_material(scene, blinn);
    const std::uint32_t mirror = add_material(scene, half_mirror), conductor = add_material(scene, metal);
    const std::uint32_t panel = add_material(scene, lamp({9, 8, 6})), ball = add_material(scene, lamp({6, 9, 12}));
    const std::uint32_t coloured_glass = add_material(scene, glass(1.5f, {0.5f, 0.1f, 0.3f}));
    scene.meshes = {
        rectangle({0, -1, 0}, {0, 0, 1}, {1, 0, 0}, white),        rectangle({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, white),
        rectangle({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, red),          rectangle({1, 0, 0}, {0, 0, 1}, {0, 1, 0}, shiny),
        rectangle({0, 0, -1}, {1, 0, 0}, {0, 1, 0}, satin),        rectangle({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, white),
        rectangle({0, 0.9f, 0}, {0.3f, 0, 0}, {0, 0, 0.3f}, panel)};
    scene.spheres = {{{-0.5f, -0.6f, -0.4f}, 0.35f, mirror, 0},
                     {{0.5f, -0.65f, -0.3f}, 0.3f, coloured_glass, 0},
                     {{0.0f, -0.7f, 0.3f}, 0.25f, conductor, 0},
                     {{-0.6f, 0.4f, -0.5f}, 0.15f, ball, 0},
                     // Two lights have one material, and their own weights all the same.
                     {{0.7f, 0.3f, 0.1f}, 0.1f, ball, 0}};
    scene.lights.push_back(object_light(Light::Kind::mesh, 6));
    scene.lights.push_back(object_light(Light::Kind::sphere, 3));
    scene.lights.push_back(object_light(Light::Kind::sphere, 4));
    scene.cameras = {square_camera({0, 0, 0.95f}, {0, -0.1f, -1}, 1.0f, 16)};
    return scene;
}

/// A sky of 64 x 32 texels that is lighter above, with a sun of `size` x `size` texels that has this radiance.
Image sunny_sky(float sun, std::uint32_t size) {
    Image sky;
    sky.width = 64;
    sky.height = 32;
    for (std::uint32_t y = 0; y < sky.height; ++y)
        for (std::uint32_t x = 0; x < sky.width; ++x)
            sky.floats.insert(sky.floats.end(), 3,
                              x >= 44 && x < 44 + size && y >= 9 && y < 9 + size ? sun : 1.0f - 0.02f * float(y));
    return sky;
}

/// Balls on a floor, with nothing but this sky.
Scene balls_under(const Image& sky, EnvironmentSampling sampling) {
    Scene scene = scene_in(0.0f);
    scene.images = {sky};
    scene.lights[0].environment.sampling = sampling;
    scene.materials[0] = lambert(vec3(0.6f));
    Material glossy = lambert({0.2f, 0.3f, 0.5f});
    glossy.specular = vec3(0.4f);
    glossy.phong_exponent = 20.0f;
    const std::uint32_t shiny = add_material(scene, glossy);
    scene.meshes = {rectangle({0, 0, 0}, {0, 0, 20}, {20, 0, 0}, 0)};
    scene.spheres = {{{-1.1f, 0.5f, 0}, 0.5f, 0, 0}, {{0, 0.5f, 0}, 0.5f, shiny, 0}, {{1.1f, 0.5f, 0}, 0.5f, 1, 0}};
    scene.shadow_ray_epsilon = 1e-4f;
    scene.cameras = {square_camera({0, 1.5f, 4}, {0, -0.25f, -1}, 0.9f, 16)};
    return scene;
}

/// The mean of a picture's red channel over pictures with other seeds.
Estimate mean_of_pictures(Renderer& renderer, const Camera& camera, RenderOptions options, std::uint32_t pictures) {
    std::vector<double> means;
    for (options.seed = 0; options.seed < pictures; ++options.seed)
        means.push_back(estimate_of(renderer.render(camera, options)).mean);
    double sum = 0.0, squares = 0.0;
    for (const double mean : means) sum += mean;
    for (const double mean : means) squares += std::pow(mean - sum / pictures, 2.0);
    return {sum / pictures, std::sqrt(squares / (pictures - 1.0) / pictures)};
}

}  // namespace

TEST_CASE("a white surface in white light sends as much as it gets", "[path]") {
    Scene scene = scene_in(1.0f);
    scene.materials[0] = lambert(vec3(1.0f));
    scene.materials.push_back(mirror_material(vec3(1.0f)));
    for (const std::uint32_t material : {0u, 1u, 3u}) {
        CAPTURE(material);
        scene.spheres = {{{0, 0, -3}, 1.0f, material, 0}};
        Renderer renderer(scene, {test_device()});
        Camera camera = square_camera({}, {0, 0, -1}, 0.2f, 16);
        camera.path_tracing = by_chance();
        camera.path_tracing->roulette_from.reset();
        const Film by_directions = renderer.render(camera, path_options(16));
        float error = 0.0f;
        for (const vec3& pixel : by_directions.pixels) error = std::max(error, std::abs(pixel.x - 1.0f));
        // Glass keeps some light for more than 12 bounces: less than 0.1^6.
        CHECK(error <= 2e-5f);
        // Roulette makes of few paths more: an estimate that is not normally distributed.
        camera.path_tracing.reset();
        CHECK(std::abs(estimate_of(renderer.render(camera, path_options(16))).mean - 1.0) <= 1e-3);
        if (material != 0) continue;
        camera.path_tracing.emplace().samples_brdf = false;
        check_mean(estimate_of(renderer.render(camera, path_options(64))), 1.0);
        camera.path_tracing->samples_brdf = true;
        camera.path_tracing->weighs = false;
        check_mean(estimate_of(renderer.render(camera, path_options(16))), 1.0);
    }
}

TEST_CASE("a hollow sphere around a lamp has the radiance of an integrating sphere", "[path]") {
    // A wall of albedo a sees the lamp, of radius r, under k = (r / R)^2 of its hemisphere, and itself under the rest:
    // L = a (k Le + (1 - k) L).
    Scene scene = scene_in(0.0f);
    const double albedo = 0.5, k = 0.25, expected = albedo * k * 10.0 / (1.0 - albedo * (1.0 - k));
    scene.materials[0] = lambert(vec3(float(albedo)));
    scene.materials[2] = lamp(vec3(10.0f));
    scene.spheres = {{{0, 0, 0}, 2.0f, 0, 0}, {{0, 0, 0}, 1.0f, 2, 0}};
    scene.lights.push_back(object_light(Light::Kind::sphere, 1));
    scene.shadow_ray_epsilon = 1e-5f;  // by which the wall is nearer to the lamp
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({1.5f, 0, 0}, {1, 0, 0}, 0.3f, 16);
    check_mean(estimate_of(renderer.render(camera, path_options(64))), expected);
    camera.path_tracing.emplace().bounces.reset();
    check_mean(estimate_of(renderer.render(camera, path_options(64))), expected);
    camera.path_tracing = by_chance();
    check_mean(estimate_of(renderer.render(camera, path_options(256))), expected);
    // With so few bounces the sum ends: the wall sees the lamp, then what it sends itself.
    camera.path_tracing = PathTracing();
    camera.path_tracing->roulette_from.reset();
    for (const std::uint32_t bounces : {0u, 1u, 2u}) {
        CAPTURE(bounces);
        RenderOptions options = path_options(64);
        options.bounces = bounces;
        double sum = 0.0;
        for (std::uint32_t i = 0; i < bounces; ++i) sum = albedo * (k * 10.0 + (1.0 - k) * sum);
        check_mean(estimate_of(renderer.render(camera, options)), sum);
    }
}

TEST_CASE("glass takes from paths what it absorbs", "[path]") {
    // A slab 2 thick of index 1, which neither reflects nor refracts.
    Scene scene = scene_in(3.0f);
    scene.materials[1] = glass(1.0f, {0.5f, 0.0f, 2.0f});
    scene.shadow_ray_epsilon = 1e-6f;  // by which refracted rays begin within
    scene.meshes = {rectangle({0, 0, -1}, {9, 0, 0}, {0, 9, 0}, 1), rectangle({0, 0, -3}, {0, 9, 0}, {9, 0, 0}, 1)};
    Renderer renderer(scene, {test_device()});
    const vec3 seen = renderer.render(square_camera({}, {0, 0, -1}, 1.0f, 1), path_options(1)).pixels[0];
    const dvec3 expected(3.0 * std::exp(-1.0), 3.0, 3.0 * std::exp(-4.0));
    for (int i = 0; i < 3; ++i) CHECK(std::abs(seen[i] - expected[i]) <= 1e-4 * expected[i]);
}

TEST_CASE("a sun with an angle lights from all of its disk", "[path]") {
    // Straight above a floor, of half angle a: the mean cosine is (1 + cos a) / 2. Below the edge of a roof half of the
    // disk is seen.
    Scene scene = scene_in(0.0f);
    scene.materials[0] = lambert(vec3(0.5f));
    scene.shadow_ray_epsilon = 1e-5f;
    scene.meshes = {rectangle({0, 0, 0}, {0, 0, 50}, {50, 0, 0}, 0)};
    Light sun = directional_light({0, -1, 0}, vec3(10.0f));
    const Camera camera = square_camera({0, 0.5f, 0}, {0, -1, 0.001f}, 0.0001f, 4);
    for (const double angle : {0.0, 0.01, 1.0, 3.0}) {
        for (const bool has_roof : {false, true}) {
            CAPTURE(angle, has_roof);
            sun.directional.angle_radians = static_cast<float>(angle);
            scene.lights.resize(1);
            scene.lights.push_back(sun);
            scene.meshes.resize(1);
            if (has_roof) scene.meshes.push_back(rectangle({-500, 1, 0}, {500, 0, 0}, {0, 0, 500}, 0));
            if (has_roof && angle == 0.0) continue;
            Renderer renderer(scene, {test_device()});
            RenderOptions options = path_options(2048);
            options.bounces = 1;
            const double expected = 0.5 / 3.14159265358979 * 10.0 * (1.0 + std::cos(0.5 * angle)) / 2.0;
            check_mean(estimate_of(renderer.render(camera, options)), has_roof ? 0.5 * expected : expected);
            // Rays that meet the disk by chance find the same, alone and by their weight.
            if (angle < 3.0) continue;
            Camera other = camera;
            other.path_tracing = by_chance();
            check_mean(estimate_of(renderer.render(other, options)), has_roof ? 0.5 * expected : expected);
            other.path_tracing->samples_lights = true;
            check_mean(estimate_of(renderer.render(other, options)), has_roof ? 0.5 * expected : expected);
        }
    }
    scene.lights[1].directional.angle_radians = 3.2f;
    CHECK_THROWS_WITH(Renderer(scene, {test_device()}), Catch::Contains("angle is 3.2 radians, expected 0 to pi"));
}

TEST_CASE("the disk of a sun is seen, in mirrors and through glass too", "[path]") {
    // Its radiance is the irradiance by the solid angle 2 pi (1 - cos a) of a half angle a. Below the eye is a mirror,
    // above it a slab of index 1.
    Scene scene = scene_in(0.0f);
    scene.materials[0] = mirror_material(vec3(0.5f));
    scene.materials[1] = glass(1.0f);
    scene.shadow_ray_epsilon = 1e-5f;
    const Mesh mirror = rectangle({0, -1, 0}, {0, 0, 90}, {90, 0, 0}, 0);
    const Mesh below = rectangle({0, 2, 0}, {90, 0, 0}, {0, 0, 90}, 1),
               above = rectangle({0, 3, 0}, {0, 0, 90}, {90, 0, 0}, 1);
    const dvec3 to_sun(0.48, 0.64, -0.6), aside(0.8, -0.6, 0.0);
    scene.background = vec3(0.25f);
    for (const double angle : {3e-4, 0.0093, 0.5}) {
        Light sun = directional_light(vec3(-to_sun), vec3(10.0f));
        sun.directional.angle_radians = static_cast<float>(angle);
        scene.lights = {sun};
        scene.meshes = {mirror};
        Renderer over_mirror(scene, {test_device()});
        scene.meshes = {below, above};
        Renderer under_slab(scene, {test_device()});
        const double radiance = 10.0 / (4.0 * std::numbers::pi * std::pow(std::sin(0.25 * angle), 2));
        for (const double part : {0.0, 0.49, 0.51}) {
            const dvec3 direction = std::cos(part * angle) * to_sun + std::sin(part * angle) * aside;
            const double there = part < 0.5 ? radiance : 0.0;
            const auto check = [&](Renderer& renderer, const dvec3& gaze, double expected) {
                const Camera camera = square_camera({}, vec3(gaze), 1e-6f, 1);
                const float seen = renderer.render(camera, path_options(1)).pixels[0].x;
                CAPTURE(angle, part, gaze.y, seen, expected);
                CHECK(std::abs(double{seen} - expected) <= 1e-4 * expected);
            };
            check(over_mirror, direction, there + 0.25);  // eye rays see the background as well
            check(over_mirror, {direction.x, -direction.y, direction.z}, 0.5 * there);
            check(under_slab, direction, there);
        }
    }
}

TEST_CASE("all ways of sampling find the light of a sun behind glass and over a mirror", "[path]") {
    // A matt floor below a ball of glass and half a mirror, under a sun of 20 degrees and a dim sky. Rays to the sun do
    // not pass the glass: only paths that meet the disk find what it throws onto the floor.
    Scene scene = scene_in(0.3f);
    scene.materials[0] = lambert(vec3(0.6f));
    Material half_mirror = mirror_material(vec3(0.4f));
    half_mirror.diffuse = vec3(0.3f);
    half_mirror.brdf = BrdfModel::modified_phong;
    half_mirror.brdf_normalized = true;
    const std::uint32_t wall = add_material(scene, half_mirror);
    scene.meshes = {rectangle({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, 0),
                    rectangle({0, 1, -1.5f}, {2, 0, 0}, {0, 1, 0}, wall)};
    scene.spheres = {{{0, 0.7f, 0}, 0.6f, 1, 0}};
    Light sun = directional_light({-0.3f, -1.0f, -0.4f}, vec3(3.0f));
    sun.directional.angle_radians = 0.35f;
    scene.lights.push_back(sun);
    scene.shadow_ray_epsilon = 1e-4f;
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({0, 1.2f, 2.5f}, {0, -0.4f, -1}, 0.8f, 16);
    const auto pictures = [&](PathTracing tracing, std::uint32_t samples) {
        tracing.bounces = 4;
        camera.path_tracing = tracing;
        return pictures_of(renderer, camera, path_options(samples), 8);
    };
    PathTracing any_light, no_roulette;
    any_light.light_choice = LightChoice::uniform;
    no_roulette.roulette_from.reset();
    const BlockTest test(pictures({}, 32), 3);
    CHECK(test.check("by chance", pictures(by_chance(), 128), 0.015, 0.1));
    CHECK(test.check("any light", pictures(any_light, 32), 0.015, 0.1));
    CHECK(test.check("no roulette", pictures(no_roulette, 32), 0.015, 0.1));
}

TEST_CASE("paths know the glass around glass, and that in which the eye is", "[path]") {
    // Slabs of index 1, one within the other: 1 of the outer, 2 of the inner, 1 of the outer.
    Scene scene = scene_in(3.0f);
    scene.materials[1] = glass(1.0f, {0.5f, 0.0f, 0.25f});
    const std::uint32_t inner = add_material(scene, glass(1.0f, {0.125f, 0.5f, 0.0f}));
    scene.shadow_ray_epsilon = 1e-6f;
    scene.meshes = {rectangle({0, 0, -1}, {9, 0, 0}, {0, 9, 0}, 1), rectangle({0, 0, -5}, {0, 9, 0}, {9, 0, 0}, 1),
                    rectangle({0, 0, -2}, {9, 0, 0}, {0, 9, 0}, inner),
                    rectangle({0, 0, -4}, {0, 9, 0}, {9, 0, 0}, inner)};
    Renderer renderer(scene, {test_device()});
    const auto check_seen = [&](float eye_z, const dvec3& outer_way, const dvec3& inner_way) {
        Camera camera = square_camera({0, 0, eye_z}, {0, 0, -1}, 1.0f, 1);
        camera.path_tracing.emplace().roulette_from.reset();
        const vec3 seen = renderer.render(camera, path_options(1)).pixels[0];
        const dvec3 expected = 3.0 * glm::exp(-dvec3(0.5, 0.0, 0.25) * outer_way - dvec3(0.125, 0.5, 0.0) * inner_way);
        for (int i = 0; i < 3; ++i) {
            CAPTURE(eye_z, i, seen[i], expected[i]);
            CHECK(std::abs(seen[i] - expected[i]) <= 1e-4 * expected[i]);
        }
    };
    check_seen(0.0f, dvec3(2.0), dvec3(2.0));
    check_seen(-3.0f, dvec3(1.0), dvec3(1.0));  // within both
    check_seen(-4.5f, dvec3(0.5), dvec3(0.0));  // within the outer one
}

TEST_CASE("all ways of sampling find the same light within glass that absorbs", "[path]") {
    // A matt floor and a lamp in a ball of index 1, seen from without.
    Scene scene = scene_in(0.0f);
    scene.materials[0] = lambert(vec3(0.5f));
    scene.materials[1] = glass(1.0f, vec3(0.5f));
    scene.materials[2] = lamp(vec3(10.0f));
    scene.shadow_ray_epsilon = 1e-5f;
    scene.meshes = {rectangle({0, -0.5f, 0}, {0, 0, 1}, {1, 0, 0}, 0)};
    scene.spheres = {{{0, 0, 0}, 2.0f, 1, 0}, {{0, 0.5f, 0}, 0.3f, 2, 0}};
    scene.lights.push_back(object_light(Light::Kind::sphere, 1));
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({0, 3, 3}, {0, -1, -1}, 0.3f, 16);
    const auto pictures = [&](const PathTracing& tracing, std::uint32_t samples) {
        camera.path_tracing = tracing;
        return pictures_of(renderer, camera, path_options(samples), 8);
    };
    PathTracing lights_alone;
    lights_alone.weighs = false;
    const BlockTest test(pictures({}, 32), 2);
    CHECK(test.check("by chance", pictures(by_chance(), 256), 0.005, 0.05));
    CHECK(test.check("lights alone", pictures(lights_alone, 32), 0.005, 0.05));
}

TEST_CASE("all ways of sampling find the same light", "[path]") {
    const Scene scene = room();
    Renderer renderer(scene, {test_device()});
    Camera camera = scene.cameras[0];
    constexpr std::uint32_t kPictures = 8;
    const auto pictures = [&](const PathTracing& tracing, std::uint32_t samples) {
        camera.path_tracing = tracing;
        return pictures_of(renderer, camera, path_options(samples), kPictures);
    };
    PathTracing usual;
    usual.bounces = 6;
    struct Way {
        std::string name;
        PathTracing tracing;
        std::uint32_t samples;
    };
    std::vector<Way> ways{{"by chance", by_chance(), 64}, {"lights alone", {}, 32}, {"uniform", {}, 32},
                          {"no roulette", {}, 16},        {"any light", {}, 32},    {"any light alone", {}, 32}};
    ways[1].tracing.weighs = false;
    ways[2].tracing.samples_brdf = false;
    ways[3].tracing.roulette_from.reset();
    ways[4].tracing.light_choice = ways[5].tracing.light_choice = LightChoice::uniform;
    ways[5].tracing.weighs = false;
    const BlockTest test(pictures(usual, 32), ways.size());
    for (Way& way : ways) {
        way.tracing.bounces = usual.bounces;
        CHECK(test.check(way.name, pictures(way.tracing, way.samples), 0.008, 0.04));
    }
}

TEST_CASE("all ways of sampling find the light of lamps with smooth normals", "[path]") {
    // Normals of vertices are those of round things, and faces are few: a ball of 20 triangles close above a floor, and
    // a panel under which the normals look outwards.
    Mesh ball = reference::icosphere(0);
    ball.normals = ball.positions;
    for (vec3& position : ball.positions) position = 0.3f * position + vec3(0, 0.35f, 0);
    Mesh panel = rectangle({0, 0.3f, 0}, {0.5f, 0, 0}, {0, 0, 0.5f}, 0);
    panel.normals = {{-1, -1, -1}, {1, -1, -1}, {1, -1, 1}, {-1, -1, 1}};
    for (Mesh* const shape : {&ball, &panel}) {
        Scene scene = scene_in(0.0f);
        scene.materials[0] = lambert(vec3(0.5f));
        shape->material = add_material(scene, lamp(vec3(4.0f)));
        scene.meshes = {rectangle({0, 0, 0}, {0, 0, 2}, {2, 0, 0}, 0), *shape};
        scene.lights.push_back(object_light(Light::Kind::mesh, 1));
        scene.shadow_ray_epsilon = 1e-4f;
        scene.cameras = {square_camera({0.1f, 0.15f, 1}, {0, -0.15f, -0.75f}, 0.05f, 16)};  // sees the floor alone
        Renderer renderer(scene, {test_device()});
        Camera camera = scene.cameras[0];
        const auto pictures = [&](const PathTracing& tracing) {
            camera.path_tracing = tracing;
            camera.path_tracing->bounces = 1;
            return pictures_of(renderer, camera, path_options(64), 16);
        };
        PathTracing lights_alone;
        lights_alone.weighs = false;
        CAPTURE(shape == &ball);
        const BlockTest test(pictures({}), 2);
        CHECK(test.check("lights alone", pictures(lights_alone), 0.002, 0.007));
        CHECK(test.check("by chance", pictures(by_chance()), 0.002, 0.007));
    }
}

TEST_CASE("a thousand lamps cost few samples where a tree chooses among them", "[path][light_tree]") {
    Scene scene = scene_in(0.0f);
    scene.materials[0] = lambert(vec3(0.5f));
    scene.meshes = {rectangle({0, 0, 0}, {0, 0, 40}, {40, 0, 0}, 0)};
    for (std::uint32_t i = 0; i < 1000; ++i) {
        const auto x = float(i % 40), z = float(i / 40);
        const std::uint32_t material = add_material(scene, lamp(vec3(10.0f + float(i * 7919 % 100))));
        scene.spheres.push_back({{x - 20.0f, 0.6f, -z}, 0.05f, material, 0});
        scene.lights.push_back(object_light(Light::Kind::sphere, i));
    }
    scene.shadow_ray_epsilon = 1e-4f;
    scene.cameras = {square_camera({0, 0.5f, -1}, {0, -0.6f, -1}, 0.4f, 16)};
    Renderer renderer(scene, {test_device()});
    Camera camera = scene.cameras[0];
    camera.path_tracing.emplace().bounces = 1;
    const auto picture = [&](LightChoice choice, std::uint32_t seed) {
        RenderOptions options = path_options(16);
        options.light_choice = choice;
        options.seed = seed;
        return renderer.render(camera, options);
    };
    double variance[2], mean[2];
    for (const auto choice : {LightChoice::tree, LightChoice::uniform}) {
        const Film a = picture(choice, 1), b = picture(choice, 2);
        const auto number = static_cast<std::size_t>(choice);
        variance[number] = mean[number] = 0.0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i) {
            variance[number] += 0.5 * std::pow(double{a.pixels[i].x} - double{b.pixels[i].x}, 2.0);
            mean[number] += 0.5 * (double{a.pixels[i].x} + double{b.pixels[i].x});
        }
    }
    const double factor = variance[1] / variance[0];
    WARN("variance under a thousand lamps, any of them over those that a tree chooses: " << factor);
    CHECK(factor > 20.0);
    CHECK(std::abs(mean[0] - mean[1]) <= 4.0 * std::sqrt(0.5 * (variance[0] + variance[1])));
}

TEST_CASE("all ways of sampling find the light of a sunny sky", "[path][environment]") {
    constexpr std::uint32_t kPictures = 8;
    struct Way {
        std::string name;
        EnvironmentSampling sampling;
        bool samples_lights, weighs;
        std::uint32_t samples;
    };
    const Way ways[] = {{"picture, joined", EnvironmentSampling::picture, true, true, 32},
                        {"picture alone", EnvironmentSampling::picture, true, false, 32},
                        {"cosine, joined", EnvironmentSampling::cosine, true, true, 64},
                        {"uniform alone", EnvironmentSampling::uniform, true, false, 64},
                        {"by chance", EnvironmentSampling::picture, false, false, 128}};
    std::optional<BlockTest> test;
    for (const Way& way : ways) {
        const Scene scene = balls_under(sunny_sky(60.0f, 2), way.sampling);
        Renderer renderer(scene, {test_device()});
        Camera camera = scene.cameras[0];
        camera.path_tracing.emplace();
        camera.path_tracing->samples_lights = way.samples_lights;
        camera.path_tracing->weighs = way.weighs;
        camera.path_tracing->bounces = 4;
        std::vector<Film> pictures = pictures_of(renderer, camera, path_options(way.samples), kPictures);
        if (test)
            CHECK(test->check(way.name, pictures, 0.008, 0.03));
        else
            test.emplace(std::move(pictures), std::size(ways) - 1);
    }
}

TEST_CASE("a sun costs few samples where the sky is sampled by its picture", "[path][environment]") {
    // What samples add to the variance of the pixels' mean, by pictures with other seeds.
    const auto error_of = [](EnvironmentSampling sampling, bool weighs) {
        const Scene scene = balls_under(sunny_sky(3000.0f, 1), sampling);
        Renderer renderer(scene, {test_device()});
        Camera camera = scene.cameras[0];
        camera.path_tracing.emplace().weighs = weighs;
        camera.path_tracing->bounces = 2;
        return mean_of_pictures(renderer, camera, path_options(4), 16).standard_error;
    };
    for (const bool weighs : {true, false}) {
        const double factor = std::pow(
            error_of(EnvironmentSampling::cosine, weighs) / error_of(EnvironmentSampling::picture, weighs), 2.0);
        WARN("variance of cosine sampling over that by the picture, " << (weighs ? "joined: " : "lights alone: ")
                                                                      << factor);
        CHECK(factor > 10.0);
    }
}

TEST_CASE("pictures under a sky that is sampled by its picture have the same bytes everywhere", "[path][environment]") {
    const Scene scene = balls_under(sunny_sky(60.0f, 2), EnvironmentSampling::picture);
    const Camera& camera = scene.cameras[0];
    const Device device = test_device();
    RenderOptions options = path_options(3);
    const Film expected = Renderer(scene, {device}).render(camera, options);
    REQUIRE(all_finite(expected));
    for (const Strategy strategy : {Strategy::brute, Strategy::simt})
        CHECK(same_bytes(Renderer(scene, {device}, {strategy}).render(camera, options), expected));
    const TemporaryDirectory folder;
    BuiltScene(scene, {device}).save(folder.path() / "scene");
    const BuiltScene saved = load_built_scene(folder.path() / "scene");
    CHECK(same_bytes(Renderer(saved, {device}).render(saved.description().cameras[0], options), expected));
    options.tile_size = 8;
    CHECK(same_bytes(Renderer(scene, {device, device}).render(camera, options), expected));
}

TEST_CASE("samples of paths are limited one by one", "[path]") {
    const Scene scene = room();
    Renderer renderer(scene, {test_device()});
    RenderOptions options = path_options(4);
    options.largest_sample = 0.25f;
    const Film limited = renderer.render(scene.cameras[0], options);
    float largest = 0.0f;
    for (const vec3& pixel : limited.pixels) largest = std::max({largest, pixel.x, pixel.y, pixel.z});
    CHECK(largest <= 0.25f);
    CHECK(largest > 0.2f);
    options.largest_sample = 1e9f;
    const Film high = renderer.render(scene.cameras[0], options);
    options.largest_sample.reset();
    CHECK(same_bytes(renderer.render(scene.cameras[0], options), high));
    options.bounces = 1025;
    CHECK_THROWS_AS(renderer.render(scene.cameras[0], options), UsageError);
    options.bounces.reset();
    options.largest_sample = 0.0f;
    CHECK_THROWS_AS(renderer.render(scene.cameras[0], options), UsageError);
}

TEST_CASE("means of what eye rays meet are those of the samples", "[path][variance]") {
    Scene scene = scene_in(2.0f);
    scene.materials[0] = lambert({0.8f, 0.4f, 0.2f});
    // Covers the right half of the picture.
    scene.meshes = {rectangle({1.0f, 0, -1}, {1, 0, 0}, {0, 2, 0}, 0)};
    scene.cameras = {square_camera({0, 0, 0}, {0, 0, -1}, 1.0f, 16)};
    Renderer renderer(scene, {test_device()});
    RenderOptions options = path_options(64);
    options.filter = ReconstructionFilter::box;
    options.aovs = {"mean-albedo", "mean-normal", "mean-position", "variance"};
    const Film film = renderer.render(scene.cameras[0], options);
    REQUIRE(film.planes.size() == 4);
    for (std::uint32_t y = 0; y < 16; ++y)
        for (std::uint32_t x = 0; x < 16; ++x) {
            const std::size_t i = y * 16 + x;
            const float *albedo = &film.planes[0].values[4 * i], *normal = &film.planes[1].values[3 * i],
                        *position = &film.planes[2].values[3 * i];
            CAPTURE(x, y, albedo[0], albedo[3], normal[2], position[0], position[1]);
            const bool is_met = x >= 8;
            CHECK(albedo[3] == (is_met ? 1.0f : 0.0f));
            CHECK(std::abs(albedo[0] - (is_met ? 0.8f : 0.0f)) < 1e-6f);
            CHECK(std::abs(albedo[2] - (is_met ? 0.2f : 0.0f)) < 1e-6f);
            CHECK(std::abs(normal[2]) == (is_met ? 1.0f : 0.0f));
            if (is_met) {
                CHECK(std::abs(position[0] - (static_cast<float>(x) + 0.5f - 8.0f) / 8.0f) < 0.02f);
                CHECK(std::abs(position[1] + (static_cast<float>(y) + 0.5f - 8.0f) / 8.0f) < 0.02f);
                CHECK(position[2] == -1.0f);
            } else {
                CHECK(film.planes[3].values[i] == 0.0f);  // the environment is the same everywhere
            }
        }
}

TEST_CASE("noise is removed from a path-traced picture", "[path][denoise]") {
    // Mirrors and glass show noise of which the planes know nothing.
    Scene scene = room();
    for (std::size_t i = 3; i < scene.materials.size(); ++i)
        if (scene.materials[i].emission == vec3(0.0f)) scene.materials[i] = lambert({0.7f, 0.5f, 0.3f});
    scene.cameras[0].width = scene.cameras[0].height = 48;
    Renderer renderer(scene, {test_device()});
    const RenderOptions many = path_options(256);
    RenderOptions few = path_options(8);
    few.seed = 3;
    few.aovs = {"noisy", "depth"};
    few.denoise = true;
    const Film reference = renderer.render(scene.cameras[0], many), clean = renderer.render(scene.cameras[0], few);
    CHECK(renderer.statistics().denoise_seconds > 0.0);
    REQUIRE(clean.planes.size() == 2);
    CHECK(clean.planes[0].name == "noisy");
    CHECK(clean.planes[1].name == "depth");
    few.denoise = false;
    few.aovs = {"depth"};
    const Film noisy = renderer.render(scene.cameras[0], few);
    CHECK(std::memcmp(clean.planes[0].values.data(), noisy.pixels.data(), noisy.pixels.size() * sizeof(vec3)) == 0);
    CHECK(clean.planes[1].values == noisy.planes[0].values);
    // Relative to the reference, so that lamps do not decide alone.
    const auto error = [&](const Film& film) {
        double sum = 0.0;
        for (std::size_t i = 0; i < film.pixels.size(); ++i)
            for (int c = 0; c < 3; ++c) {
                const double expected = reference.pixels[i][c], difference = film.pixels[i][c] - expected;
                sum += difference * difference / (expected * expected + 0.01);
            }
        return std::sqrt(sum / (3.0 * static_cast<double>(film.pixels.size())));
    };
    CAPTURE(error(noisy), error(clean));
    CHECK(error(clean) < 0.7 * error(noisy));  // most of what is left lies at edges of lamps

    RenderOptions refused = few;
    refused.denoise = true;
    refused.samples_per_pixel = 1;
    CHECK_THROWS_AS(renderer.render(scene.cameras[0], refused), UsageError);

    // Of parts that are joined.
    const TemporaryDirectory folder;
    few.denoise = true;
    few.aovs = {"noisy", "depth"};
    std::vector<std::filesystem::path> parts;
    for (const std::uint32_t number : {1u, 2u}) {
        RenderOptions of_part = few;
        of_part.part = PicturePart{number, 2};
        of_part.checkpoint_file = parts.emplace_back(folder.path() / std::to_string(number));
        renderer.render(scene.cameras[0], of_part);
    }
    const MergedPicture merged = merge_checkpoints(parts, {}, {test_device()});
    CHECK(merged.is_denoised);
    CHECK(same_bytes(merged.film, clean));
    CHECK_FALSE(merge_checkpoints({parts[0]}).is_denoised);  // not complete
    // And gone on with.
    RenderOptions resumed = few;
    resumed.resume_file = parts[0];
    CHECK(same_bytes(renderer.render(scene.cameras[0], resumed), clean));
}

TEST_CASE("blocks of a path-traced picture stop where their noise is small", "[path][noise]") {
    Scene scene = room();
    for (Material& material : scene.materials) material.emission *= 40.0f;
    scene.cameras[0].width = 40;
    scene.cameras[0].height = 20;  // the last blocks reach beyond the picture
    const Camera& camera = scene.cameras[0];
    constexpr double kNoise = 0.24;
    constexpr std::uint32_t kMost = 100;
    const Device device = test_device();
    Renderer renderer(scene, {device});
    RenderOptions options = path_options(kMost);
    options.noise = kNoise;
    options.aovs = {"samples", "variance"};
    const Film film = renderer.render(camera, options);
    REQUIRE(film.complete());
    REQUIRE(renderer.statistics().part_complete);
    std::map<std::uint32_t, std::uint64_t> pixels_by_samples;
    std::uint64_t samples = 0;
    for (const std::uint32_t count : film.planes[0].indices) {
        ++pixels_by_samples[count];
        samples += count;
    }
    CHECK(renderer.statistics().pixels_by_samples == pixels_by_samples);
    CHECK(renderer.statistics().samples_done == samples);
    REQUIRE(pixels_by_samples.size() == 4);
    CHECK(pixels_by_samples.rbegin()->first == kMost);

    // Pixels have the bytes of pictures with their numbers of samples, which tell whether blocks were to stop.
    const auto block_of = [](std::size_t pixel) { return pixel / 40 / 8 * 5 + pixel % 40 / 8; };
    constexpr std::size_t kBlocks = 15;
    for (const std::uint32_t count : {16u, 32u, 64u, kMost}) {
        RenderOptions plain = options;
        plain.noise.reset();
        plain.samples_per_pixel = count;
        const Film uniform = renderer.render(camera, plain);
        std::vector<double> luminance(kBlocks), variance(kBlocks), pixels(kBlocks);
        for (std::size_t i = 0; i < film.pixels.size(); ++i) {
            const vec3& rgb = uniform.pixels[i];
            luminance[block_of(i)] += 0.2126 * double{rgb.x} + 0.7152 * double{rgb.y} + 0.0722 * double{rgb.z};
            variance[block_of(i)] += double{uniform.planes[1].values[i]};
            ++pixels[block_of(i)];
        }
        for (std::size_t i = 0; i < film.pixels.size(); ++i) {
            const std::size_t block = block_of(i);
            const double error =
                std::sqrt(variance[block] / pixels[block]) / std::max(2.55, luminance[block] / pixels[block]);
            CAPTURE(count, i, error, film.planes[0].indices[i]);
            if (film.planes[0].indices[i] == count) {
                CHECK(film.pixels[i] == uniform.pixels[i]);
                CHECK(film.planes[1].values[i] == uniform.planes[1].values[i]);
                if (count < kMost) CHECK(error < kNoise * 1.0001);
            } else if (film.planes[0].indices[i] > count) {
                CHECK(error > kNoise * 0.9999);
            }
        }
    }

    // The error is what was asked for, or less: samples of a sequence err less than independent ones.
    RenderOptions many = path_options(256);
    many.seed = 1;
    const Film reference = renderer.render(camera, many);
    std::vector<double> squares(kBlocks), expected(kBlocks);
    for (std::size_t i = 0; i < film.pixels.size(); ++i) {
        if (film.planes[0].indices[i] == kMost) continue;
        const auto luminance = [](const vec3& rgb) { return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z; };
        squares[block_of(i)] += std::pow(luminance(film.pixels[i]) - luminance(reference.pixels[i]), 2.0) / 64.0;
        expected[block_of(i)] += luminance(reference.pixels[i]) / 64.0;
    }
    double largest = 0.0;
    for (std::size_t block = 0; block < 10; ++block)  // whole ones
        if (expected[block] > 0.0) largest = std::max(largest, std::sqrt(squares[block]) / expected[block]);
    CAPTURE(largest);
    CHECK(largest < 1.5 * kNoise);
    CHECK(largest > 0.2 * kNoise);

    const auto renders_the_same = [&](const auto& change) {
        RenderOptions other = options;
        change(other);
        CHECK(same_bytes(renderer.render(camera, other), film));
    };
    renders_the_same([](RenderOptions& o) { o.tile_size = 8; });
    renders_the_same([](RenderOptions& o) { o.order = RenderOrder::progressive; });
    RenderOptions shared = options;
    shared.tile_size = 8;
    shared.verify_share = 1.0;
    Renderer two(scene, {device, device});
    CHECK(same_bytes(two.render(camera, shared), film));
    CHECK(two.statistics().verification.pixels == film.pixels.size());
    CHECK(two.statistics().verification.differing_pixels == 0);
    const TemporaryDirectory folder;
    std::vector<std::filesystem::path> parts;
    for (const std::uint32_t number : {2u, 1u}) {
        RenderOptions of_part = options;
        of_part.part = PicturePart{number, 2};
        of_part.checkpoint_file = parts.emplace_back(folder.path() / std::to_string(number));
        renderer.render(camera, of_part);
        CHECK(renderer.statistics().part_complete);
    }
    const MergedPicture merged = merge_checkpoints(parts);
    CHECK(same_bytes(merged.film, film));
    CHECK(merged.samples_done == samples);
    CHECK(merged.samples() == samples);
    // Stopped when some blocks are done, and others not, and gone on with.
    for (const RenderOrder order : {RenderOrder::pieces, RenderOrder::progressive}) {
        RenderOptions begun = options;
        begun.tile_size = 8;
        begun.order = order;
        begun.checkpoint_file = folder.path() / to_string(order);
        const Film stopped = renderer.render(
            camera, begun, [&](const RenderProgress& progress) { return progress.samples_done < samples / 2; });
        REQUIRE_FALSE(stopped.complete());
        RenderOptions resumed = options;
        resumed.resume_file = begun.checkpoint_file;
        CHECK(same_bytes(renderer.render(camera, resumed), film));
        CHECK(renderer.statistics().samples_done == samples);
        resumed.noise = 0.2;
        std::string refusal;
        try {
            renderer.render(camera, resumed);
        } catch (const SceneError& error) {
            refusal = error.what();
        }
        CAPTURE(refusal);
        CHECK(refusal.find("stops at noise 0.24") != std::string::npos);
    }

    const auto refuses = [&](const auto& change) {
        RenderOptions refused = options;
        change(refused);
        CHECK_THROWS_AS(renderer.render(camera, refused), UsageError);
    };
    refuses([](RenderOptions& o) { o.noise = 0.0; });
    refuses([](RenderOptions& o) { o.noise = -0.01; });
    refuses([](RenderOptions& o) { o.noise = std::numeric_limits<double>::quiet_NaN(); });
    refuses([](RenderOptions& o) { o.noise = std::numeric_limits<double>::infinity(); });
    refuses([](RenderOptions& o) { o.samples_per_pixel = 16; });
    refuses([](RenderOptions& o) {
        o.integrator = Integrator::whitted;
        o.aovs = {"lights"};
    });
}

TEST_CASE("noise of pixels that share a sequence vanishes where a picture is smoothed", "[path][sample_order]") {
    Scene scene = balls_under(sunny_sky(40.0f, 4), EnvironmentSampling::picture);
    scene.cameras[0].width = scene.cameras[0].height = 32;
    const Camera& camera = scene.cameras[0];
    Renderer renderer(scene, {test_device()});
    // What is scattered once, from the floor's and the balls' own light: few dimensions.
    RenderOptions options = path_options(4);
    options.filter = ReconstructionFilter::box;
    options.bounces = 1;
    RenderOptions many = options;
    many.samples_per_pixel = 512;
    many.seed = 100;
    const Film reference = renderer.render(camera, many);
    // The square of the difference from the reference, by pixels, and after a mean over 4 x 4 of them.
    const auto add_errors = [&](const Film& film, double& of_pixels, double& smoothed) {
        for (std::uint32_t y = 0; y < 32; y += 4)
            for (std::uint32_t x = 0; x < 32; x += 4) {
                double mean = 0.0;
                for (std::uint32_t i = 0; i < 16; ++i) {
                    const std::size_t pixel = (y + i / 4) * 32 + x + i % 4;
                    const double difference = film.pixels[pixel].y - reference.pixels[pixel].y;
                    of_pixels += difference * difference;
                    mean += difference / 16.0;
                }
                smoothed += 16.0 * mean * mean;
            }
    };
    double own_pixels = 0.0, own_smoothed = 0.0, shared_pixels = 0.0, shared_smoothed = 0.0;
    for (options.seed = 0; options.seed < 4; ++options.seed) {
        options.sample_order = SampleOrder::pixel;
        add_errors(renderer.render(camera, options), own_pixels, own_smoothed);
        options.sample_order = SampleOrder::z;
        add_errors(renderer.render(camera, options), shared_pixels, shared_smoothed);
    }
    CAPTURE(own_pixels, own_smoothed, shared_pixels, shared_smoothed);
    CHECK(shared_pixels < 1.3 * own_pixels);
    CHECK(shared_smoothed < 0.5 * own_smoothed);

    // The same bytes however the work is cut, and other ones than without.
    options.samples_per_pixel = 6;
    const Film film = renderer.render(camera, options);
    RenderOptions tiled = options;
    tiled.tile_size = 8;
    tiled.order = RenderOrder::progressive;
    CHECK(same_bytes(renderer.render(camera, tiled), film));
    options.sample_order = SampleOrder::pixel;
    CHECK_FALSE(same_bytes(renderer.render(camera, options), film));
    for (const SampleOrder order : {SampleOrder::pixel, SampleOrder::z})
        CHECK(sample_order_from_string(to_string(order)) == order);
    CHECK_THROWS_AS(sample_order_from_string("hilbert"), UsageError);
}

TEST_CASE("groups of lights are a path-traced picture together", "[path][light_groups]") {
    Scene scene = room();
    scene.lights.push_back(point_light({0.2f, 0.5f, 0.5f}, vec3(0.3f)));
    scene.images[0].floats = {0.2f, 0.3f, 0.4f};  // seen where the back wall was
    scene.meshes.erase(scene.meshes.begin() + 4);
    scene.lights[1].object.object = 5;
    scene.cameras[0].width = 20;
    const Camera& camera = scene.cameras[0];
    Renderer renderer(scene, {test_device()});
    RenderOptions options = path_options(8);
    options.light_choice = LightChoice::uniform;  // whatever lights send
    const Film plain = renderer.render(camera, options);
    options.light_groups = {{"sky", {0}}, {"lamps", {1, 3}}, {"point", {4}}};  // and one of the balls is in none
    const std::vector<std::string> names{"group-sky", "group-lamps", "group-point", "group-rest"};
    CHECK(light_group_planes(options.light_groups) == names);
    const Film film = renderer.render(camera, options);
    CHECK(film.pixels == plain.pixels);
    REQUIRE(film.planes.size() == names.size());
    std::vector<double> sums(names.size());
    const auto differs = [&](const Film& of_groups) {
        std::size_t count = 0;
        for (std::size_t i = 0; i < 3 * of_groups.pixels.size(); ++i) {
            double sum = 0.0;
            for (std::size_t group = 0; group < names.size(); ++group)
                sum += double{of_groups.planes[of_groups.planes.size() - names.size() + group].values[i]};
            const double expected = of_groups.pixels[i / 3][static_cast<int>(i % 3)];
            count += std::abs(sum - expected) > 1e-5 * expected + 1e-9;
        }
        return count;
    };
    CHECK(differs(film) == 0);
    for (std::size_t group = 0; group < names.size(); ++group) {
        CHECK(film.planes[group].name == names[group]);
        for (const float value : film.planes[group].values) sums[group] += double{value};
        CHECK(sums[group] > 0.0);
    }

    // Groups are the picture where all other lights are black. Lights stay in their places, so that random choices are
    // the same, but for roulette, which looks at all light that a path has gathered.
    Camera steady = camera;
    steady.path_tracing.emplace().roulette_from.reset();
    const Film whole = renderer.render(steady, options);
    Scene dark = scene;
    dark.images[0].floats = {0, 0, 0};
    dark.lights[4].point.intensity = vec3(0.0f);
    RenderOptions of_lamps = options;
    of_lamps.light_groups.clear();
    const Film lamps = Renderer(dark, {test_device()}).render(steady, of_lamps);
    std::size_t different = 0;
    for (std::size_t i = 0; i < 3 * whole.pixels.size(); ++i) {
        const double sum = double{whole.planes[1].values[i]} + double{whole.planes[3].values[i]};
        const double expected = lamps.pixels[i / 3][static_cast<int>(i % 3)];
        different += std::abs(sum - expected) > 1e-5 * expected + 1e-9;  // the rest is the other ball
    }
    CHECK(different == 0);

    // Limited samples are limited alike; the same bytes however the work is cut.
    RenderOptions limited = options;
    limited.largest_sample = 0.5f;
    limited.light_choice = LightChoice::tree;
    limited.aovs = {"variance", "mean-albedo"};
    const Film dim = renderer.render(camera, limited);
    CHECK(differs(dim) == 0);
    CHECK_FALSE(dim.pixels == film.pixels);
    RenderOptions cut = limited;
    cut.tile_size = 8;
    cut.order = RenderOrder::progressive;
    CHECK(same_bytes(renderer.render(camera, cut), dim));
    const TemporaryDirectory folder;
    std::vector<std::filesystem::path> parts;
    for (const std::uint32_t number : {1u, 2u}) {
        RenderOptions of_part = limited;
        of_part.part = PicturePart{number, 2};
        of_part.checkpoint_file = parts.emplace_back(folder.path() / std::to_string(number));
        renderer.render(camera, of_part);
    }
    CHECK(same_bytes(merge_checkpoints(parts).film, dim));

    const auto refuses = [&](const auto& change) {
        RenderOptions refused = options;
        change(refused);
        CHECK_THROWS_AS(renderer.render(camera, refused), UsageError);
    };
    refuses([](RenderOptions& o) { o.light_groups[0].lights = {5}; });
    refuses([](RenderOptions& o) { o.light_groups[0].lights = {3}; });
    refuses([](RenderOptions& o) { o.light_groups[0].name = "lamps"; });
    refuses([](RenderOptions& o) { o.light_groups[0].name = "rest"; });
    refuses([](RenderOptions& o) { o.light_groups[0].name = "a b"; });
    refuses([](RenderOptions& o) { o.light_groups[0].name = std::string(101, 'a'); });
    refuses([](RenderOptions& o) { o.light_groups[0].name.clear(); });
    refuses([](RenderOptions& o) { o.aovs = {"group-sky"}; });
    refuses([](RenderOptions& o) { o.integrator = Integrator::whitted; });
}

TEST_CASE("eye rays of few paths are traced as the others are, without kernels of their own", "[path]") {
    const Scene scene = room();
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.integrator = Integrator::path;
    const auto eye_rays_of = [&](std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
        CAPTURE(width, height, samples);
        Camera camera = scene.cameras[0];
        camera.width = width;
        camera.height = height;
        options.samples_per_pixel = samples;
        renderer.render(camera, options, [](const RenderProgress&) { return false; });
        return renderer.statistics().eye_rays;
    };
    CHECK(eye_rays_of(16, 16, 1) == Coherence::incoherent);
    CHECK(eye_rays_of(2048, 2048, 1) == Coherence::coherent);
    CHECK(eye_rays_of(2048, 2047, 1) == Coherence::incoherent);
    CHECK(eye_rays_of(2047, 1024, 2) == Coherence::incoherent);
    CHECK(eye_rays_of(1024, 1024, 4) == Coherence::coherent);
}

TEST_CASE("eye rays of a small scene and picture are traced without kernels of their own", "[render]") {
    const auto eye_rays_of = [](const Scene& scene, std::uint32_t width, std::uint32_t height) {
        Renderer renderer(scene, {test_device()});
        Camera camera = scene.cameras[0];
        camera.width = width;
        camera.height = height;
        RenderOptions options;
        options.integrator = Integrator::whitted;
        renderer.render(camera, options, [](const RenderProgress&) { return false; });
        return renderer.statistics().eye_rays;
    };
    Scene scene = room();
    const Coherence of_few = has_registers_of_16() ? Coherence::incoherent : Coherence::coherent;
    CHECK(eye_rays_of(scene, 1024, 1024) == of_few);
    CHECK(eye_rays_of(scene, 1025, 1024) == Coherence::coherent);
    Scene larger = scene;
    larger.spheres.resize(2049, larger.spheres.front());
    CHECK(eye_rays_of(larger, 16, 16) == Coherence::coherent);
}

TEST_CASE("path-traced pictures have the same bytes however the work is cut", "[path]") {
    Scene scene = room();
    scene.lights.push_back(point_light({0.2f, 0.5f, 0.5f}, vec3(0.3f)));
    scene.cameras[0].width = 45;
    scene.cameras[0].path_tracing.emplace().bounces.reset();
    const Camera& camera = scene.cameras[0];
    const Device device = test_device();
    Renderer renderer(scene, {device});
    RenderOptions options;
    options.samples_per_pixel = 6;
    const Film plain = renderer.render(camera, options);
    options.aovs = {"material", "variance", "samples", "mean-albedo", "mean-normal", "mean-position"};
    const Film expected = renderer.render(camera, options);
    REQUIRE(all_finite(expected));
    CHECK(expected.pixels == plain.pixels);
    CHECK(expected.planes[2].indices == std::vector<std::uint32_t>(expected.pixels.size(), 6));
    const auto& materials = expected.planes[0].indices;
    CHECK(*std::max_element(materials.begin(), materials.end()) < scene.materials.size());
    for (const std::uint32_t tile_size : {8u, 24u, 4096u}) {
        CAPTURE(tile_size);
        RenderOptions tiled = options;
        tiled.tile_size = tile_size;
        CHECK(same_bytes(renderer.render(camera, tiled), expected));
    }
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        CHECK(same_bytes(Renderer(scene, {device}, {strategy}).render(camera, options), expected));
    }
    RenderOptions small_tiles = options;
    small_tiles.tile_size = 8;  // so that both have something to do
    CHECK(same_bytes(Renderer(scene, {device, device}).render(camera, small_tiles), expected));

    const TemporaryDirectory folder;
    BuiltScene(scene, {device}).save(folder.path() / "scene");
    const BuiltScene saved = load_built_scene(folder.path() / "scene");
    CHECK(same_bytes(Renderer(saved, {device}).render(saved.description().cameras[0], options), expected));

    std::vector<std::filesystem::path> parts;
    for (const std::uint32_t number : {2u, 1u}) {
        RenderOptions of_part = small_tiles;
        of_part.part = PicturePart{number, 2};
        of_part.checkpoint_file = parts.emplace_back(folder.path() / std::to_string(number));
        renderer.render(camera, of_part);
    }
    CHECK(same_bytes(merge_checkpoints(parts).film, expected));
    // Stopped between samples, and gone on with.
    RenderOptions begun = small_tiles;
    begun.order = RenderOrder::progressive;
    begun.checkpoint_file = folder.path() / "begun";
    std::uint64_t pixels = std::uint64_t{camera.width} * camera.height;
    const Film stopped = renderer.render(
        camera, begun, [&](const RenderProgress& progress) { return progress.samples_done < 3 * pixels; });
    REQUIRE_FALSE(stopped.complete());
    const auto& taken = stopped.planes[2].indices;
    CHECK(*std::max_element(taken.begin(), taken.end()) < 6);
    CHECK(*std::max_element(taken.begin(), taken.end()) > 0);
    RenderOptions gone_on = options;
    gone_on.resume_file = begun.checkpoint_file;
    CHECK(same_bytes(renderer.render(camera, gone_on), expected));
    RenderOptions resumed = options;
    resumed.resume_file = parts.front();
    CHECK(same_bytes(renderer.render(camera, resumed), expected));
    resumed.bounces = 7;
    CHECK_THROWS_AS(renderer.render(camera, resumed), SceneError);
    options.integrator = Integrator::whitted;
    CHECK_FALSE(same_bytes(renderer.render(camera, options), expected));
}

}  // namespace castor::test
