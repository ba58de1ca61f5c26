// Objects that move while the shutter is open: means over time beside their integrals, and the same bytes with every
// strategy.
#include <glm/vec3.hpp>
#include <limits>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "castor/tracer.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/estimate.h"
#include "support/picture.h"

namespace castor::test {

namespace {

using glm::vec3;

constexpr float kNarrow = 1e-4f;  // half of a window of pixels that see the same

Material emitting_material(const vec3& emission) {
    Material material;
    material.emission = emission;
    return material;
}

Estimate seen(const Scene& scene, const vec3& eye, const vec3& gaze) {
    RenderOptions options;
    options.samples_per_pixel = 64;
    return estimate_of(Renderer(scene, {test_device()}).render(square_camera(eye, gaze, kNarrow, 16), options));
}

/// The busy scene in which meshes, one of them smooth, instances and spheres, one of them an ellipsoid, move.
Scene moving_scene() {
    RandomSource random(91);
    Scene scene = busy_scene();
    for (std::size_t i = 1; i < scene.meshes.size(); ++i) scene.meshes[i].motion = random.in_box(-0.5f, 0.5f);
    for (MeshInstance& instance : scene.instances) instance.motion = random.in_box(-1, 1);
    for (std::size_t i = 0; i < scene.spheres.size(); i += 2) scene.spheres[i].motion = random.in_box(-0.4f, 0.4f);
    return scene;
}

}  // namespace

TEST_CASE("a pixel sees what moves for as long as that is there", "[motion]") {
    // The square [0, 1]^2 moves to the right by 1: x = 0.25 sees it until t = 0.25, and x = 1.5 from t = 0.5 on.
    Scene scene;
    scene.materials = {emitting_material(vec3(8))};
    scene.meshes = {rectangle({0.5f, 0.5f, -2}, {0.5f, 0, 0}, {0, 0.5f, 0}, 0)};
    SECTION("a mesh") {
        scene.meshes[0].motion = {1, 0, 0};
    }
    SECTION("an instance of a mesh, larger and elsewhere") {
        scene.instances = {{0, Transform(2.0f), 0, 0, {1, 0, 0}}};
        scene.instances[0].transform[3] = {-1, 0, -5};
        scene.meshes[0].transform[3] = {0, 100, 0};
        check_mean(seen(scene, {-0.75f, 0.5f, 0}, {0, 0, -1}), 8 * 0.25);
        scene.instances[0].transform = Transform(1.0f);
    }
    check_mean(seen(scene, {0.25f, 0.5f, 0}, {0, 0, -1}), 8 * 0.25);
    check_mean(seen(scene, {1.5f, 0.5f, 0}, {0, 0, -1}), 8 * 0.5);
}

TEST_CASE("surfaces that move are lit where they are", "[motion]") {
    // What is seen rises from y = 0 to 1 below a light at y = 3: the mean of I / (3 - t)^2 is I / 6.
    Scene scene;
    scene.materials = {diffuse_material(vec3(1))};
    scene.lights = {point_light({0, 3, 0}, vec3(60, 0, 0))};
    SECTION("a mesh") {
        scene.meshes = {rectangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0)};
        scene.meshes[0].motion = {0, 1, 0};
    }
    SECTION("a sphere") {
        scene.spheres = {{{0, -2, 0}, 2.0f, 0, 0}};
        scene.spheres[0].motion = {0, 1, 0};
    }
    SECTION("an ellipsoid") {
        scene.spheres = {{{0, -2, 0}, 2.0f, 0, 0}};
        scene.spheres[0].transform[0] *= 2.0f;
        scene.spheres[0].motion = {0, 1, 0};
    }
    check_mean(seen(scene, {0, 2, 0}, {0, -1, 0}), 10.0);
}

TEST_CASE("shadow and mirror rays see the scene at the time of their eye rays", "[motion]") {
    // Each thing is there for t < 0.5 or for t > 0.5, and what is asked for needs both.
    Scene scene;
    const std::uint32_t white = add_material(scene, diffuse_material(vec3(1)));
    const std::uint32_t mirror = add_material(scene, mirror_material(vec3(1)));
    const std::uint32_t lamp = add_material(scene, emitting_material(vec3(9)));
    const auto square = [](const vec3& middle, std::uint32_t material, const vec3& motion) {
        Mesh mesh = rectangle(middle, {0, 0, 0.5f}, {0.5f, 0, 0}, material);
        mesh.motion = motion;
        return mesh;
    };
    const vec3 leaving(1, 0, 0);
    SECTION("a shadow") {
        scene.lights = {point_light({0, 4, 0}, vec3(160))};
        scene.meshes = {square({0, 0, 0}, white, leaving), square({-0.1f, 3, 0}, white, leaving)};
        CHECK(seen(scene, {0, 1, 0}, {0, -1, 0}).mean == 0.0);
        scene.meshes[1] = square({-1, 3, 0}, white, leaving);
        check_mean(seen(scene, {0, 1, 0}, {0, -1, 0}), 5.0);
    }
    SECTION("a mirror") {
        scene.meshes = {square({0, 0, 0}, mirror, leaving), square({-1.1f, 3, 0}, lamp, leaving)};
        CHECK(seen(scene, {0, 1, 0}, {0, -1, 0}).mean == 0.0);
        scene.meshes[1] = square({0, 3, 0}, lamp, leaving);
        check_mean(seen(scene, {0, 1, 0}, {0, -1, 0}), 4.5);
    }
}

TEST_CASE("what moves has the same bytes with all strategies, tiles and devices", "[motion]") {
    const Scene scene = moving_scene();
    const Camera& camera = scene.cameras[0];
    RenderOptions options;
    options.samples_per_pixel = 9;
    options.aovs = {"depth", "instance", "normal"};
    Renderer brute(scene, {test_device()}, {.strategy = Strategy::brute});
    const Film expected = brute.render(camera, options);
    REQUIRE(all_finite(expected));
    for (const Strategy strategy : {Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        Renderer renderer(scene, {test_device()}, {.strategy = strategy});
        CHECK(same_bytes(renderer.render(camera, options), expected));
    }
    options.tile_size = 8;
    Renderer two(scene, {test_device(), test_device()});
    CHECK(same_bytes(two.render(camera, options), expected));
    // One sample side by side with others, or alone.
    RenderOptions alone = options;
    alone.samples_per_pixel = 1;
    CHECK_FALSE(same_bytes(brute.render(camera, alone).pixels, expected.pixels));
    // Planes, and rays without a time, see what is there when the shutter opens.
    Scene still = scene;
    for (Mesh& mesh : still.meshes) mesh.motion = vec3(0);
    for (MeshInstance& instance : still.instances) instance.motion = vec3(0);
    const Film at_rest = Renderer(still, {test_device()}).render(camera, options);
    CHECK_FALSE(same_bytes(at_rest.pixels, expected.pixels));
}

TEST_CASE("rays of a tracer see what moves where it is at time 0", "[motion]") {
    Scene scene = scene_of({rectangle({0, 0, -2}, {1, 0, 0}, {0, 1, 0}, 0)});
    scene.meshes[0].motion = {5, 0, 0};
    const std::vector<Ray> rays{make_ray({0, 0, 0}, {0, 0, -1}), make_ray({3, 0, 0}, {0, 0, -1})};
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        std::vector<Hit> hits(rays.size());
        Tracer(scene, {test_device()}, {.strategy = strategy}).closest_hit(rays, hits);
        CHECK(hits[0].t == 2.0f);
        CHECK(hits[1].primitive == CASTOR_INVALID_INDEX);
    }
}

TEST_CASE("motion that leads nowhere a scene may be is refused", "[motion][errors]") {
    Scene scene = scene_of({rectangle({0, 0, -2}, {1, 0, 0}, {0, 1, 0}, 0)});
    scene.meshes[0].line = 7;
    for (const float far : {2e12f, std::numeric_limits<float>::quiet_NaN()}) {
        scene.meshes[0].motion = {0, far, 0};
        try {
            Renderer renderer(scene, {test_device()});
            FAIL("accepted");
        } catch (const SceneError& error) {
            CHECK(error.line() == 7);
            CHECK(std::string(error.what()).find("motion") != std::string::npos);
        }
    }
}

}  // namespace castor::test
