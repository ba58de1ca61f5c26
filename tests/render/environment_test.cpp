// Light from all directions: where it is seen, and what it gives to surfaces.
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "castor/built_scene.h"
#include "castor/renderer.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "support/estimate.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

using glm::dvec2;
using glm::dvec3;
using glm::vec3;

constexpr double kPi = std::numbers::pi;

/// A picture whose texel (x, y) has the value x + 100 y.
Image numbered_image(std::uint32_t width, std::uint32_t height) {
    Image image{"", width, height, {}, {}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            for (int channel = 0; channel < 3; ++channel)
                image.floats.push_back(static_cast<float>(x + 100 * y + channel * 10000));
    return image;
}

Light environment(EnvironmentMapping mapping, EnvironmentSampling sampling = EnvironmentSampling::uniform) {
    Light light;
    light.kind = Light::Kind::environment;
    light.environment = {0, mapping, sampling};
    return light;
}

/// (u, v) as EnvironmentMapping says it, in double precision.
dvec2 place_of(EnvironmentMapping mapping, const dvec3& d) {
    if (mapping == EnvironmentMapping::latlong)
        return {(1.0 + std::atan2(d.x, -d.z) / kPi) / 2.0, std::acos(d.y) / kPi};
    const double r = std::acos(-d.z) / (kPi * std::hypot(d.x, d.y));
    return {(1.0 + r * d.x) / 2.0, (1.0 - r * d.y) / 2.0};
}

/// A white floor, the plane y = 0.
Scene white_floor() {
    Scene scene;
    scene.planes.push_back({{0, 0, 0}, {0, 1, 0}, add_material(scene, diffuse_material(vec3(1))), 0});
    return scene;
}

Estimate seen_below(const Scene& scene) {
    RenderOptions options;
    options.samples_per_pixel = 256;
    Renderer renderer(scene, {test_device()});
    return estimate_of(renderer.render(square_camera({0, 0.01f, 0}, {0, -1, 0}, 1e-4f, 16), options));
}

}  // namespace

TEST_CASE("an environment is seen where its mapping says, in mirrors too", "[environment]") {
    const auto mapping = GENERATE(EnvironmentMapping::latlong, EnvironmentMapping::probe);
    RandomSource random(31);
    Scene scene;
    scene.background = vec3(7);
    scene.images = {numbered_image(40, 20)};
    scene.lights = {environment(mapping)};
    Probe probe(scene);
    // A mirror far below, in which the direction's y changes its sign.
    scene.planes.push_back({{0, -1000, 0}, {0, 1, 0}, add_material(scene, mirror_material(vec3(1))), 0});
    Probe mirrored(scene);
    std::size_t checked = 0;
    for (int i = 0; i < 200; ++i) {
        const dvec3 d = glm::normalize(dvec3(random.direction()));
        const dvec2 at = place_of(mapping, d) * dvec2(40, 20);
        // Texel (x, y) has the value x + 100 y in its middle; beyond those of the outermost ones other things count.
        if (at.x < 0.5 || at.x > 39.5 || at.y < 0.5 || at.y > 19.5) continue;
        const double expected = at.x - 0.5 + 100 * (at.y - 0.5);
        CAPTURE(d.x, d.y, d.z, expected);
        const vec3 found = probe({}, vec3(d));
        for (int channel = 0; channel < 3; ++channel)
            CHECK(std::abs(double(found[channel]) - expected - channel * 10000) <= 0.02);
        if (d.y > 0.05) CHECK(std::abs(double(mirrored({}, vec3(d.x, -d.y, d.z)).x) - expected) <= 0.02);
        ++checked;
    }
    CHECK(checked > 120);
    // On the axis of a probe, and at the poles.
    for (const vec3& axis : {vec3(0, 0, -1), vec3(0, 0, 1), vec3(0, 1, 0), vec3(0, -1, 0)})
        CHECK(probe({}, axis).x <= 1939.0f);
}

TEST_CASE("an environment gives a surface what its hemisphere sends", "[environment]") {
    const auto sampling =
        GENERATE(EnvironmentSampling::uniform, EnvironmentSampling::cosine, EnvironmentSampling::picture);
    Scene scene = white_floor();
    scene.lights = {environment(EnvironmentMapping::latlong, sampling)};
    // Twice 50 everywhere: pi L. What is below the horizon does not count.
    constexpr int kBytes = 3 * 4 * 256;  // of many rows, since it is interpolated between them
    scene.images = {{"", 4, 256, std::vector<std::uint8_t>(kBytes, 50), {}}};
    check_mean(seen_below(scene), 50 * kPi);
    std::fill(scene.images[0].bytes.begin() + kBytes / 2, scene.images[0].bytes.end(), std::uint8_t{200});
    check_mean(seen_below(scene), 50 * kPi);
    // Only the upper quarter of the angle: a cap of half angle pi / 4 gives pi L sin^2.
    std::fill(scene.images[0].bytes.begin() + kBytes / 4, scene.images[0].bytes.end(), std::uint8_t{0});
    check_mean(seen_below(scene), 50 * kPi * 0.5);
    // A wall hides half of the sky.
    scene.images[0].bytes.assign(kBytes, 50);
    scene.meshes = {rectangle({0.001f, 0, 0}, {0, 1e4f, 0}, {0, 0, 1e4f}, add_material(scene, Material{}))};
    check_mean(seen_below(scene), 50 * kPi * 0.5);
}

TEST_CASE("an environment has the same bytes with all strategies and from a saved scene", "[environment]") {
    Scene scene = white_floor();
    scene.images = {numbered_image(16, 8)};
    for (float& value : scene.images[0].floats) value = std::fmod(value, 100.0f);
    scene.spheres = {{{0, 1, -4}, 1.0f, add_material(scene, mirror_material(vec3(0.8f))), 0}};
    scene.lights = {environment(EnvironmentMapping::probe, EnvironmentSampling::cosine)};
    const Camera camera = square_camera({0, 1, 0}, {0, -0.1f, -1}, 0.6f, 24);
    RenderOptions options;
    options.samples_per_pixel = 5;
    const Device device = test_device();
    const Film expected = Renderer(scene, {device}).render(camera, options);
    REQUIRE(all_finite(expected));
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        CHECK(same_bytes(Renderer(scene, {device}, {strategy}).render(camera, options), expected));
    }
    const TemporaryDirectory folder;
    BuiltScene(scene, {device}).save(folder.path() / "scene");
    const BuiltScene saved = load_built_scene(folder.path() / "scene");
    CHECK(same_bytes(Renderer(saved, {device}).render(camera, options), expected));
}

}  // namespace castor::test
