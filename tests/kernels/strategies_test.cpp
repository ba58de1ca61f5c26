// Brute force and the trees give the same bits for every scene and ray.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "castor/tracer.h"
#include "reference/nasty_scenes.h"
#include "support/catch.h"
#include "support/chunked_tracer.h"
#include "support/kernel_fixture.h"
#include "support/tested_strategies.h"

namespace castor::test {
namespace {

using glm::vec3;

struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;
};

Answers trace(Tracer& tracer, const std::vector<Ray>& rays) {
    Answers answers{std::vector<Hit>(rays.size()), std::vector<std::uint8_t>(rays.size())};
    tracer.closest_hit(rays, answers.hits);
    tracer.any_hit(rays, answers.occluded);
    return answers;
}

bool same_bits(const Hit& a, const Hit& b) {
    return std::memcmp(&a, &b, sizeof(Hit)) == 0;
}

bool is_proper(const Ray& ray, const Hit& hit) {
    if (hit.primitive == CASTOR_INVALID_INDEX)
        return hit.t == kInfinity && hit.u == 0 && hit.v == 0 && hit.instance == CASTOR_INVALID_INDEX;
    constexpr float kRounding = 1e-5f;
    return hit.t >= ray.t_min && hit.t <= ray.t_max && hit.instance != CASTOR_INVALID_INDEX && hit.u >= 0 &&
           hit.v >= 0 && hit.u + hit.v <= 1 + kRounding;
}

struct Other {
    Strategy strategy;
    TreeQuality quality;
    Cut cut{1, false};
};
constexpr std::array kOthers{Other{Strategy::simt, TreeQuality::medium},   Other{Strategy::wide, TreeQuality::medium},
                             Other{Strategy::packet, TreeQuality::medium}, Other{Strategy::simt, TreeQuality::high},
                             Other{Strategy::wide, TreeQuality::high},     Other{Strategy::packet, TreeQuality::high}};
constexpr std::array kStrategies{Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet};
constexpr std::array kCuts{Cut{2, false}, Cut{4, true}, Cut{9, false}, Cut{20, true}};

/// As many answers as there are in `found`.
void check_same(const Answers& found, const Answers& expected, const std::vector<Ray>& rays, const Other& other,
                bool cull_back_faces) {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < found.hits.size() && wrong < 3; ++i) {
        const Hit &e = expected.hits[i], &f = found.hits[i];
        const bool is_hit = e.primitive != CASTOR_INVALID_INDEX;
        const bool right = same_bits(e, f) && is_proper(rays[i], e) && expected.occluded[i] == (is_hit ? 1 : 0) &&
                           found.occluded[i] == expected.occluded[i];
        if (right) continue;
        ++wrong;
        CAPTURE(to_string(other.strategy), to_string(other.quality), other.cut.chunks, other.cut.streams,
                cull_back_faces, i, to_text(rays[i]), e.t, e.u, e.v, e.primitive, e.instance, f.t, f.u, f.v,
                f.primitive, f.instance, int(expected.occluded[i]), int(found.occluded[i]));
        CHECK(right);
    }
}

/// The tracers of a scene, one for each strategy and quality of trees. They stay for several batches: most of a small
/// batch's time is building trees and loading kernels.
class AllStrategies {
public:
    explicit AllStrategies(const Scene& scene, bool cull_back_faces = false)
        : scene_(scene),
          cull_back_faces_(cull_back_faces),
          brute_(scene, {test_device()}, {Strategy::brute, cull_back_faces}) {
        for (const Other& other : kOthers)
            if (can_be_tested(other.strategy))
                others_.emplace_back(
                    other, std::make_unique<Tracer>(scene, std::vector{test_device()},
                                                    TracerOptions{other.strategy, cull_back_faces, other.quality}));
    }

    /// Traces with all strategies and compares everything with everything: the whole scene, and for some of the rays
    /// the scene cut into chunks, each time otherwise.
    Answers check_agree(const std::vector<Ray>& rays) {
        const Answers expected = trace(brute_, rays);
        for (const auto& [other, tracer] : others_)
            check_same(trace(*tracer, rays), expected, rays, other, cull_back_faces_);
        static std::size_t turn = 0;
        const auto some =
            static_cast<std::ptrdiff_t>(std::min(rays.size(), std::max<std::size_t>(200, rays.size() / 8)));
        const std::vector<Ray> some_rays(rays.begin(), rays.begin() + some);
        for (const Strategy strategy : kStrategies) {
            ++turn;
            if (!can_be_tested(strategy)) continue;
            const Other other{strategy, turn % 3 ? TreeQuality::medium : TreeQuality::high,
                              kCuts[(turn + turn / 4) % kCuts.size()]};
            Answers found;
            ChunkedTracer(scene_, strategy, other.quality, other.cut)
                .trace(some_rays, found.hits, found.occluded, cull_back_faces_);
            check_same(found, expected, rays, other, cull_back_faces_);
        }
        return expected;
    }

private:
    const Scene& scene_;
    bool cull_back_faces_;
    Tracer brute_;
    std::vector<std::pair<Other, std::unique_ptr<Tracer>>> others_;
};

Answers check_strategies_agree(const Scene& scene, const std::vector<Ray>& rays) {
    return AllStrategies(scene).check_agree(rays);
}

void check_scene(const Scene& scene, std::uint64_t seed, std::size_t ray_count, float scale = 1.0f,
                 vec3 offset = vec3(0)) {
    RandomSource random(seed);
    const std::vector<Ray> rays = rays_about(scene, random, test_size(ray_count), scale, offset);
    AllStrategies strategies(scene);
    const Answers answers = strategies.check_agree(rays);
    strategies.check_agree(bundles_about(rays, random, scale));
    AllStrategies(scene, true).check_agree({rays.begin(), rays.begin() + static_cast<std::ptrdiff_t>(rays.size() / 4)});

    // Again with t_min or t_max exactly at the hit, and just past it.
    std::vector<Ray> limited;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (answers.hits[i].primitive == CASTOR_INVALID_INDEX) continue;
        Ray ray = rays[i];
        switch (i % 4) {
            case 0:
                ray.t_max = answers.hits[i].t;
                break;
            case 1:
                ray.t_min = answers.hits[i].t;
                break;
            case 2:
                ray.t_max = std::nextafter(answers.hits[i].t, -kInfinity);
                break;
            case 3:
                ray.t_min = std::nextafter(answers.hits[i].t, kInfinity);
                break;
        }
        if (ray.t_min <= ray.t_max) limited.push_back(ray);
    }
    const Answers again = strategies.check_agree(limited);
    std::size_t next = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (answers.hits[i].primitive == CASTOR_INVALID_INDEX) continue;
        Ray ray = rays[i];
        if (i % 4 == 2 && std::nextafter(answers.hits[i].t, -kInfinity) < ray.t_min) continue;
        if (i % 4 == 3 && std::nextafter(answers.hits[i].t, kInfinity) > ray.t_max) continue;
        const Hit& hit = again.hits[next++];
        if (i % 4 > 1) continue;
        CAPTURE(to_text(ray), answers.hits[i].t, answers.hits[i].primitive, hit.t, hit.primitive);
        REQUIRE(same_bits(hit, answers.hits[i]));
    }
}

}  // namespace

TEST_CASE("brute force equals the trees on random triangles", "[strategies]") {
    RandomSource random(61);
    check_scene(scene_of({random_triangles(random, test_size(600, 60), 0.1f), random_triangles(random, 60, 1.0f)}), 1,
                10'000);
}

TEST_CASE("brute force equals the trees on closed meshes", "[strategies]") {
    check_scene(scene_of({cube_grid(7)}), 2, 10'000);
    check_scene(scene_of({bumpy_sphere(3)}), 3, 10'000);
}

TEST_CASE("brute force equals the trees in a room", "[strategies]") {
    // The tree's root has walls for leaves, and the things in the room below it.
    RandomSource random(75);
    Mesh walls = cube_grid(1);
    for (vec3& p : walls.positions) p = 3.0f * p - 1.5f;
    Mesh thing = bumpy_sphere(3);
    for (vec3& p : thing.positions) p = 0.1f * p + vec3(0.2f, -0.4f, 0.1f);
    Scene room = scene_of({walls, thing});
    check_scene(room, 20, 6'000);
    for (int i = 0; i < 5; ++i) room.spheres.push_back({random.in_box(-1, 1), 0.3f, 0, 0});
    check_scene(room, 21, 3'000);
    room.planes.push_back({vec3(0, -0.5f, 0), vec3(0.1f, 1, 0), 0, 0});
    check_scene(room, 22, 1'000);
    check_scene(scene_of({walls}), 23, 2'000);
}

TEST_CASE("brute force equals the trees where groups of rays are not full", "[strategies]") {
    // Incoherent rays of a small scene, and bundles that have parted, are traversed in groups of sixteen.
    RandomSource random(77);
    const Scene scene = scene_of({random_triangles(random, 300, 0.4f), random_triangles(random, 700, 0.1f)});
    AllStrategies strategies(scene);
    std::size_t hit_count = 0;
    for (std::size_t count = 1; count <= 160; count += count < 34 ? 1 : 21) {
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < count; ++i) {
            Ray ray = make_ray(random.in_box(-1.2f, 1.2f), random.direction(), 0.0f, kInfinity);
            // Alone, in half of a group, and in all of one there is nothing to trace.
            if (i % 5 == 3 || i / 8 % 4 == 1 || i / 16 % 3 == 2) ray.t_max = -1.0f;
            rays.push_back(ray);
        }
        for (const Hit& hit : strategies.check_agree(rays).hits) hit_count += hit.primitive != CASTOR_INVALID_INDEX;
    }
    CHECK(hit_count > 100);
}

TEST_CASE("rays that graze the bounds of a scene hit as brute force does", "[strategies]") {
    RandomSource random(76);
    const Mesh cubes = cube_grid(3);
    vec3 lower(kInfinity), upper(-kInfinity);
    for (const vec3& p : cubes.positions) lower = glm::min(lower, p), upper = glm::max(upper, p);
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < test_size(6'000); ++i) {
        const int axis = static_cast<int>(random.below(3));
        vec3 origin = lower + (upper - lower) * random.in_box(0, 1), direction = random.direction();
        origin[axis] = random.below(2) ? lower[axis] : upper[axis];
        for (std::uint64_t ulps = random.below(3); ulps > 0; --ulps)
            origin[axis] = std::nextafter(origin[axis], random.below(2) ? kInfinity : -kInfinity);
        if (i % 3 == 0) direction[axis] = 0.0f;
        if (i % 7 == 0) origin -= direction;
        rays.push_back(make_ray(origin, direction, 0.0f, i % 5 ? kInfinity : 1.0f));
    }
    const Answers answers = check_strategies_agree(scene_of({cubes}), rays);
    const auto hits = std::count_if(answers.hits.begin(), answers.hits.end(),
                                    [](const Hit& hit) { return hit.primitive != CASTOR_INVALID_INDEX; });
    CHECK(static_cast<std::size_t>(hits) > rays.size() / 4);
    CHECK(static_cast<std::size_t>(hits) < rays.size() * 9 / 10);
}

TEST_CASE("bundles of shadow rays that graze bounds towards a light are occluded as brute force says", "[strategies]") {
    // The rays run in planes of cubes' faces, or pass corners, and rounding decides what they meet.
    RandomSource random(85);
    const Mesh cubes = cube_grid(3);
    vec3 lower(kInfinity), upper(-kInfinity);
    for (const vec3& p : cubes.positions) lower = glm::min(lower, p), upper = glm::max(upper, p);
    std::vector<Ray> rays;
    while (rays.size() < test_size(24'000, 800)) {
        const int axis = static_cast<int>(random.below(3));
        const auto near_face = [&, face = random.below(2) ? lower[axis] : upper[axis]](vec3 point) {
            point[axis] = face;
            for (std::uint64_t ulps = random.below(4); ulps > 0; --ulps)
                point[axis] = std::nextafter(point[axis], random.below(2) ? kInfinity : -kInfinity);
            return point;
        };
        const vec3 center = lower + (upper - lower) * random.in_box(-0.5f, 1.5f);
        const float distance = std::exp2(random.uniform_float(0, 12));
        const vec3 light = near_face(center + random.direction() * distance);
        const float spread = std::exp2(random.uniform_float(-4, 1));
        const bool at_corner = random.below(2);
        const vec3 corner = cubes.positions[random.below(static_cast<std::uint32_t>(cubes.positions.size()))];
        for (int i = 0; i < 16; ++i) {
            const vec3 origin = at_corner ? corner + glm::normalize(corner - light) * random.uniform_float(0.1f, 2)
                                          : near_face(center + random.in_box(-1, 1) * spread);
            rays.push_back(make_ray(origin, light - origin, 0.0f, 1.0f));
        }
    }
    const Answers answers = check_strategies_agree(scene_of({cubes}), rays);
    const auto occluded = static_cast<std::size_t>(std::count(answers.occluded.begin(), answers.occluded.end(), 1));
    CHECK(occluded > rays.size() / 8);
    CHECK(occluded < rays.size() * 7 / 8);
}

TEST_CASE("brute force equals the trees on slivers", "[strategies]") {
    RandomSource random(62);
    check_scene(scene_of({slivers(random, 500)}), 4, 10'000);
}

TEST_CASE("brute force equals the trees on stacks of coplanar triangles", "[strategies]") {
    RandomSource random(63);
    check_scene(scene_of({coplanar_stack(random, 500)}), 5, 10'000);
}

TEST_CASE("brute force equals the trees for rays in the planes of triangles", "[strategies]") {
    RandomSource random(74);
    for (float scale : {1.0f, 1e4f}) {
        Grazing input = grazing(random, 500, test_size(10'000));
        const Scene scene = scene_of({moved(input.mesh, scale, vec3(0))});
        for (Ray& ray : input.rays)
            for (float& o : ray.origin) o *= scale;
        const Answers answers = check_strategies_agree(scene, input.rays);
        std::size_t hit_count = 0;
        for (const Hit& hit : answers.hits) hit_count += hit.primitive != CASTOR_INVALID_INDEX;
        CHECK(hit_count > input.rays.size() / 10);
    }
}

TEST_CASE("brute force equals the trees among degenerate triangles", "[strategies]") {
    RandomSource random(64);
    const Scene scene = scene_of({degenerate(random, 600)});
    check_scene(scene, 6, 6'000);
    Tracer tracer(scene, {test_device()});
    for (const Hit& hit : trace(tracer, rays_about(scene, random, 5000)).hits)
        if (hit.primitive != CASTOR_INVALID_INDEX) REQUIRE(hit.primitive % 3 == 2);
}

TEST_CASE("brute force equals the trees far away", "[strategies]") {
    RandomSource random(65);
    for (vec3 offset : {vec3(1e6f, -1e6f, 1e6f), vec3(0, 0, 1e6f)}) {
        check_scene(scene_of({moved(cube_grid(8), 1.0f, offset)}), 7, 2'500, 1.0f, offset);
        check_scene(scene_of({moved(random_triangles(random, 500, 0.2f), 1.0f, offset)}), 8, 2'500, 1.0f, offset);
    }
}

TEST_CASE("brute force equals the trees where everything is tiny or huge", "[strategies]") {
    RandomSource random(66);
    for (float scale : {1e-20f, 1e-12f, 1e-5f, 1e5f, 4e11f})
        check_scene(scene_of({moved(random_triangles(random, 400, 0.2f), scale, vec3(0))}), 9, 4'000, scale);
}

TEST_CASE("of duplicated primitives the smallest number is hit", "[strategies]") {
    RandomSource random(67);
    const Mesh mesh = random_triangles(random, 200, 0.3f);
    const Scene scene = scene_of({mesh, mesh, mesh});
    check_scene(scene, 10, 6'000);
    Tracer tracer(scene, {test_device()});
    for (const Hit& hit : trace(tracer, rays_about(scene, random, 5000)).hits)
        if (hit.primitive != CASTOR_INVALID_INDEX) REQUIRE(hit.primitive < 200);
}

TEST_CASE("brute force equals the trees among triangles, spheres and planes", "[strategies]") {
    RandomSource random(68);
    check_scene(mixed(random), 11, 10'000);
}

TEST_CASE("brute force equals the trees at the silhouettes and surfaces of spheres", "[strategies]") {
    RandomSource random(76);
    for (const float far_away : {0.0f, 3.0f, 3000.0f}) {
        CAPTURE(far_away);
        Scene scene = scene_of({});
        const vec3 offset = far_away * random.direction();
        for (int i = 0; i < 300; ++i)
            scene.spheres.push_back({offset + random.in_box(-1, 1), std::exp2(random.uniform_float(-9, -1)), 0, 0});
        std::vector<Ray> rays;
        for (int i = 0; i < 12'000; ++i) {
            const Sphere& sphere = scene.spheres[random.below(300)];
            const vec3 normal = random.direction();
            const vec3 tangent = glm::normalize(glm::cross(normal, random.direction()));
            // Of a relative 2^-24 … 1 inside or outside the surface, along it or away from it.
            const auto small = [&] {
                return (random.below(2) ? 1.0f : -1.0f) * std::exp2(random.uniform_float(-26, 0));
            };
            const vec3 point = sphere.center + normal * (sphere.radius * (1.0f + small()));
            const vec3 direction = tangent + small() * normal;
            const float back = random.below(2) ? 0.0f : std::exp2(random.uniform_float(-6, 6));
            Ray ray = make_ray(point - back * direction, direction);
            if (random.below(4) == 0) ray.t_min = random.uniform_float(-2, 1);
            rays.push_back(ray);
        }
        check_strategies_agree(scene, rays);
    }
}

TEST_CASE("a scene without geometry is missed by every ray", "[strategies][oclgrind]") {
    RandomSource random(69);
    const Scene scene = scene_of({});
    const Answers answers = check_strategies_agree(scene, rays_about(scene, random, test_size(1000)));
    for (const Hit& hit : answers.hits) REQUIRE(hit.primitive == CASTOR_INVALID_INDEX);
}

TEST_CASE("a scene of planes alone, and of one sphere, has hits", "[strategies]") {
    RandomSource random(70);
    Scene scene = scene_of({});
    scene.planes.push_back({vec3(0, -1, 0), vec3(0, 1, 0), 0, 0});
    check_scene(scene, 12, 1000);
    scene.planes.clear();
    scene.spheres.push_back({vec3(0), 1.0f, 0, 0});
    check_scene(scene, 13, 1000);
    Tracer tracer(scene, {test_device()});
    const std::vector<Ray> rays{make_ray({0, 0, 3}, {0, 0, -1})};
    REQUIRE(trace(tracer, rays).hits[0].t == 2.0f);
}

TEST_CASE("strange rays agree too, and those that are no rays miss", "[strategies]") {
    RandomSource random(71);
    std::vector<Ray> rays = strange_rays();
    for (const Scene& scene : {mixed(random), scene_of({cube_grid(4)})}) {
        AllStrategies strategies(scene);
        const Answers answers = strategies.check_agree(rays);
        strategies.check_agree(bundles_about(rays, random, 1.0f));
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (is_number(rays[i])) continue;
            CAPTURE(to_text(rays[i]));
            REQUIRE(answers.hits[i].primitive == CASTOR_INVALID_INDEX);
        }
    }
}

TEST_CASE("the length of the direction only scales t", "[strategies]") {
    RandomSource random(72);
    const Scene scene = mixed(random);
    std::vector<Ray> rays = rays_about(scene, random, test_size(5000)), scaled = rays;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        rays[i].t_min = scaled[i].t_min = 0.0f;
        rays[i].t_max = scaled[i].t_max = kInfinity;
        for (float& d : scaled[i].direction) d *= 0x1p-60f;
    }
    Tracer tracer(scene, {test_device()});
    const Answers expected = trace(tracer, rays), found = trace(tracer, scaled);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(to_text(rays[i]));
        REQUIRE(found.hits[i].primitive == expected.hits[i].primitive);
        REQUIRE(found.hits[i].t == expected.hits[i].t * 0x1p60f);
    }
}

TEST_CASE("a batch gives what its rays give one by one", "[strategies]") {
    RandomSource random(73);
    const Scene scene = mixed(random);
    const std::vector<Ray> rays = rays_about(scene, random, 300);
    for (Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide}) {
        Tracer tracer(scene, {test_device()}, {strategy});
        const Answers batch = trace(tracer, rays);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const Answers single = trace(tracer, {rays[i]});
            CAPTURE(to_text(rays[i]));
            REQUIRE(same_bits(single.hits[0], batch.hits[i]));
            REQUIRE(single.occluded[0] == batch.occluded[i]);
        }
    }
}

TEST_CASE("back faces of flat triangles alone are culled", "[strategies]") {
    Mesh flat = cube_grid(2), smooth = moved(cube_grid(2), 1.0f, vec3(5, 0, 0));
    for (const vec3& p : smooth.positions) smooth.normals.push_back(glm::normalize(p - vec3(5, 0, 0)));
    Tracer tracer(scene_of({flat, smooth}), {test_device()}, {Strategy::simt, true});
    const std::vector<Ray> rays{make_ray({0.1f, 0.2f, 5}, {0, 0, -1}), make_ray({0.1f, 0.2f, 0}, {0, 0, -1}),
                                make_ray({5.1f, 0.2f, 0}, {0, 0, -1})};
    const Answers answers = trace(tracer, rays);
    CHECK(answers.hits[0].t == Approx(4.0f));
    CHECK(answers.hits[1].primitive == CASTOR_INVALID_INDEX);
    CHECK(answers.occluded[1] == 0);
    CHECK(answers.hits[2].t == Approx(1.0f));
}

TEST_CASE("brute force equals the trees among instances", "[strategies][instances]") {
    RandomSource random(81);
    for (const float log_scale : {0.0f, 2.0f, 6.0f}) {
        Scene scene = instanced(random, 40, log_scale);
        check_scene(scene, 14, 3'000);
        scene.planes.push_back({vec3(0, -0.5f, 0), vec3(0.1f, 1, 0), 0, 0});
        check_scene(scene, 15, 1'000);
    }
}

TEST_CASE("brute force equals the trees where bundles meet hundreds of small instances", "[strategies][instances]") {
    RandomSource random(84);
    Scene scene = scene_of({bumpy_sphere(1)});
    for (int i = 0; i < 300; ++i) {
        Transform transform = random_transform(random, 1.0f, 0.0f);
        for (int column = 0; column < 3; ++column) transform[column] *= 0.02f;
        transform[3] = random.in_box(-1, 1);
        scene.instances.push_back({0, transform, 0});
    }
    check_scene(scene, 24, 1'500);
}

TEST_CASE("rays that leave a point in all directions hit instances as brute force does", "[strategies][instances]") {
    // Groups of sixteen enter instances together, and part there.
    RandomSource random(86);
    const Scene scene = instanced(random, 40, 0.5f);
    AllStrategies strategies(scene);
    std::size_t hit_count = 0, in_instances = 0;
    for (const float spread : {0.0f, 0.001f, 0.2f}) {
        std::vector<Ray> rays;
        while (rays.size() < test_size(4'000, 500)) {
            const vec3 point = random.in_box(-1, 1);
            const std::size_t count = 1 + random.below(16);
            for (std::size_t i = 0; i < 16; ++i) {
                const float t_max = i >= count ? -1.0f : i % 3 ? kInfinity : 1.0f;
                rays.push_back(make_ray(point + random.in_box(-spread, spread), random.direction(), 0.0f, t_max));
            }
        }
        for (const Hit& hit : strategies.check_agree(rays).hits) {
            hit_count += hit.primitive != CASTOR_INVALID_INDEX;
            in_instances += hit.primitive != CASTOR_INVALID_INDEX && hit.instance > 0;
        }
    }
    CHECK(hit_count > 100);
    CHECK(in_instances > 100);
}

TEST_CASE("brute force equals the trees among instances far away, tiny and huge", "[strategies][instances]") {
    RandomSource random(82);
    struct Case {
        float scale;
        vec3 offset;
    };
    for (const Case& c : {Case{1.0f, vec3(1e6f, -1e6f, 1e6f)}, Case{1e-7f, vec3(0)}, Case{1e7f, vec3(0)},
                          Case{1e-5f, vec3(10, 20, -5)}}) {
        Scene scene = scene_of({random_triangles(random, 30, 0.5f)});
        scene.meshes[0].transform[3] = c.offset + vec3(c.scale);
        for (int i = 0; i < 30; ++i) {
            Transform transform = random_transform(random, 1.0f, 1.0f);
            for (int column = 0; column < 4; ++column) transform[column] *= c.scale;
            transform[3] += c.offset;
            scene.instances.push_back({0, transform, 0});
        }
        check_scene(scene, 16, 2'000, c.scale, c.offset);
    }
}

TEST_CASE("brute force equals the trees among instances nearly without an inverse", "[strategies][instances]") {
    RandomSource random(83);
    Scene scene = scene_of({random_triangles(random, 30, 0.5f)});
    for (int i = 0; i < 30; ++i) {
        Transform transform = random_transform(random, 1.0f, 1.0f);
        transform[i % 3] *= 1e-4f;
        scene.instances.push_back({0, transform, 0});
    }
    check_scene(scene, 17, 3'000);
}

TEST_CASE("instances are hit by rays that only rounding leads past their boxes", "[strategies][instances]") {
    struct Case {
        float distance, reach;
    };
    // What InstanceBounds adds to a box of its own, and what it adds for a ray's far origin.
    for (const Case& c : {Case{1000, 0}, Case{1e5f, 0}, Case{1e6f, 0}, Case{1e5f, 3}, Case{1, 1e4f}, Case{1, 1e6f}}) {
        CAPTURE(c.distance, c.reach);
        RandomSource random(86);
        const NearCorners near = near_corners(random, test_size(6'000), c.distance, c.reach);
        const Answers answers = check_strategies_agree(near.scene, near.rays);
        std::size_t hit_from_outside = 0;
        for (std::size_t i = 0; i < near.rays.size(); ++i)
            hit_from_outside += near.outside[i] > 0 && answers.hits[i].primitive != CASTOR_INVALID_INDEX;
        CHECK(hit_from_outside > near.rays.size() / 300);  // or the boxes are not put to the test
    }
}

TEST_CASE("of instances at one place the first is hit, and the scene itself before them", "[strategies][instances]") {
    RandomSource random(84);
    Scene scene = scene_of({random_triangles(random, 50, 0.4f)});
    const Transform transform = random_transform(random, 0.2f, 1.0f);
    for (int i = 0; i < 20; ++i) scene.instances.push_back({0, transform, 0});
    check_scene(scene, 18, 2'000);
    std::size_t instance_hits = 0;
    const std::vector<Ray> rays = rays_about(scene, random, 2000);
    for (Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide}) {
        Tracer tracer(scene, {test_device()}, {strategy});
        for (const Hit& hit : trace(tracer, rays).hits) {
            if (hit.primitive == CASTOR_INVALID_INDEX) continue;
            CAPTURE(to_string(strategy), hit.instance);
            REQUIRE((hit.instance == 1 || hit.instance == 21));  // number 21 is the mesh itself, which stands elsewhere
            instance_hits += hit.instance == 1;
        }
    }
    CHECK(instance_hits > 100);

    Scene same = scene_of({scene.meshes[0], scene.meshes[0]});
    same.instances.push_back({1, Transform(1.0f), 0});
    same.meshes[1].transform[3] = vec3(100, 0, 0);
    Tracer tracer(same, {test_device()});
    for (const Hit& hit : trace(tracer, rays_about(same, random, 1000)).hits)
        if (hit.primitive != CASTOR_INVALID_INDEX) REQUIRE((hit.instance == 0 || hit.instance == 2));
}

TEST_CASE("instances hit what meshes moved in double precision hit", "[strategies][instances]") {
    RandomSource random(85);
    Scene scene = scene_of({bumpy_sphere(2)});
    scene.meshes[0].transform[3] = vec3(50, 0, 0);
    Scene moved_scene = scene_of({});
    for (int i = 0; i < 6; ++i) {
        const Transform transform = random_transform(random, 1.0f, 1.0f);
        scene.instances.push_back({0, transform, 0});
        Mesh mesh = scene.meshes[0];
        mesh.transform = Transform(1.0f);
        for (vec3& p : mesh.positions)
            p = vec3(glm::dmat3(glm::dvec3(transform[0]), glm::dvec3(transform[1]), glm::dvec3(transform[2])) *
                         glm::dvec3(p) +
                     glm::dvec3(transform[3]));
        moved_scene.meshes.push_back(mesh);
    }
    const auto per_mesh = static_cast<std::uint32_t>(scene.meshes[0].triangles.size());
    Tracer tracer(scene, {test_device()}), reference(moved_scene, {test_device()});
    std::vector<Ray> rays;
    for (int i = 0; i < 3000; ++i) rays.push_back(make_ray(random.in_box(-4, 4), random.direction()));
    const Answers found = trace(tracer, rays), expected = trace(reference, rays);
    std::size_t different = 0, hits = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit &f = found.hits[i], &e = expected.hits[i];
        if (e.primitive == CASTOR_INVALID_INDEX) {
            different += f.primitive != CASTOR_INVALID_INDEX;
            continue;
        }
        ++hits;
        const bool same = f.instance == e.primitive / per_mesh + 1 && f.primitive == e.primitive % per_mesh;
        if (!same) {
            ++different;  // at edges rounding decides
            continue;
        }
        CAPTURE(to_text(rays[i]), f.t, e.t, f.instance);
        REQUIRE(f.t == Approx(e.t).epsilon(1e-4).margin(1e-5));
    }
    CHECK(hits > 300);
    CHECK(different < 10);
}

TEST_CASE("an ellipsoid is hit where its equation says", "[strategies][instances]") {
    Scene scene = scene_of({});
    Sphere sphere{vec3(0), 0.5f, 0, 0};
    sphere.transform = Transform(vec3(4, 0, 0), vec3(0, 2, 0), vec3(0, 0, -6), vec3(0, 0, 10));  // half axes 2, 1, 3
    scene.spheres = {sphere};
    Tracer tracer(scene, {test_device()});
    const std::vector<Ray> rays{make_ray({0, 0, 0}, {0, 0, 1}), make_ray({5, 0, 10}, {-1, 0, 0}),
                                make_ray({0, 5, 10}, {0, -2, 0}), make_ray({5, 1.1f, 10}, {-1, 0, 0})};
    const Answers answers = trace(tracer, rays);
    CHECK(answers.hits[0].t == Approx(7.0f));
    CHECK(answers.hits[1].t == Approx(3.0f));
    CHECK(answers.hits[2].t == Approx(2.0f));
    CHECK(answers.hits[2].instance == 1);
    CHECK(answers.hits[2].primitive == 0);
    CHECK(answers.hits[3].primitive == CASTOR_INVALID_INDEX);
}

}  // namespace castor::test
