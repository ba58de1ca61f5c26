// Brute force over more primitives than one launch tests: in passes, with the hits of the other strategies.
#include <algorithm>
#include <cstring>
#include <vector>

#include "castor/tracer.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/chunked_tracer.h"
#include "support/kernel_fixture.h"
#include "support/picture.h"

namespace castor::test {
namespace {

/// 170,000 triangles and spheres. Of the 60,000 that are there twice, passes later, the first are the ones that are
/// hit.
Scene many_primitives() {
    RandomSource random(41);
    Scene scene;
    const std::uint32_t plain = add_material(scene, diffuse_material({0.5f, 0.5f, 0.5f}));
    const Mesh mesh = random_triangles(random, 60000, 0.02f);
    scene.meshes = {mesh, random_triangles(random, 20000, 0.02f), mesh};
    for (int i = 0; i < 30000; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.001f, 0.01f), plain, 0});
    scene.planes = {{{0, -0.2f, 0}, {0, 1, 0}, plain, 0}, {{0.3f, 0, 0}, {1, 0, 0}, plain, 0}};
    return scene;
}

/// A mesh of 30,000 six times: twice in the same place, and once so that it cannot be hit.
Scene many_instances() {
    RandomSource random(42);
    Scene scene;
    add_material(scene, diffuse_material({0.5f, 0.5f, 0.5f}));
    scene.meshes = {random_triangles(random, 30000, 0.03f)};
    for (const float x : {0.5f, 0.5f, -0.5f, 0.0f, 50.0f}) {
        Transform transform(1.0f);
        transform[3].x = x;
        scene.instances.push_back({0, transform, 0});
    }
    return scene;
}

std::vector<Ray> rays_within() {
    RandomSource random(43);
    std::vector<Ray> rays;
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 origin = random.in_box(-1.5f, 1.5f);
        rays.push_back(make_ray(origin, random.in_box(-1, 1) - origin, 0.0f, i % 3 ? 100.0f : 0.1f));
    }
    return rays;
}

}  // namespace

TEST_CASE("brute force in passes finds what the trees find", "[brute]") {
    const bool has_instances = GENERATE(false, true);
    CAPTURE(has_instances);
    const Scene scene = has_instances ? many_instances() : many_primitives();
    const std::vector<Ray> rays = rays_within();
    std::vector<Hit> expected(rays.size()), hits(rays.size());
    std::vector<std::uint8_t> expected_occluded(rays.size()), occluded(rays.size());
    Tracer simt(scene, {test_device()}, {.strategy = Strategy::simt});
    simt.closest_hit(rays, expected);
    simt.any_hit(rays, expected_occluded);
    CHECK(std::count(expected_occluded.begin(), expected_occluded.end(), 1) > 80);
    CHECK(std::count(expected_occluded.begin(), expected_occluded.end(), 0) > 8);
    Tracer brute(scene, {test_device()}, {.strategy = Strategy::brute});
    brute.closest_hit(rays, hits);
    brute.any_hit(rays, occluded);
    CHECK(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(Hit)) == 0);
    CHECK(occluded == expected_occluded);
    for (const bool streams : {false, true}) {
        CAPTURE(streams);
        ChunkedTracer chunked(scene, Strategy::brute, TreeQuality::medium, {2, streams});
        CHECK(chunked.chunk_count() > 1);
        chunked.trace(rays, hits, occluded);
        CHECK(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(Hit)) == 0);
        CHECK(occluded == expected_occluded);
    }
}

}  // namespace castor::test
