// A strategy against brute force on ordinary and on nasty geometry, and brute force against double precision.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "castor/renderer.h"
#include "doctor/check.h"
#include "doctor/golden_picture.h"
#include "reference/nasty_scenes.h"
#include "tune/kernel_cases.h"

namespace castor::doctor {

namespace {

using glm::vec3;
using reference::RandomSource;

// A driver may compile for longer than a device is waited for otherwise. Whoever examines has patience, and ends the
// process of these checks when that is over.
constexpr double kNoDeadline = 1e6;

TracerOptions options_of(Strategy strategy, bool cull_back_faces = false) {
    return {.strategy = strategy,
            .cull_back_faces = cull_back_faces,
            .deadline_seconds = kNoDeadline,
            .stop_deadline_seconds = kNoDeadline};
}

struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;
};

Answers trace(Tracer& tracer, const std::vector<Ray>& rays) {
    Answers answers{std::vector<Hit>(rays.size()), std::vector<std::uint8_t>(rays.size(), 0xff)};
    tracer.closest_hit(rays, answers.hits);
    tracer.any_hit(rays, answers.occluded);
    return answers;
}

std::string text(const Hit& hit, int occluded) {
    const std::string any = occluded == 0 ? "any hit: no" : occluded == 1 ? "any hit: yes" : "any hit: not answered";
    if (hit.primitive == CASTOR_INVALID_INDEX && std::isinf(hit.t)) return "a miss, " + any;
    return fmt::format("t {:a} u {:a} v {:a} primitive {} instance {}, {}", hit.t, hit.u, hit.v, hit.primitive,
                       hit.instance, any);
}

/// A miss has no values, a hit lies in the ray's range, and both queries agree.
bool is_proper(const Ray& ray, const Hit& hit, int occluded) {
    if (hit.primitive == CASTOR_INVALID_INDEX)
        return occluded == 0 && std::isinf(hit.t) && hit.t > 0 && hit.u == 0 && hit.v == 0 &&
               hit.instance == CASTOR_INVALID_INDEX;
    return occluded == 1 && hit.t >= ray.t_min && hit.t <= ray.t_max && hit.instance != CASTOR_INVALID_INDEX;
}

/// The first answer of `found` that `right`(ray's number) does not allow, and how many there are.
template <class Right, class Expected>
std::string first_wrong(const std::vector<Ray>& rays, const Answers& found, const Right& right,
                        const Expected& expected) {
    std::size_t wrong = 0, first = 0;
    for (std::size_t i = rays.size(); i-- > 0;)
        if (!right(i)) first = i, ++wrong;
    if (wrong == 0) return "";
    return fmt::format("{} of {} rays are answered wrongly, the first, {}: found {}; expected {}", wrong, rays.size(),
                       reference::to_text(rays[first]), text(found.hits[first], found.occluded[first]),
                       expected(first));
}

std::string compare(const std::vector<Ray>& rays, const Answers& found, const Answers& expected) {
    return first_wrong(
        rays, found,
        [&](std::size_t i) {
            return std::memcmp(&found.hits[i], &expected.hits[i], sizeof(Hit)) == 0 &&
                   found.occluded[i] == expected.occluded[i] && is_proper(rays[i], found.hits[i], found.occluded[i]);
        },
        [&](std::size_t i) { return "by brute force " + text(expected.hits[i], expected.occluded[i]); });
}

/// A scene and the rays to ask for, at random.
struct Situation {
    std::string name;
    std::function<Scene(RandomSource&)> scene;
    float scale = 1.0f;
    vec3 offset{0.0f};
    enum class Rays { about, grazing, strange } rays = Rays::about;
    bool cull_back_faces = false;
    bool small_buffers = false;  // for which a tree is cut into chunks
};

Scene of(Mesh mesh) {
    return reference::scene_of({std::move(mesh)});
}

std::vector<Situation> situations() {
    constexpr std::size_t kTriangles = 300;
    const auto random_mesh = [](RandomSource& random) {
        return of(reference::random_triangles(random, kTriangles, 0.2f));
    };
    const auto scaled = [](float scale, vec3 offset) {
        return [scale, offset](RandomSource& random) {
            return of(reference::moved(reference::random_triangles(random, kTriangles, 0.2f), scale, offset));
        };
    };
    const auto with_planes = [](RandomSource& random) {
        Scene scene = reference::instanced(random, 40);
        scene.planes.push_back({{0, -0.5f, 0}, {0.1f, 1, 0}, 0, 0});
        return scene;
    };
    const auto duplicates = [](RandomSource& random) {
        const Mesh mesh = reference::random_triangles(random, kTriangles / 3, 0.3f);
        return reference::scene_of({mesh, mesh, mesh});
    };
    const vec3 far_away(1e6f, -1e6f, 1e6f);
    using enum Situation::Rays;
    return {
        {"triangles, spheres and planes", [](RandomSource& random) { return reference::mixed(random); }},
        {"a bumpy closed surface", [](RandomSource&) { return of(reference::bumpy_sphere(3)); }},
        {"instances", with_planes},
        {"random triangles", random_mesh},
        {"a closed mesh", [](RandomSource&) { return of(reference::cube_grid(7)); }},
        {"a closed mesh without back faces",
         [](RandomSource&) { return of(reference::cube_grid(5)); },
         1,
         {},
         about,
         true},
        {"slivers", [](RandomSource& random) { return of(reference::slivers(random, kTriangles)); }},
        {"coplanar triangles", [](RandomSource& random) { return of(reference::coplanar_stack(random, kTriangles)); }},
        {"rays in the planes of triangles",
         [](RandomSource& random) { return of(reference::grazing(random, kTriangles, 0).mesh); },
         1,
         {},
         grazing},
        {"degenerate triangles", [](RandomSource& random) { return of(reference::degenerate(random, kTriangles)); }},
        {"duplicated triangles", duplicates},
        {"far away", scaled(1, far_away), 1, far_away},
        {"tiny", scaled(1e-12f, {}), 1e-12f},
        {"huge", scaled(4e11f, {}), 4e11f},
        {"strange rays", [](RandomSource& random) { return reference::mixed(random); }, 1, {}, strange},
        {"a tree in chunks", random_mesh, 1, {}, about, false, true},
        {"no geometry", [](RandomSource&) { return reference::scene_of({}); }},
    };
}

std::vector<Ray> rays_of(const Situation& situation, const Scene& scene, RandomSource& random, std::size_t count) {
    std::vector<Ray> rays;
    if (situation.rays == Situation::Rays::grazing) {
        rays = reference::grazing(random, 1, count).rays;
    } else if (situation.rays == Situation::Rays::strange) {
        const std::vector<Ray> all = reference::strange_rays();
        for (std::size_t i = 0; i < count; ++i)
            rays.push_back(all[random.below(static_cast<std::uint32_t>(all.size()))]);
    } else {
        rays = reference::rays_about(scene, random, count, situation.scale, situation.offset);
    }
    const std::vector<Ray> bundles = reference::bundles_about(rays, random, situation.scale);
    rays.insert(rays.end(), bundles.begin(), bundles.end());
    return rays;
}

/// The device as if it allowed no larger buffer than these scenes' columns need: then trees are cut into chunks.
Device with_small_buffers(Device device) {
    device.max_allocation_bytes = 16 << 10;
    return device;
}

Check against_brute_force(const Situation& situation, Strategy strategy) {
    return {situation.name, [situation, strategy](Patient& patient, Rounds& rounds) -> std::string {
                RandomSource of_scene(patient.seed);
                const Scene scene = situation.scene(of_scene);
                Tracer brute(scene, {patient.device}, options_of(Strategy::brute, situation.cull_back_faces));
                Tracer other(scene, {situation.small_buffers ? with_small_buffers(patient.device) : patient.device},
                             options_of(strategy, situation.cull_back_faces));
                while (const std::size_t size = rounds.next()) {
                    RandomSource random(patient.seed + 1000 * rounds.number());
                    const std::vector<Ray> rays = rays_of(situation, scene, random, size);
                    const std::string wrong = compare(rays, trace(other, rays), trace(brute, rays));
                    if (!wrong.empty()) return wrong;
                }
                return "";
            }};
}

/// What the references of kernel_cases.h say of a ray and all primitives of a scene.
class Judge {
public:
    explicit Judge(RandomSource& random) {
        scene_ = reference::scene_of({reference::random_triangles(random, 40, 0.5f)});
        for (const vec3& p : scene_.meshes[0].positions) triangles_.emplace_back(p, 0.0f);
        for (int i = 0; i < 12; ++i) {
            const vec3 center = random.in_box(-1, 1);
            scene_.spheres.push_back({center, random.uniform_float(0.05f, 0.4f), 0, 0});
            spheres_.emplace_back(center, scene_.spheres.back().radius);
        }
        for (int i = 0; i < 4; ++i) {
            const vec3 point = random.in_box(-1, 1);
            scene_.planes.push_back({point, random.direction(), 0, 0});
            planes_.emplace_back(point, 0.0f);
            planes_.emplace_back(scene_.planes.back().normal, 0.0f);
        }
    }

    const Scene& scene() const { return scene_; }

    /// Where the nearest hit may lie, and what each primitive may do.
    struct Opinion {
        double least_t = INFINITY, greatest_t = INFINITY;
        std::vector<Verdict> of;
    };
    Opinion opinion(const Ray& ray) const {
        Opinion opinion;
        judge(opinion, "intersect_triangle", ray, triangles_);
        judge(opinion, "intersect_sphere", ray, spheres_);
        judge(opinion, "intersect_plane", ray, planes_);
        for (const Verdict& verdict : opinion.of) {
            if (verdict.may_hit) opinion.least_t = std::min(opinion.least_t, verdict.least_t);
            if (verdict.must_hit) opinion.greatest_t = std::min(opinion.greatest_t, verdict.greatest_t);
        }
        return opinion;
    }
    static bool allows(const Opinion& opinion, const Hit& hit) {
        if (hit.primitive == CASTOR_INVALID_INDEX) return std::isinf(opinion.greatest_t);
        if (hit.primitive >= opinion.of.size()) return false;
        const Verdict& verdict = opinion.of[hit.primitive];
        return hit.instance == 0 && hit.t >= opinion.least_t && hit.t <= opinion.greatest_t && verdict.may_hit &&
               hit.t >= verdict.least_t && hit.t <= verdict.greatest_t;
    }

private:
    static void judge(Opinion& opinion, std::string_view name, const Ray& ray, const std::vector<glm::vec4>& rows) {
        const auto function = std::find_if(kTestedFunctions.begin(), kTestedFunctions.end(),
                                           [&](const TestedFunction& f) { return f.name == name; });
        for (std::size_t row = 0; row < rows.size(); row += function->rows)
            opinion.of.push_back(function->judge(ray, &rows[row]));
    }

    Scene scene_;
    std::vector<glm::vec4> triangles_, spheres_, planes_;
};

std::string against_double_precision(Patient& patient, Rounds& rounds) {
    RandomSource of_scene(patient.seed);
    const Judge judge(of_scene);
    Tracer brute(judge.scene(), {patient.device}, options_of(Strategy::brute));
    while (const std::size_t size = rounds.next()) {
        const std::vector<Ray> rays = make_case_rays(size, patient.seed + rounds.number());
        const Answers found = trace(brute, rays);
        const std::string wrong = first_wrong(
            rays, found,
            [&](std::size_t i) {
                return is_proper(rays[i], found.hits[i], found.occluded[i]) &&
                       Judge::allows(judge.opinion(rays[i]), found.hits[i]);
            },
            [&](std::size_t i) {
                const Judge::Opinion opinion = judge.opinion(rays[i]);
                return fmt::format("by double precision t from {} to {}", opinion.least_t, opinion.greatest_t);
            });
        if (!wrong.empty()) return wrong;
    }
    return "";
}

/// The side of an edge on which a ray passes is exact.
std::string exact_edges(Patient& patient, Rounds& rounds, Strategy strategy) {
    constexpr float kRounding = 1e-5f;
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(size, 1024));
        const reference::NearEdges input = reference::near_edges(random, count);
        Tracer tracer(reference::scene_of({input.mesh}), {patient.device}, options_of(strategy));
        std::vector<Ray> rays;
        for (std::uint32_t i = 0; i < count; ++i)
            rays.push_back(reference::make_ray({0, 0, static_cast<float>(i)}, {0, 0, 1}, 0, 1));
        const Answers found = trace(tracer, rays);
        const std::string wrong = first_wrong(
            rays, found,
            [&](std::size_t i) {
                const Hit& hit = found.hits[i];
                return is_proper(rays[i], hit, found.occluded[i]) &&
                       (input.inside[i] ? std::fabs(hit.t - 0.5f) < kRounding && hit.primitive == i
                                        : hit.primitive == CASTOR_INVALID_INDEX);
            },
            [&](std::size_t i) {
                return input.inside[i] ? fmt::format("t about 0.5, primitive {}", i) : std::string("a miss");
            });
        if (!wrong.empty()) return wrong;
    }
    return "";
}

std::string strange_rays_miss(Patient& patient, Rounds& rounds) {
    Tracer tracer(of(reference::cube_grid(4)), {patient.device}, options_of(Strategy::brute));
    std::vector<Ray> none;
    for (const Ray& ray : reference::strange_rays())
        if (!reference::is_number(ray)) none.push_back(ray);
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < size; ++i)
            rays.push_back(none[random.below(static_cast<std::uint32_t>(none.size()))]);
        const Answers found = trace(tracer, rays);
        const std::string wrong = first_wrong(
            rays, found,
            [&](std::size_t i) {
                return found.hits[i].primitive == CASTOR_INVALID_INDEX &&
                       is_proper(rays[i], found.hits[i], found.occluded[i]);
            },
            [](std::size_t) { return std::string("a miss: it is no ray"); });
        if (!wrong.empty()) return wrong;
    }
    return "";
}

/// Crossings are those of brute force, and a closed mesh has evenly many from outside, oddly many from inside.
std::string crossings(Patient& patient, Rounds& rounds, Strategy strategy) {
    constexpr std::size_t kLimit = 4;
    constexpr float kNearSurface = 1e-3f;  // of the cube [-1, 1]^3
    const Scene scene = of(reference::cube_grid(7));
    Tracer brute(scene, {patient.device}, options_of(Strategy::brute));
    Tracer other(scene, {patient.device}, options_of(strategy));
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        std::vector<Ray> rays = reference::rays_about(scene, random, size);
        std::vector<std::uint32_t> counts(size), expected(size), listed(size);
        std::vector<Hit> first(kLimit * size), expected_first(kLimit * size);
        for (Ray& ray : rays) {
            ray.t_min = 0.0f;
            ray.t_max = INFINITY;
        }
        brute.list_crossings(rays, kLimit, expected_first, expected);
        other.list_crossings(rays, kLimit, first, listed);
        other.count_crossings(rays, counts);
        for (std::size_t i = 0; i < size; ++i) {
            const vec3 distance = glm::abs(reference::origin_of(rays[i]));
            const float farthest = std::max({distance.x, distance.y, distance.z});
            const bool is_odd = farthest < 1.0f;
            const bool has_parity = std::fabs(farthest - 1.0f) > kNearSurface && reference::is_number(rays[i]);
            if (has_parity && counts[i] % 2 != (is_odd ? 1 : 0))
                return fmt::format("{} crosses a closed mesh {} times, expected an {} number",
                                   reference::to_text(rays[i]), counts[i], is_odd ? "odd" : "even");
            if (counts[i] != expected[i] || listed[i] != expected[i])
                return fmt::format("{} has {} crossings counted and {} listed; by brute force {}",
                                   reference::to_text(rays[i]), counts[i], listed[i], expected[i]);
            if (std::memcmp(&first[kLimit * i], &expected_first[kLimit * i], kLimit * sizeof(Hit)) != 0)
                return fmt::format("{} has other first crossings than by brute force", reference::to_text(rays[i]));
        }
    }
    return "";
}

std::string golden_picture(Patient& patient, Strategy strategy) {
    const Scene scene = golden_scene();
    Renderer renderer(scene, {patient.device},
                      {.strategy = strategy, .deadline_seconds = kNoDeadline, .stop_deadline_seconds = kNoDeadline});
    const std::uint64_t found = film_checksum(renderer.render(scene.cameras[0], golden_options()));
    if (found == kGoldenChecksum) return "";
    return fmt::format("the checksum of the picture is {:#018x}, expected {:#018x}", found, kGoldenChecksum);
}

}  // namespace

std::vector<Check> strategy_checks(Strategy strategy) {
    std::vector<Check> checks;
    if (strategy == Strategy::brute) {
        checks.push_back({"triangles, spheres and planes", against_double_precision});
        checks.push_back({"rays that are none", strange_rays_miss});
    } else {
        for (const Situation& situation : situations())
            if (!situation.small_buffers || strategy != Strategy::simt)  // whose tree is not cut
                checks.push_back(against_brute_force(situation, strategy));
    }
    checks.push_back({"the exact sides of edges",
                      [strategy](Patient& patient, Rounds& rounds) { return exact_edges(patient, rounds, strategy); }});
    checks.push_back({"the crossings of a closed mesh",
                      [strategy](Patient& patient, Rounds& rounds) { return crossings(patient, rounds, strategy); }});
    checks.push_back(
        {"the golden picture", [strategy](Patient& patient, Rounds&) { return golden_picture(patient, strategy); }});
    return checks;
}

}  // namespace castor::doctor
