// No ray slips between triangles that share an edge or a vertex.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <vector>

#include "castor/tracer.h"
#include "reference/nasty_scenes.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/tested_strategies.h"

namespace castor::test {
namespace {

using glm::vec3;

struct Edge {
    vec3 a, b;
    std::vector<vec3> normals;  // of all triangles that have an end of it
};

std::vector<Edge> edges_of(const Mesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
    std::vector<std::vector<vec3>> normals(mesh.positions.size());
    for (const glm::uvec3& t : mesh.triangles) {
        const glm::dvec3 p0(mesh.positions[t.x]), p1(mesh.positions[t.y]), p2(mesh.positions[t.z]);
        const vec3 normal(glm::normalize(glm::cross(p1 - p0, p2 - p0)));
        for (int k = 0; k < 3; ++k) {
            ++uses[std::minmax(t[k], t[(k + 1) % 3])];
            normals[t[k]].push_back(normal);
        }
    }
    std::vector<Edge> edges;
    for (const auto& [ends, count] : uses) {
        REQUIRE(count == 2);  // closed
        edges.push_back({mesh.positions[ends.first], mesh.positions[ends.second], normals[ends.first]});
        edges.back().normals.insert(edges.back().normals.end(), normals[ends.second].begin(),
                                    normals[ends.second].end());
    }
    return edges;
}

/// A vertex, the middle of an edge, or any point of it.
vec3 point_on(const Edge& edge, RandomSource& random) {
    switch (random.below(4)) {
        case 0:
            return edge.a;
        case 1:
            return edge.a + 0.5f * (edge.b - edge.a);
        default:
            return edge.a + random.uniform_float(0, 1) * (edge.b - edge.a);
    }
}

struct Shape {
    const char* name;
    Mesh mesh;
};

std::vector<Shape> shapes() {
    return {{"cube", cube_grid(16)}, {"bumpy sphere", bumpy_sphere(5)}, {"icosphere", icosphere(3)}};
}

/// By a tree of eight children, after making sure that the binary one gives the same bits.
std::vector<Hit> trace(const Mesh& mesh, const std::vector<Ray>& rays) {
    std::vector<Hit> hits(rays.size()), others(rays.size());
    const Strategy strategy = can_be_tested(Strategy::packet) ? Strategy::packet : Strategy::wide;
    Tracer(scene_of({mesh}), {test_device()}, {strategy}).closest_hit(rays, hits);
    Tracer(scene_of({mesh}), {test_device()}, {Strategy::simt}).closest_hit(rays, others);
    REQUIRE(std::memcmp(hits.data(), others.data(), hits.size() * sizeof(Hit)) == 0);
    return hits;
}

std::vector<Ray> rays_from_inside(const Mesh& mesh, vec3 center, float reach, std::uint64_t seed, std::size_t count) {
    RandomSource random(seed);
    const std::vector<Edge> edges = edges_of(mesh);
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const vec3 origin = center + random.in_box(-reach, reach);
        const vec3 target = point_on(edges[random.below(static_cast<std::uint32_t>(edges.size()))], random);
        // Along axes and in axis planes as well, where several tests have zeros to deal with.
        vec3 direction = target - origin;
        if (random.below(8) == 0) direction[static_cast<int>(random.below(3))] = 0.0f;
        if (direction == vec3(0.0f)) continue;
        rays.push_back(make_ray(origin, direction));
    }
    return rays;
}

void check_none_escapes(const Mesh& mesh, const std::vector<Ray>& rays) {
    const std::vector<Hit> hits = trace(mesh, rays);
    std::size_t escaped = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].primitive != CASTOR_INVALID_INDEX) continue;
        if (++escaped > 3) continue;
        CAPTURE(i, to_text(rays[i]));
        CHECK(hits[i].primitive != CASTOR_INVALID_INDEX);
    }
    CHECK(escaped == 0);
}

/// Rays from `distance` away towards points of edges around which all triangles face the origin, so that they lie
/// strictly inside the silhouette: a hit must come before the ray is well inside the shape.
void check_none_passes(const Mesh& mesh, float distance, std::uint64_t seed, std::size_t count) {
    RandomSource random(seed);
    const std::vector<Edge> edges = edges_of(mesh);
    std::vector<Ray> rays;
    std::vector<float> t_limits;
    while (rays.size() < count) {
        const Edge& edge = edges[random.below(static_cast<std::uint32_t>(edges.size()))];
        const vec3 away = random.direction();
        constexpr float kFacing = 0.25f;
        if (std::any_of(edge.normals.begin(), edge.normals.end(),
                        [&](vec3 normal) { return glm::dot(away, normal) < kFacing; }))
            continue;
        const vec3 target = point_on(edge, random);
        const vec3 origin = target + away * distance;
        rays.push_back(make_ray(origin, target - origin));
        t_limits.push_back(1.0f + 0.05f / distance + 4 * 0x1p-23f);
    }
    const std::vector<Hit> hits = trace(mesh, rays);
    std::size_t passed = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].t <= t_limits[i]) continue;
        if (++passed > 3) continue;
        CAPTURE(i, to_text(rays[i]), hits[i].t, t_limits[i]);
        CHECK(hits[i].t <= t_limits[i]);
    }
    CHECK(passed == 0);
}

}  // namespace

TEST_CASE("the side of an edge on which a ray passes is exact", "[watertight]") {
    RandomSource random(56);
    constexpr std::uint32_t kCount = 3000;
    const NearEdges input = near_edges(random, kCount);
    CHECK(input.undecided > kCount / 10);
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < kCount; ++i) rays.push_back(make_ray({0, 0, static_cast<float>(i)}, {0, 0, 1}, 0, 1));
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        if (!can_be_tested(strategy)) continue;
        std::vector<Hit> hits(rays.size());
        Tracer(scene_of({input.mesh}), {test_device()}, {strategy}).closest_hit(rays, hits);
        for (std::uint32_t i = 0; i < kCount; ++i) {
            const vec3* p = &input.mesh.positions[3 * i];
            CAPTURE(to_string(strategy), i, to_text(p[0]), to_text(p[1]), to_text(p[2]));
            REQUIRE(hits[i].primitive == (input.inside[i] ? i : CASTOR_INVALID_INDEX));
        }
    }
}

TEST_CASE("no ray escapes from inside a closed mesh", "[watertight]") {
    for (const Shape& shape : shapes())
        for (std::uint64_t seed : {51, 52, 53}) {
            CAPTURE(shape.name, seed);
            check_none_escapes(shape.mesh, rays_from_inside(shape.mesh, vec3(0), 0.45f, seed, test_size(200'000)));
        }
}

TEST_CASE("no ray escapes from a closed mesh far from the origin, or tiny, or huge", "[watertight]") {
    struct Place {
        float scale;
        vec3 offset;
    };
    for (const Place& place :
         {Place{1, {1e3f, -2e3f, 3e3f}}, Place{1, {-65536, 131072, 65536}}, Place{1e-6f, {0, 0, 0}},
          Place{1e-3f, {5, 7, -3}}, Place{1e9f, {0, 0, 0}}, Place{1e-9f, {0, 0, 0}}}) {
        CAPTURE(place.scale, to_text(place.offset));
        const Mesh mesh = moved(cube_grid(16), place.scale, place.offset);
        check_none_escapes(mesh, rays_from_inside(mesh, place.offset, 0.45f * place.scale, 54, test_size(100'000)));
    }
}

TEST_CASE("no ray passes through an edge of a closed mesh from outside", "[watertight]") {
    for (const Shape& shape : shapes())
        for (float distance : {0.01f, 3.0f, 1e3f, 1e5f}) {
            CAPTURE(shape.name, distance);
            check_none_passes(shape.mesh, distance, 55, test_size(120'000));
        }
}

}  // namespace castor::test
