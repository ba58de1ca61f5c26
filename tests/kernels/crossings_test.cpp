// Counts and lists of crossings: all strategies equal brute force, brute force equals exact arithmetic, and closed
// meshes are crossed evenly from outside and oddly from inside.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <glm/geometric.hpp>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "castor/tracer.h"
#include "reference/nasty_scenes.h"
#include "support/catch.h"
#include "support/chunked_tracer.h"
#include "support/kernel_fixture.h"
#include "support/tested_strategies.h"

namespace castor::test {
namespace {

using glm::vec3;

struct Listed {
    std::vector<Hit> crossings;
    std::vector<std::uint32_t> counts;
};

Listed list(Tracer& tracer, const std::vector<Ray>& rays, std::size_t limit) {
    Listed listed{std::vector<Hit>(rays.size() * limit), std::vector<std::uint32_t>(rays.size())};
    REQUIRE(tracer.list_crossings(rays, limit, listed.crossings, listed.counts));
    return listed;
}

std::vector<std::uint32_t> count(Tracer& tracer, const std::vector<Ray>& rays) {
    std::vector<std::uint32_t> counts(rays.size());
    REQUIRE(tracer.count_crossings(rays, counts));
    return counts;
}

bool same_bytes(const Hit* a, const Hit* b, std::size_t hits) {
    return hits == 0 || std::memcmp(a, b, hits * sizeof(Hit)) == 0;
}

bool is_in_order(const Hit& a, const Hit& b) {
    return std::tie(a.t, a.instance, a.primitive) <= std::tie(b.t, b.instance, b.primitive);
}

constexpr Hit kMiss{kInfinity, 0.0f, 0.0f, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX};

/// Requires that lists have the first of all crossings, and as many.
void check_lists(const Listed& found, std::size_t limit, const CrossingLists& all, const std::vector<Ray>& rays) {
    for (std::size_t i = 0; i < found.counts.size(); ++i) {
        CAPTURE(i, limit, to_text(rays[i]));
        const std::uint64_t in_all = all.first[i + 1] - all.first[i];
        REQUIRE(found.counts[i] == in_all);
        const std::size_t listed = std::min<std::size_t>(limit, in_all);
        REQUIRE(same_bytes(&found.crossings[i * limit], all.crossings.data() + all.first[i], listed));
        for (std::size_t k = listed; k < limit; ++k) REQUIRE(same_bytes(&found.crossings[i * limit + k], &kMiss, 1));
    }
}

constexpr std::size_t kLimits[] = {1, 3, 40};
constexpr std::array kTrees{Strategy::simt, Strategy::wide};
constexpr std::array kCuts{Cut{2, false}, Cut{4, true}, Cut{9, false}, Cut{20, true}};

/// Requires that all strategies, trees and chunks give what brute force does. Returns all crossings.
CrossingLists check_strategies_agree(const Scene& scene, const std::vector<Ray>& rays, bool cull_back_faces = false) {
    Tracer brute(scene, {test_device()}, {Strategy::brute, cull_back_faces});
    const CrossingLists all = brute.list_all_crossings(rays).value();
    REQUIRE(all.first.size() == rays.size() + 1);
    REQUIRE(all.crossings.size() == all.first.back());
    std::vector<std::uint32_t> counts(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(i, to_text(rays[i]));
        counts[i] = static_cast<std::uint32_t>(all.first[i + 1] - all.first[i]);
        const std::span<const Hit> crossings = std::span(all.crossings).subspan(all.first[i], counts[i]);
        REQUIRE(std::is_sorted(crossings.begin(), crossings.end(),
                               [](const Hit& a, const Hit& b) { return !is_in_order(b, a); }));
        for (const Hit& hit : crossings) REQUIRE((hit.t >= rays[i].t_min && hit.t <= rays[i].t_max));
    }
    CHECK(count(brute, rays) == counts);
    check_lists(list(brute, rays, kLimits[0]), kLimits[0], all, rays);
    for (const TreeQuality quality : {TreeQuality::medium, TreeQuality::high})
        for (const Strategy strategy : kTrees) {
            if (!can_be_tested(strategy)) continue;
            CAPTURE(to_string(strategy), to_string(quality), cull_back_faces);
            Tracer tracer(scene, {test_device()}, {strategy, cull_back_faces, quality});
            CHECK(count(tracer, rays) == counts);
            for (const std::size_t limit : kLimits) check_lists(list(tracer, rays, limit), limit, all, rays);
        }
    if (cull_back_faces) return all;
    static std::size_t turn = 0;
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide}) {
        ++turn;
        if (!can_be_tested(strategy)) continue;
        // Kernels for pieces in chunks are compiled for scenes of triangles alone.
        const bool is_plain = scene.instances.empty() && scene.spheres.empty();
        const TreeQuality quality = is_plain && turn % 2 ? TreeQuality::high : TreeQuality::medium;
        const Cut& cut = kCuts[turn % kCuts.size()];
        const std::size_t limit = kLimits[turn % std::size(kLimits)];
        CAPTURE(to_string(strategy), to_string(quality), cut.chunks, cut.streams);
        const std::size_t some = std::min<std::size_t>(rays.size(), 400);
        const std::vector<Ray> some_rays(rays.begin(), rays.begin() + static_cast<std::ptrdiff_t>(some));
        ChunkedTracer chunked(scene, strategy, quality, cut);
        Listed found;
        const std::vector<std::uint32_t> counted =
            chunked.list_crossings(some_rays, static_cast<std::uint32_t>(limit), found.crossings, found.counts);
        CHECK(counted == found.counts);
        check_lists(found, limit, all, rays);
    }
    return all;
}

CrossingLists check_scene(const Scene& scene, std::uint64_t seed, std::size_t ray_count) {
    RandomSource random(seed);
    const std::vector<Ray> rays = rays_about(scene, random, test_size(ray_count));
    check_strategies_agree(scene, std::vector<Ray>(rays.begin(), rays.begin() + std::ssize(rays) / 4), true);
    return check_strategies_agree(scene, rays);
}

// ---- exact arithmetic

using Integer = __int128;

int sign(Integer x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

/// A ray and triangles with small integers as coordinates: where the ray crosses, exactly.
struct ExactRay {
    std::array<std::int64_t, 3> origin, direction;

    /// The side of the edge from a to b on which the moved ray passes: points in the plane across the ray's longest
    /// axis, times the direction along it.
    static int side(const std::array<Integer, 2>& a, const std::array<Integer, 2>& b) {
        if (const int exact = sign(a[0] * b[1] - a[1] * b[0])) return exact;
        if (const int first = sign(a[1] - b[1])) return first;
        return sign(b[0] - a[0]);
    }

    /// Returns the t of the crossing as a fraction, numerator first; a denominator of 0: there is none.
    std::array<Integer, 2> crossing(const std::array<std::array<std::int64_t, 3>, 3>& triangle) const {
        int z = 0;
        for (int axis = 1; axis < 3; ++axis)
            if (std::abs(direction[axis]) > std::abs(direction[z])) z = axis;
        int x = (z + 1) % 3, y = (z + 2) % 3;
        if (direction[z] < 0) std::swap(x, y);
        const std::int64_t depth = std::abs(direction[z]);
        std::array<std::array<Integer, 2>, 3> seen;
        for (int i = 0; i < 3; ++i) {
            const auto at = [&](int axis) -> Integer { return triangle[i][axis] - origin[axis]; };
            const int toward = direction[z] < 0 ? -1 : 1;
            seen[i] = {at(x) * depth - toward * at(z) * direction[x], at(y) * depth - toward * at(z) * direction[y]};
        }
        const int first = side(seen[0], seen[1]);
        if (first == 0 || side(seen[1], seen[2]) != first || side(seen[2], seen[0]) != first) return {0, 0};
        const auto edge = [&](int from, int to) -> std::array<Integer, 3> {
            return {triangle[to][0] - triangle[from][0], triangle[to][1] - triangle[from][1],
                    triangle[to][2] - triangle[from][2]};
        };
        const auto a = edge(0, 1), b = edge(0, 2);
        const std::array<Integer, 3> normal{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                            a[0] * b[1] - a[1] * b[0]};
        Integer numerator = 0, denominator = 0;
        for (int axis = 0; axis < 3; ++axis) {
            numerator += normal[axis] * (triangle[0][axis] - origin[axis]);
            denominator += normal[axis] * direction[axis];
        }
        if (denominator < 0) return {-numerator, -denominator};
        return {numerator, denominator};
    }
};

// ---- closed meshes

/// Makes a torus about the z axis: closed, not convex.
Mesh torus(std::uint32_t around, std::uint32_t across, float radius, float tube) {
    Mesh mesh;
    const auto angle = [](std::uint32_t i, std::uint32_t n) { return 6.283185307179586 * i / n; };
    for (std::uint32_t i = 0; i < around; ++i)
        for (std::uint32_t k = 0; k < across; ++k) {
            const double r = radius + tube * std::cos(angle(k, across));
            mesh.positions.emplace_back(r * std::cos(angle(i, around)), r * std::sin(angle(i, around)),
                                        tube * std::sin(angle(k, across)));
            const auto corner = [&](std::uint32_t di, std::uint32_t dk) {
                return (i + di) % around * across + (k + dk) % across;
            };
            mesh.triangles.emplace_back(corner(0, 0), corner(1, 0), corner(1, 1));
            mesh.triangles.emplace_back(corner(0, 0), corner(1, 1), corner(0, 1));
        }
    return mesh;
}

/// Moves every vertex by a little, as a scanner's noise does.
Mesh jittered(Mesh mesh, float by) {
    RandomSource random(97);
    for (vec3& p : mesh.positions) p += random.in_box(-by, by);
    return mesh;
}

/// Turns some triangles round: a surface need not be oriented to be crossed evenly.
Mesh with_mixed_winding(Mesh mesh) {
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) std::swap(mesh.triangles[i].x, mesh.triangles[i].y);
    return mesh;
}

struct Closed {
    const char* name;
    Mesh mesh;
    std::vector<vec3> inside;  // points far from the surface; all beyond 2 is outside
    float reach;               // points so close to those are inside, too
};

std::vector<Closed> closed_meshes() {
    std::vector<vec3> in_tube;
    for (int i = 0; i < 24; ++i) {
        const double angle = 6.283185307179586 * i / 24;
        in_tube.emplace_back(0.75 * std::cos(angle), 0.75 * std::sin(angle), 0.0);
    }
    return {{"cube of one face each side", cube_grid(1), {vec3(0)}, 0.9f},
            {"cube of coplanar faces", cube_grid(16), {vec3(0)}, 0.9f},
            {"icosphere", icosphere(3), {vec3(0)}, 0.45f},
            {"torus", torus(48, 24, 0.75f, 0.25f), in_tube, 0.1f},
            {"scan", jittered(bumpy_sphere(5), 0.004f), {vec3(0)}, 0.4f},
            {"cube of mixed winding", with_mixed_winding(cube_grid(8)), {vec3(0)}, 0.9f}};
}

/// A vertex, the middle of an edge, a point of an edge or of a triangle, as near as floats come to it.
vec3 point_of(const Mesh& mesh, RandomSource& random) {
    const glm::uvec3 triangle = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
    const int k = static_cast<int>(random.below(3));
    const vec3 a = mesh.positions[triangle[k]], b = mesh.positions[triangle[(k + 1) % 3]];
    switch (random.below(4)) {
        case 0:
            return a;
        case 1:
            return a + 0.5f * (b - a);
        case 2:
            return a + random.uniform_float(0, 1) * (b - a);
        default:
            return a + 0.25f * (b - a) + 0.5f * (mesh.positions[triangle[(k + 2) % 3]] - a);
    }
}

/// A ray from `origin` through a point of the mesh, or along an axis or in an axis plane.
Ray ray_through(const Mesh& mesh, vec3 origin, RandomSource& random) {
    vec3 direction = point_of(mesh, random) - origin;
    const std::uint32_t kind = random.below(8);
    if (kind == 0) direction[static_cast<int>(random.below(3))] = 0.0f;
    if (kind == 1) {
        direction = vec3(0);
        direction[static_cast<int>(random.below(3))] = random.below(2) ? 1.0f : -1.0f;
    }
    if (direction == vec3(0)) direction.x = 1.0f;
    return make_ray(origin, direction);
}

/// A ray that begins far outside, often exactly above a vertex or an edge, or in the plane of a face.
Ray ray_from_outside(const Mesh& mesh, RandomSource& random) {
    const auto far_away = [&] { return (random.below(2) ? 1.0f : -1.0f) * random.uniform_float(3, 20); };
    vec3 origin;
    switch (random.below(3)) {
        case 0:
            origin = random.direction() * random.uniform_float(3, 20);
            break;
        case 1: {  // above a point of the surface, along an axis
            origin = point_of(mesh, random);
            const int axis = static_cast<int>(random.below(3));
            origin[axis] = far_away();
            if (random.below(2)) {
                vec3 direction(0);
                direction[axis] = origin[axis] < 0 ? 1.0f : -1.0f;
                return make_ray(origin, direction);
            }
            break;
        }
        default: {  // in the plane of a triangle: beyond two of its points
            const vec3 a = point_of(mesh, random), b = point_of(mesh, random);
            origin = a + far_away() * (b - a);
            if (glm::length(origin) < 3 || a == b) origin = random.direction() * 4.0f;
            return make_ray(origin, a - origin);
        }
    }
    return ray_through(mesh, origin, random);
}

/// The number of rays of a test of parity: CASTOR_TEST_CROSSING_RAYS, if it is set.
std::size_t parity_rays() {
    const char* wanted = std::getenv("CASTOR_TEST_CROSSING_RAYS");
    return wanted ? std::strtoull(wanted, nullptr, 10) : test_size(120'000);
}

/// Requires that every ray has an even number of crossings, or an odd one.
void check_parity(Tracer& tracer, const std::vector<Ray>& rays, bool is_odd) {
    const std::vector<std::uint32_t> counts = count(tracer, rays);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (counts[i] % 2 == (is_odd ? 1 : 0)) continue;
        if (++wrong > 3) continue;
        CAPTURE(i, to_text(rays[i]), counts[i], is_odd);
        CHECK(counts[i] % 2 == (is_odd ? 1 : 0));
    }
    CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("crossings of simple things are counted", "[crossings][oclgrind]") {
    Scene scene = scene_of({cube_grid(2)});
    scene.spheres.push_back({vec3(0, 0, 5), 1.0f, 0, 0});
    scene.planes.push_back({vec3(0, 0, 8), vec3(0, 0, 1), 0, 0});
    const std::vector<Ray> rays{
        make_ray({0.1f, 0.2f, -3}, {0, 0, 1}),        // cube, sphere, plane
        make_ray({0, 0, -3}, {0, 0, 1}),              // through a vertex of eight triangles
        make_ray({0, 0, 0}, {0, 0, 1}),               // from inside the cube
        make_ray({0, 0, 5}, {0, 0, -2}),              // from inside the sphere
        make_ray({0.1f, 0.2f, -3}, {0, 0, 1}, 0, 8),  // up to the middle of the sphere
        make_ray({3, 1, 0}, {-1, 0, 0}),              // along a face
        make_ray({3, 0, 6}, {-1, 0, 0}),              // touches the sphere
        make_ray({3, 0, 8}, {-1, 0, 0}),              // within the plane
        make_ray({0, 0, 0}, {0, 0, 0}),               // no ray
    };
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        if (!can_be_tested(strategy)) continue;
        CAPTURE(to_string(strategy));
        Tracer tracer(scene, {test_device()}, {strategy});
        const std::vector<std::uint32_t> counts = count(tracer, rays);
        CHECK(counts[0] == 5);
        CHECK(counts[1] == 5);
        CHECK(counts[2] == 4);
        CHECK(counts[3] == 3);
        CHECK(counts[4] == 3);
        CHECK(counts[5] % 2 == 0);
        CHECK(counts[6] == 0);
        CHECK(counts[7] == 0);
        CHECK(counts[8] == 0);
        const Listed listed = list(tracer, rays, 2);
        CHECK(listed.counts == counts);
        CHECK(listed.crossings[0].t == Approx(2.0f));
        CHECK(listed.crossings[1].t == Approx(4.0f));
        CHECK(listed.crossings[6].t == Approx(0.5f));
        CHECK(listed.crossings[7].t == Approx(2.0f));
        CHECK(listed.crossings[17].primitive == CASTOR_INVALID_INDEX);
    }
}

TEST_CASE("crossings of all strategies are those of brute force", "[crossings]") {
    RandomSource random(91);
    check_scene(scene_of({random_triangles(random, 700, 0.5f)}), 1, 2'000);
    check_scene(scene_of({slivers(random, 300)}), 2, 1'000);
    check_scene(scene_of({coplanar_stack(random, 300)}), 3, 1'000);
    check_scene(scene_of({degenerate(random, 300)}), 4, 1'000);
    check_scene(scene_of({cube_grid(6), icosphere(2)}), 5, 2'000);
    const Mesh mesh = random_triangles(random, 100, 0.4f);
    check_scene(scene_of({mesh, mesh, mesh}), 6, 1'000);
    check_scene(scene_of({}), 7, 200);
    const Grazing input = grazing(random, 300, test_size(1'000));
    check_strategies_agree(scene_of({input.mesh}), input.rays);
}

TEST_CASE("crossings of spheres, planes and instances are those of brute force", "[crossings][instances]") {
    RandomSource random(92);
    check_scene(mixed(random), 8, 2'000);
    for (const float log_scale : {0.0f, 2.0f}) {
        Scene scene = instanced(random, 40, log_scale);
        scene.planes.push_back({vec3(0, -0.5f, 0), vec3(0.1f, 1, 0), 0, 0});
        check_scene(scene, 9, 1'000);
    }
    check_strategies_agree(mixed(random), strange_rays());
}

TEST_CASE("a ray through many pieces of triangles crosses each once", "[crossings]") {
    // Long thin triangles, which a tree of high quality cuts into pieces, far more than a window holds.
    RandomSource random(93);
    Mesh mesh;
    for (std::uint32_t i = 0; i < 400; ++i) {
        const float z = static_cast<float>(i / 2) * 0.01f;  // two at the same t each
        const vec3 far_corner = vec3(random.uniform_float(3, 4), random.uniform_float(3, 4), z);
        mesh.positions.insert(mesh.positions.end(), {vec3(-1, -1.5f, z), far_corner, vec3(-1.5f, -1, z)});
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    const Scene scene = scene_of({mesh});
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < test_size(300, 20); ++i)
        rays.push_back(make_ray({random.uniform_float(-1, 1), random.uniform_float(-1, 1), -1},
                                vec3(random.in_box(-0.1f, 0.1f).x, random.in_box(-0.1f, 0.1f).y, 1)));
    const CrossingLists all = check_strategies_agree(scene, rays);
    CHECK(all.crossings.size() > 20 * rays.size());
}

TEST_CASE("crossings by brute force in passes are those of the trees", "[crossings][brute]") {
    RandomSource random(98);
    Scene scene = scene_of({random_triangles(random, 70'000, 0.05f), random_triangles(random, 20'000, 0.05f)});
    for (int i = 0; i < 10'000; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.001f, 0.02f), 0, 0});
    scene.planes.push_back({vec3(0, -0.2f, 0), vec3(0, 1, 0), 0, 0});
    const std::vector<Ray> rays = rays_about(scene, random, test_size(100, 10));
    const CrossingLists all = check_strategies_agree(scene, rays);
    CHECK(all.crossings.size() > rays.size());
}

TEST_CASE("crossings of rays along a lattice are those of exact arithmetic", "[crossings]") {
    RandomSource random(94);
    const auto coordinate = [&](int reach) { return static_cast<std::int64_t>(random.below(2 * reach + 1)) - reach; };
    constexpr int kTriangles = 300;
    Mesh mesh;
    std::vector<std::array<std::array<std::int64_t, 3>, 3>> triangles;
    for (std::uint32_t i = 0; i < kTriangles; ++i) {
        triangles.emplace_back();
        for (auto& corner : triangles.back()) {
            for (std::int64_t& x : corner) x = coordinate(4);
            mesh.positions.emplace_back(corner[0], corner[1], corner[2]);
        }
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    std::vector<Ray> rays;
    std::vector<ExactRay> exact_rays;
    while (rays.size() < test_size(6'000, 100)) {
        // Along the longest axis a power of two: then shears and sheared coordinates are exact in floats.
        ExactRay exact;
        const int axis = static_cast<int>(random.below(3));
        for (int k = 0; k < 3; ++k) exact.direction[k] = coordinate(3);
        exact.direction[axis] = random.below(2) ? 4 : -4;
        for (std::int64_t& x : exact.origin) x = coordinate(9);
        exact_rays.push_back(exact);
        const bool is_limited = random.below(4) == 0;
        rays.push_back(make_ray(vec3(exact.origin[0], exact.origin[1], exact.origin[2]),
                                vec3(exact.direction[0], exact.direction[1], exact.direction[2]),
                                is_limited ? 0.40625f : -kInfinity, is_limited ? 2.53125f : kInfinity));
    }
    Tracer brute(scene_of({mesh}), {test_device()}, {Strategy::brute});
    const CrossingLists all = brute.list_all_crossings(rays).value();
    std::size_t crossings = 0, on_edges = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(i, to_text(rays[i]));
        std::map<std::uint32_t, double> expected;
        for (std::uint32_t k = 0; k < kTriangles; ++k) {
            const auto [numerator, denominator] = exact_rays[i].crossing(triangles[k]);
            if (denominator == 0) continue;
            const double t = static_cast<double>(numerator) / static_cast<double>(denominator);
            if (t >= rays[i].t_min && t <= rays[i].t_max) expected[k] = t;
        }
        std::map<std::uint32_t, double> found;
        for (std::uint64_t k = all.first[i]; k < all.first[i + 1]; ++k) {
            const Hit& hit = all.crossings[k];
            REQUIRE(found.try_emplace(hit.primitive, hit.t).second);
            on_edges += hit.u == 0 || hit.v == 0 || hit.u + hit.v == 1;
        }
        REQUIRE(found.size() == expected.size());
        for (const auto& [primitive, t] : expected) {
            CAPTURE(primitive);
            REQUIRE(found.contains(primitive));
            REQUIRE(std::abs(found[primitive] - t) <= 32 * 0x1p-24 * 13);
        }
        crossings += expected.size();
    }
    CHECK(crossings > 5 * rays.size());
    CHECK(on_edges > crossings / 20);
}

TEST_CASE("of the triangles around an edge or a vertex one is crossed", "[crossings]") {
    // A sheet of triangles around its middle vertex, wound in all ways; every ray passes once.
    RandomSource random(95);
    for (std::uint32_t corners = 3; corners < 9; ++corners) {
        Mesh mesh;
        mesh.positions.emplace_back(0, 0, 0);
        for (std::uint32_t i = 0; i < corners; ++i) {
            const double angle = 6.283185307179586 * i / corners;
            mesh.positions.emplace_back(vec3(std::round(8 * std::cos(angle)), std::round(8 * std::sin(angle)),
                                             random.uniform_float(-0.5f, 0.5f)));
            const std::uint32_t a = 1 + i, b = 1 + (i + 1) % corners;
            mesh.triangles.push_back(random.below(2) ? glm::uvec3(0, a, b) : glm::uvec3(b, a, 0));
        }
        std::vector<Ray> rays;
        for (int i = 0; i < 64; ++i) {
            const vec3 origin(random.below(5) - 2.0f, random.below(5) - 2.0f, random.below(2) ? 4.0f : -4.0f);
            const vec3 target = random.below(2) ? vec3(0) : 0.25f * mesh.positions[1 + random.below(corners)];
            rays.push_back(make_ray(origin, target - origin));
            rays.push_back(make_ray(target - 3.0f * vec3(0, 0, 1), vec3(0, 0, 1)));
        }
        for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide}) {
            Tracer tracer(scene_of({mesh}), {test_device()}, {strategy});
            const std::vector<std::uint32_t> counts = count(tracer, rays);
            for (std::size_t i = 0; i < rays.size(); ++i) {
                CAPTURE(to_string(strategy), corners, to_text(rays[i]));
                REQUIRE(counts[i] == 1);
            }
        }
    }
}

TEST_CASE("a closed mesh is crossed evenly from outside and oddly from inside", "[crossings]") {
    const std::vector<Closed> meshes = closed_meshes();
    const std::size_t each = parity_rays() / meshes.size() / 2;
    constexpr std::size_t kAtOnce = 1'000'000;
    for (const Closed& closed : meshes) {
        CAPTURE(closed.name);
        RandomSource random(96);
        const Scene scene = scene_of({closed.mesh});
        std::vector<Tracer> tracers;
        for (const Strategy strategy : kTrees)
            if (can_be_tested(strategy))
                tracers.emplace_back(scene, std::vector{test_device()}, TracerOptions{strategy});
        Tracer brute(scene, {test_device()}, {Strategy::brute});
        for (std::size_t done = 0; done < each; done += kAtOnce) {
            std::vector<Ray> outside, inside;
            for (std::size_t i = done; i < std::min(each, done + kAtOnce); ++i) {
                outside.push_back(ray_from_outside(closed.mesh, random));
                const vec3 middle = closed.inside[random.below(static_cast<std::uint32_t>(closed.inside.size()))];
                inside.push_back(ray_through(
                    closed.mesh, middle + closed.reach * (random.below(4) ? random.in_box(-1, 1) : vec3(0)), random));
            }
            Tracer& tracer = tracers[done / kAtOnce % tracers.size()];
            check_parity(tracer, outside, false);
            check_parity(tracer, inside, true);
            std::vector<Ray> some(outside.begin(),
                                  outside.begin() + std::min<std::ptrdiff_t>(300, std::ssize(outside)));
            some.insert(some.end(), inside.begin(), inside.begin() + std::min<std::ptrdiff_t>(300, std::ssize(inside)));
            for (Tracer& each_tracer : tracers) CHECK(count(brute, some) == count(each_tracer, some));
        }
    }
}

TEST_CASE("a batch whose lists are too long for a buffer is refused", "[crossings]") {
    Tracer tracer(scene_of({cube_grid(1)}), {test_device()});
    const std::vector<Ray> rays{make_ray({0, 0, -3}, {0, 0, 1})};
    Hit hit;
    std::uint32_t found = 0;
    const std::uint64_t most = std::min<std::uint64_t>(test_device().max_allocation_bytes / sizeof(Hit), 0xffffffffu);
    CHECK_THROWS_WITH(tracer.list_crossings(rays, most + 1, {&hit, most + 1}, {&found, 1}),
                      Catch::Matchers::Contains(std::to_string(most + 1) + " crossings of a ray are asked for") &&
                          Catch::Matchers::Contains("holds " + std::to_string(most)));
    CHECK(tracer.list_crossings(rays, 0, {}, {&found, 1}));
    CHECK(found == 2);
}

TEST_CASE("long lists are answered in small pieces", "[crossings]") {
    RandomSource random(99);
    const Scene scene = scene_of({random_triangles(random, 200, 0.4f)});
    const std::vector<Ray> rays = rays_about(scene, random, 100);
    Tracer tracer(scene, {test_device(), test_device()});
    const CrossingLists all = tracer.list_all_crossings(rays).value();
    constexpr std::size_t kLimit = 60'000;  // of which 13 rays fill an item
    check_lists(list(tracer, rays, kLimit), kLimit, all, rays);
}

TEST_CASE("a search for crossings can be stopped", "[crossings]") {
    RandomSource random(100);
    const Scene scene = scene_of({random_triangles(random, 20'000, 0.1f)});
    const std::vector<Ray> rays = rays_about(scene, random, 200'000);
    Tracer tracer(scene, {test_device()}, {Strategy::brute});
    const auto stop = [] { return false; };
    std::vector<std::uint32_t> counts(rays.size());
    CHECK(!tracer.count_crossings(rays, counts, Coherence::incoherent, stop));
    CHECK(!tracer.list_all_crossings(rays, Coherence::incoherent, stop));
}

/// Of this thread: what others do meanwhile does not count.
double processor_seconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TEST_CASE("a search for the crossings of many rays looks around all the time", "[crossings]") {
    RandomSource random(101);
    const Scene scene = scene_of({icosphere(2)});
    const std::vector<Ray> rays = rays_about(scene, random, 3 << 20);
    Tracer tracer(scene, {test_device()});
    const double begin = processor_seconds();
    double before = begin, longest = 0.0;
    const auto go_on = [&] {
        const double now = processor_seconds();
        longest = std::max(longest, now - std::exchange(before, now));
        return true;
    };
    const CrossingLists all = tracer.list_all_crossings(rays, Coherence::incoherent, go_on).value();
    go_on();
    CHECK(longest < 0.3 * (before - begin));

    // Rays are listed some at a time, which does not show.
    REQUIRE(all.first.size() == rays.size() + 1);
    for (const std::size_t begin_ray : {std::size_t{0}, std::size_t{(1 << 20) - 500}, rays.size() - 1'000}) {
        const CrossingLists some = tracer.list_all_crossings(std::span(rays).subspan(begin_ray, 1'000)).value();
        const std::uint64_t first = all.first[begin_ray];
        REQUIRE(all.first[begin_ray + 1'000] - first == some.crossings.size());
        CHECK(std::memcmp(&all.crossings[first], some.crossings.data(), some.crossings.size() * sizeof(Hit)) == 0);
    }
}

}  // namespace castor::test
