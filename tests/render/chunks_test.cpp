// Pictures and hits of scenes that are cut into chunks, or stream, are those of the whole scenes.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "castor/tracer.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/chunked_tracer.h"
#include "support/picture.h"
#include "support/temporary_directory.h"
#include "trace/scene_contents.h"

namespace castor::test {
namespace {

using glm::vec3;

constexpr Strategy kStrategies[] = {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet};

RenderOptions with_all_planes() {
    RenderOptions options;
    options.samples_per_pixel = 2;
    options.aovs = eye_planes();
    std::erase(options.aovs, "variance");  // for which a block needs more memory than the smallest devices here have
    options.tile_size = 16;
    return options;
}

/// The device under test, as if no buffer might be larger.
Device with_small_buffers(std::uint64_t bytes) {
    Device device = test_device();
    device.max_allocation_bytes = bytes;
    return device;
}

}  // namespace

TEST_CASE("a picture and its planes do not tell into how many chunks the scene is cut", "[chunks]") {
    const Scene scene = busy_scene();
    Renderer whole(scene, {test_device()});
    const Film expected = whole.render(scene.cameras[0], with_all_planes());
    REQUIRE(all_finite(expected));
    for (const Strategy strategy : kStrategies)
        for (const Device& device :
             {with_small_buffers(6 << 10), with_small_buffers(20 << 10), with_little_memory(150 << 10)}) {
            CAPTURE(to_string(strategy), device.max_allocation_bytes, device.global_memory_bytes);
            Renderer renderer(scene, {device}, {.strategy = strategy});
            CHECK(same_bytes(renderer.render(scene.cameras[0], with_all_planes()), expected));
            CHECK(renderer.statistics().triangles == whole.statistics().triangles);
            CHECK(renderer.statistics().spheres == whole.statistics().spheres);
        }
    Renderer both(scene, {with_little_memory(150 << 10), with_small_buffers(20 << 10)}, {.quality = TreeQuality::high});
    CHECK(same_bytes(both.render(scene.cameras[0], with_all_planes()), expected));
}

TEST_CASE("instances are hit alike in any number of chunks", "[chunks]") {
    const Scene scene = busy_scene();
    const std::vector<Ray> rays = some_rays();
    std::vector<Hit> expected(rays.size()), hits;
    std::vector<std::uint8_t> expected_occluded(rays.size()), occluded;
    Tracer brute(scene, {test_device()}, {Strategy::brute});
    brute.closest_hit(rays, expected);
    brute.any_hit(rays, expected_occluded);
    std::size_t of_instances = 0;
    for (const Hit& hit : expected) of_instances += hit.instance != 0 && hit.instance != CASTOR_INVALID_INDEX;
    CHECK(of_instances > 100);
    for (const Strategy strategy : kStrategies)
        for (const Cut& cut : {Cut{2, false}, Cut{9, true}, Cut{40, false}}) {
            CAPTURE(to_string(strategy), cut.chunks, cut.streams);
            ChunkedTracer tracer(scene, strategy, cut.chunks == 9 ? TreeQuality::high : TreeQuality::medium, cut);
            CHECK(tracer.chunk_count() >= cut.chunks);
            CHECK((tracer.streaming_count() > 0) == cut.streams);
            for (int turn = 0; turn < 2; ++turn) {  // in another order
                tracer.trace(rays, hits, occluded);
                CHECK(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(Hit)) == 0);
                CHECK(occluded == expected_occluded);
            }
        }
}

TEST_CASE("hits with the same t in several chunks are those of the smallest number", "[chunks]") {
    // The same cube many times at one place, its triangles in other orders, and spheres and planes that touch it.
    RandomSource random(3);
    Scene scene = scene_of({});
    for (int i = 0; i < 30; ++i) {
        Mesh mesh = cube_grid(2);
        for (std::size_t k = mesh.triangles.size() - 1; k > 0; --k)
            std::swap(mesh.triangles[k], mesh.triangles[random.below(static_cast<std::uint32_t>(k + 1))]);
        scene.meshes.push_back(mesh);
    }
    for (int i = 0; i < 5; ++i) scene.instances.push_back({static_cast<std::uint32_t>(i), Transform(1.0f), 0});
    scene.spheres.assign(10, {vec3(0, 0, 2), 1.0f, 0, 0});
    scene.planes = {{{0, 0, 1}, {0, 0, 1}, 0, 0}, {{0, 1, 0}, {0, 1, 0}, 0, 0}};
    std::vector<Ray> rays;
    for (int i = 0; i < 1000; ++i) {
        vec3 direction(0);
        direction[i % 3] = i % 2 ? 1.0f : -1.0f;
        vec3 origin = -3.0f * direction;
        for (int axis = 0; axis < 3; ++axis)
            if (axis != i % 3) origin[axis] = static_cast<float>(random.below(9)) * 0.25f - 1.0f;
        rays.push_back(make_ray(origin, direction));
    }
    std::vector<Hit> expected(rays.size()), hits;
    std::vector<std::uint8_t> occluded;
    Tracer(scene, {test_device()}, {Strategy::brute}).closest_hit(rays, expected);
    for (const Strategy strategy : kStrategies)
        for (const Cut& cut : {Cut{3, false}, Cut{20, true}, Cut{70, false}}) {
            CAPTURE(to_string(strategy), cut.chunks, cut.streams);
            ChunkedTracer tracer(scene, strategy, TreeQuality::medium, cut);
            for (int turn = 0; turn < 3; ++turn) {
                tracer.trace(rays, hits, occluded);
                CHECK(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(Hit)) == 0);
            }
        }
}

TEST_CASE("chunks have their turns in the order of their distances", "[chunks]") {
    Scene scene = scene_of({});
    for (int i = 0; i < 8; ++i) scene.meshes.push_back(moved(bumpy_sphere(2), 0.4f, {static_cast<float>(i), 0, 0}));
    const SceneContents prepared =
        build_scene(scene, {StrategyChoice::all(Strategy::wide)}, TreeQuality::medium, {20'000});
    REQUIRE(prepared.chunks.size() > 5);
    DeviceContext context(test_device());
    const DeviceScene device_scene(context, prepared);
    CHECK(device_scene.streaming_count() == 0);
    for (const float x : {-5.0f, 3.3f, 20.0f}) {
        const std::vector<std::size_t> order = device_scene.order_from(vec3(x, 0, 0));
        REQUIRE(order.size() == prepared.chunks.size());
        const auto distance = [&](std::size_t chunk) {
            const Box& box = prepared.chunks[order[chunk]].bounds;
            return std::max({0.0f, box.lower[0] - x, x - box.upper[0]});
        };
        for (std::size_t i = 1; i < order.size(); ++i) CHECK(distance(i - 1) <= distance(i));
    }
    CHECK(device_scene.order_from(vec3(-5, 0, 0)) != device_scene.order_from(vec3(20, 0, 0)));
    const float nan = std::nanf("");
    CHECK(device_scene.order_from(vec3(nan, nan, nan)).size() == prepared.chunks.size());
}

TEST_CASE("a built scene that is too large for a device is cut for it, and stays as it was for others",
          "[chunks][saved]") {
    const TemporaryDirectory directory;
    const Scene scene = busy_scene();
    const Device large = test_device(), small = with_small_buffers(20 << 10), little = with_little_memory(150 << 10);
    const BuiltScene built(scene, {large});
    Renderer first(built, {large});
    const Film expected = first.render(scene.cameras[0], with_all_planes());
    const std::size_t warnings = first.warnings().size();

    const auto check = [&](const BuiltScene& from, const Device& device, bool is_cut) {
        CAPTURE(device.max_allocation_bytes, device.global_memory_bytes);
        Renderer renderer(from, {device});
        CHECK(same_bytes(renderer.render(scene.cameras[0], with_all_planes()), expected));
        REQUIRE(renderer.warnings().size() == warnings + is_cut);
        if (is_cut)
            CHECK(renderer.warnings().back().text.find("what is too large is cut and built anew") != std::string::npos);
    };
    check(built, small, true);
    check(built, little, true);
    CHECK(same_bytes(first.render(scene.cameras[0], with_all_planes()), expected));

    const auto saved = [&](const BuiltScene& from) {
        from.save(directory.path() / "s.castor");
        return load_built_scene(directory.path() / "s.castor");
    };
    const BuiltScene saved_whole = saved(built), saved_small = saved(BuiltScene(scene, {small}));
    CHECK(contents_of(saved_whole).chunks.size() == 1);
    CHECK(contents_of(saved_small).chunks.size() > 1);
    check(saved_whole, large, false);
    check(saved_whole, small, true);
    check(saved_whole, little, true);
    check(saved_small, large, false);
    check(saved_small, small, false);
    check(saved_small, with_small_buffers(8 << 10), true);
}

}  // namespace castor::test
