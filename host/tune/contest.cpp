#include "tune/contest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <span>

#include "castor/error.h"
#include "tune/resident_batch.h"

namespace castor {

namespace {

/// The number of tests of a ray against a primitive that brute force may take.
constexpr std::size_t kBruteTests = 200000000;
constexpr std::size_t kLeastSample = 4, kMostSample = 4096;

std::string text(const Ray& ray) {
    return fmt::format("origin {} {} {}, t_min {}, direction {} {} {}, t_max {}", ray.origin[0], ray.origin[1],
                       ray.origin[2], ray.t_min, ray.direction[0], ray.direction[1], ray.direction[2], ray.t_max);
}

std::string text(const Hit& hit, Query query) {
    if (query == Query::any) return hit.primitive == CASTOR_INVALID_INDEX ? "a miss" : "a hit";
    return fmt::format("t {} u {} v {} primitive {} instance {}", hit.t, hit.u, hit.v, hit.primitive, hit.instance);
}

void check_equal(const Contender& contender, const RaySet& set, std::size_t ray, const Hit& found, const Hit& expected,
                 std::string_view expected_of) {
    if (std::memcmp(&found, &expected, sizeof(Hit)) == 0) return;
    throw DeviceError(contender.device.name, "", 0,
                      fmt::format("wrong answer: {} rays, strategy {}, ray {} ({}): found {}, but {} finds {}",
                                  to_string(set.kind), to_string(contender.tracer->strategy(set.hint, set.query)), ray,
                                  text(set.rays[ray]), text(found, set.query), expected_of, text(expected, set.query)));
}

std::vector<std::size_t> draw_sample(std::size_t ray_count, std::size_t primitives, std::uint32_t seed) {
    const std::size_t affordable =
        std::clamp(kBruteTests / std::max<std::size_t>(primitives, 1), kLeastSample, kMostSample);
    std::vector<std::size_t> sample(std::min(affordable, ray_count));
    std::mt19937_64 generator(seed);
    for (std::size_t& ray : sample) ray = generator() % ray_count;
    return sample;
}

/// Returns how many rays were compared: none if `go_on` returns false.
std::size_t check_against_brute_force(Tracer& brute, std::size_t primitive_count, const Contender& contender,
                                      const RaySet& set, const std::vector<Hit>& answers, std::uint32_t seed,
                                      const std::function<bool()>& go_on) {
    const std::vector<std::size_t> sample = draw_sample(set.rays.size(), primitive_count, seed);
    std::vector<Ray> rays;
    for (const std::size_t ray : sample) rays.push_back(set.rays[ray]);
    ResidentBatch batch(brute, contender.device, rays, set.query, set.hint);
    if (!batch.run(go_on)) return 0;
    const std::vector<Hit> expected = batch.hits();
    for (std::size_t i = 0; i < sample.size(); ++i)
        check_equal(contender, set, sample[i], answers[sample[i]], expected[i], "brute force");
    return sample.size();
}

/// Traces once more with the kernels that count, whose answers must be the same.
TraceWork count_work(const Contender& contender, const RaySet& set, const std::vector<Hit>& expected) {
    Tracer& tracer = *contender.tracer;
    std::vector<Hit> hits(set.rays.size());
    TraceWork work;
    if (set.query == Query::closest) {
        work = tracer.count_closest_hit(set.rays, hits, set.hint);
    } else {
        std::vector<std::uint8_t> occluded(set.rays.size());
        work = tracer.count_any_hit(set.rays, occluded, set.hint);
        hits = hits_of_occlusion(occluded);
    }
    for (std::size_t i = 0; i < hits.size(); ++i)
        check_equal(contender, set, i, hits[i], expected[i], "the kernel that does not count");
    return work;
}

}  // namespace

std::vector<Contender> make_contenders(const Scene& scene, const std::vector<Device>& devices,
                                       const std::vector<Strategy>& strategies, TreeQuality quality,
                                       bool use_profiles) {
    std::vector<Contender> contenders;
    for (const Device& device : devices)
        for (const Strategy strategy : strategies)
            contenders.push_back(
                {device, strategy,
                 std::make_unique<Tracer>(
                     scene, std::vector{device},
                     TracerOptions{.strategy = strategy, .quality = quality, .use_profiles = use_profiles})});
    return contenders;
}

ContestResult run_contest(Tracer& brute, std::size_t primitive_count, const std::vector<Contender>& contenders,
                          const RaySet& set, std::uint32_t repeat, std::uint32_t seed,
                          const std::function<bool()>& go_on) {
    ContestResult result;
    result.scores.resize(contenders.size());
    std::vector<ResidentBatch> batches;
    std::vector<Hit> expected;
    for (std::size_t c = 0; c < contenders.size(); ++c) {
        const Contender& contender = contenders[c];
        batches.emplace_back(*contender.tracer, contender.device, set.rays, set.query, set.hint);
        if (!batches.back().run(go_on)) return result;
        const std::vector<Hit> answers = batches.back().hits();
        if (c == 0) {
            result.brute_checked =
                check_against_brute_force(brute, primitive_count, contender, set, answers, seed, go_on);
            expected = answers;
        }
        const std::string first =
            fmt::format("strategy {} on {}", to_string(contenders[0].tracer->strategy(set.hint, set.query)),
                        contenders[0].device.name);
        for (std::size_t i = 0; i < answers.size(); ++i) check_equal(contender, set, i, answers[i], expected[i], first);
        if (!go_on()) return result;
        result.scores[c].work = count_work(contender, set, answers);
        result.scores[c].hits = std::count_if(answers.begin(), answers.end(),
                                              [](const Hit& hit) { return hit.primitive != CASTOR_INVALID_INDEX; });
    }
    for (ResidentBatch& batch : batches)
        if (!batch.run(go_on)) return result;
    for (std::uint32_t i = 0; i < repeat; ++i)
        for (std::size_t c = 0; c < batches.size(); ++c) {
            const std::optional<double> seconds = batches[c].run(go_on);
            if (!seconds) return result;
            result.scores[c].seconds.push_back(*seconds);
        }
    return result;
}

}  // namespace castor
