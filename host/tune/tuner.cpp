#include "castor/tuner.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <span>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "castor/ray_sets.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/scene_contents.h"
#include "trace/strategy.h"

namespace castor {

namespace {

/// A change is taken if it saves more than this share of the time; less may be chance.
constexpr double kLeastGain = 0.03;
/// The runs of each contender. After kFirstLook of them, one that takes kHopeless times as long is given up.
constexpr int kRounds = 7, kFirstLook = 2;
constexpr double kHopeless = 1.3;
/// Brute force checks as many rays of each set as these tests of a ray against a primitive allow, within the two
/// limits.
constexpr std::size_t kBruteTests = 20000000, kLeastSample = 16, kMostSample = 1024;

/// Rays on the device, and the expected answers.
struct Workload {
    std::string name;
    Query query;
    Coherence hint;
    std::size_t ray_count;
    std::vector<Ray> rays;
    cl::Buffer ray_buffer;
    cl::Buffer answer_buffer;
    std::vector<std::byte> expected;

    std::size_t answer_bytes() const { return query == Query::closest ? sizeof(Hit) : 1; }
};

/// A scene with its rays on the device, once for each kind of tree: a binary tree is built differently if a wide tree
/// is made from it too.
struct ResidentScene {
    SceneContents prepared_compressed, prepared_wide;
    std::optional<DeviceScene> compressed, wide;
    std::vector<Workload> workloads;
};

/// The kernels of a tuning for one scene, by kind of tree.
struct SceneKernels {
    SceneKernels(DeviceContext& context, const ResidentScene& resident, const Tuning& tuning)
        : scene(&resident),
          strategies(tuning.strategies),
          compressed(context, *resident.compressed, tuning),
          wide(context, *resident.wide, tuning) {}

    void enqueue(DeviceContext& context, const Workload& load, const cl::Buffer& rays, const cl::Buffer& answers,
                 std::size_t count) {
        const bool walks_wide = walks_wide_tree(strategies.of(load.query, load.hint));
        TraceKernels& kernels = walks_wide ? wide : compressed;
        const DeviceScene& columns = walks_wide ? *scene->wide : *scene->compressed;
        if (load.query == Query::closest)
            kernels.closest_hit(context.queue(), columns, TraceKernels::RayBuffers::records(rays),
                                TraceKernels::Hits(answers), 0, count, 0, load.hint);
        else
            kernels.any_hit(context.queue(), columns, TraceKernels::RayBuffers::records(rays),
                            TraceKernels::Occluded(answers), 0, count, 0, load.hint);
    }

    const ResidentScene* scene;
    StrategyChoice strategies;
    TraceKernels compressed, wide;
};

std::string difference(const Workload& load, std::span<const std::byte> found, std::span<const std::byte> expected) {
    for (std::size_t i = 0; i * load.answer_bytes() < expected.size(); ++i)
        if (std::memcmp(&found[i * load.answer_bytes()], &expected[i * load.answer_bytes()], load.answer_bytes()) != 0)
            return fmt::format("{}: the answer to ray {} of {} is wrong", load.name, i,
                               expected.size() / load.answer_bytes());
    return "";
}

class Tuner {
public:
    Tuner(const Device& device, const std::vector<NamedScene>& scenes, const TunerOptions& options)
        : device_(device), options_(options), space_(tuning_space(device)), context_(device) {
        // tuning_in_use respects the doctor's verdict; the stored profile is ignored.
        const TuningInUse defaults = tuning_in_use(device, false);
        if (defaults.diagnosis)
            std::erase_if(space_.strategies, [&](Strategy s) { return defaults.diagnosis->quarantines(s); });
        if (space_.strategies.empty())
            throw DeviceError(device.name, "", 0,
                              "there is nothing to tune: \"castor doctor\" found all strategies wrong");
        result_.tuning = result_.defaults = defaults.tuning;
        for (const NamedScene& scene : scenes)
            if (goes_on()) add_scene(scene);
    }

    TunerResult run() {
        if (goes_on()) check_defaults();
        result_.all_tried = try_strategies() && try_numbers();
        if (goes_on() && result_.tuning != result_.defaults) compare_with_defaults();
        result_.finished = goes_on();
        result_.seconds = watch_.seconds();
        return std::move(result_);
    }

private:
    using Kernels = std::vector<SceneKernels>;
    using Seconds = std::vector<double>;  // one for each workload: the least of all rounds

    bool goes_on() const { return !options_.go_on || options_.go_on(); }
    void tell(const std::string& stage) const {
        if (options_.on_stage) options_.on_stage(stage);
    }

    void add_scene(const NamedScene& named) {
        tell(fmt::format("{}: building the trees, making rays", named.name));
        auto resident = std::make_unique<ResidentScene>();
        resident->prepared_compressed = build_scene(named.scene, {StrategyChoice::all(Strategy::simt)});
        resident->compressed.emplace(context_, resident->prepared_compressed);
        resident->prepared_wide = build_scene(named.scene, {StrategyChoice::all(Strategy::wide)});
        resident->wide.emplace(context_, resident->prepared_wide);
        Tracer tracer(named.scene, {device_}, {.use_profiles = false});
        for (RaySet& set : make_ray_sets(named.scene, tracer, {std::begin(kRayKinds), std::end(kRayKinds)},
                                         options_.size, options_.seed)) {
            // Ambient occlusion asks for any hit of diffuse rays.
            if (set.kind == RayKind::diffuse)
                add_workload(*resident, named.name + ", ambient rays", Query::any, set.hint, set.rays);
            add_workload(*resident, fmt::format("{}, {} rays", named.name, to_string(set.kind)), set.query, set.hint,
                         std::move(set.rays));
        }
        scenes_.push_back(std::move(resident));
    }

    void add_workload(ResidentScene& resident, std::string name, Query query, Coherence hint, std::vector<Ray> rays) {
        if (rays.empty()) return;
        Workload load{std::move(name), query, hint, rays.size(), std::move(rays), {}, {}, {}};
        load.ray_buffer = context_.make_buffer(load.ray_count * sizeof(Ray), "rays");
        load.answer_buffer = context_.make_buffer(load.ray_count * load.answer_bytes(), "answers");
        context_.write(load.ray_buffer, load.rays.data(), load.ray_count * sizeof(Ray));
        result_.checked_rays += load.ray_count;
        resident.workloads.push_back(std::move(load));
    }

    /// Stores the defaults' answers as the expected ones, after comparing some with brute force.
    void check_defaults() {
        tell("comparing the defaults with brute force");
        Tuning brute_tuning = result_.defaults;
        brute_tuning.strategies = StrategyChoice::all(Strategy::brute);
        std::mt19937_64 generator(options_.seed);
        Kernels kernels = kernels_of(result_.defaults);
        for (SceneKernels& scene_kernels : kernels) {
            SceneKernels brute(context_, *scene_kernels.scene, brute_tuning);
            for (Workload& load : scenes_[&scene_kernels - kernels.data()]->workloads) {
                if (!goes_on()) return;
                load.expected = answers(scene_kernels, load);
                const SceneCounts& counts = scene_kernels.scene->prepared_wide.counts;
                const std::size_t primitives = counts.triangles + counts.spheres + counts.planes;
                std::vector<std::size_t> sample(std::min(
                    load.ray_count,
                    std::clamp(kBruteTests / std::max<std::size_t>(primitives, 1), kLeastSample, kMostSample)));
                for (std::size_t& ray : sample) ray = generator() % load.ray_count;
                check_sample(brute, load, sample);
            }
        }
    }

    void check_sample(SceneKernels& brute, const Workload& load, const std::vector<std::size_t>& sample) {
        std::vector<Ray> rays;
        std::vector<std::byte> expected(sample.size() * load.answer_bytes()), found(expected.size());
        for (std::size_t i = 0; i < sample.size(); ++i) {
            rays.push_back(load.rays[sample[i]]);
            std::memcpy(&found[i * load.answer_bytes()], &load.expected[sample[i] * load.answer_bytes()],
                        load.answer_bytes());
        }
        const cl::Buffer ray_buffer = context_.make_buffer(rays.size() * sizeof(Ray), "rays");
        const cl::Buffer answer_buffer = context_.make_buffer(expected.size(), "answers");
        context_.write(ray_buffer, rays.data(), rays.size() * sizeof(Ray));
        brute.enqueue(context_, load, ray_buffer, answer_buffer, rays.size());
        context_.read(answer_buffer, expected.data(), expected.size());
        result_.brute_checked_rays += sample.size();
        const std::string wrong = difference(load, found, expected);
        if (!wrong.empty()) throw DeviceError(device_.name, "", 0, "the defaults differ from brute force: " + wrong);
    }

    std::vector<std::byte> answers(SceneKernels& kernels, const Workload& load) {
        std::vector<std::byte> bytes(load.ray_count * load.answer_bytes());
        kernels.enqueue(context_, load, load.ray_buffer, load.answer_buffer, load.ray_count);
        context_.read(load.answer_buffer, bytes.data(), bytes.size());
        return bytes;
    }

    Kernels kernels_of(const Tuning& tuning) {
        Kernels kernels;
        for (const auto& scene : scenes_) kernels.emplace_back(context_, *scene, tuning);
        return kernels;
    }

    /// Tries strategies, first for all kinds of rays at once, one kind of tree after the other, because a scene with
    /// both takes twice the memory; then, with the better tree, for each kind of rays by itself. Returns false if time
    /// ran out, as try_numbers does.
    bool try_strategies() {
        const auto is_allowed = [&](Strategy strategy) {
            return std::count(space_.strategies.begin(), space_.strategies.end(), strategy) > 0;
        };
        std::vector<StrategyChoice> whole;
        if (is_allowed(Strategy::simt)) whole.push_back(StrategyChoice::all(Strategy::simt));
        if (is_allowed(Strategy::wide) && is_allowed(Strategy::packet))
            whole.push_back({Strategy::wide, Strategy::packet, Strategy::wide, Strategy::packet});
        for (const StrategyChoice& choice : whole) {
            Tuning tuning = result_.tuning;
            tuning.strategies = choice;
            if (!attempt("strategies", choice.uses(Strategy::simt) ? "simt" : "wide and packet", tuning)) return false;
        }
        const bool is_wide = walks_wide_tree(result_.tuning.strategies.closest_incoherent);
        for (const auto& [kind, name] : kRayKindsOfChoice)
            for (const Strategy strategy : space_.strategies) {
                if (walks_wide_tree(strategy) != is_wide) continue;
                Tuning tuning = result_.tuning;
                tuning.strategies.*kind = strategy;
                if (!attempt(std::string(name), std::string(to_string(strategy)), tuning)) return false;
            }
        return true;
    }

    bool try_numbers() {
        const bool is_wide = walks_wide_tree(result_.tuning.strategies.closest_incoherent);
        for (const TuningNumber& number : space_.numbers) {
            const bool of_wide = number.value == &Tuning::wide_lanes || number.value == &Tuning::wide_batch;
            const bool of_simt = number.value == &Tuning::local_size;
            if ((of_wide && !is_wide) || (of_simt && is_wide)) continue;
            const std::uint32_t before = result_.tuning.*number.value;
            for (const std::uint32_t value : number.allowed) {
                if (value == before) continue;  // the value that replaced it was faster
                Tuning tuning = result_.tuning;
                tuning.*number.value = value;
                if (!attempt(std::string(number.name), std::to_string(value), tuning)) return false;
            }
        }
        return true;
    }

    /// Tries a tuning and takes it if its answers are right and it is faster. Returns false if there was no time.
    bool attempt(std::string name, std::string value, const Tuning& tuning) {
        if (tuning == result_.tuning) return true;
        if (!goes_on() || watch_.seconds() > options_.seconds) return false;
        Trial trial{std::move(name), std::move(value), Trial::Outcome::refused, 0.0, ""};
        try {
            Kernels candidate = kernels_of(tuning);
            trial.problem = first_wrong(candidate, tuning);
            if (!trial.problem.empty()) {
                trial.outcome = Trial::Outcome::wrong_hits;
            } else if (goes_on()) {
                Kernels best = kernels_of(result_.tuning);
                trial.time = time_of(candidate, tuning, best);
                trial.outcome = trial.time < 1.0 - kLeastGain ? Trial::Outcome::taken : Trial::Outcome::slower;
            }
        } catch (const DeviceError& error) {
            trial.problem = error.what();  // a lost device fails in later trials too, and at last with the defaults
        }
        if (!goes_on()) return false;
        if (trial.outcome == Trial::Outcome::taken) result_.tuning = tuning;
        if (options_.on_trial) options_.on_trial(trial);
        result_.trials.push_back(std::move(trial));
        return true;
    }

    /// Returns whether the workload's rays are traced differently with this tuning than with the best so far.
    bool differs(const Tuning& tuning, const Workload& load) const {
        Tuning other = tuning;
        other.strategies = result_.tuning.strategies;
        return other != result_.tuning ||
               tuning.strategies.of(load.query, load.hint) != result_.tuning.strategies.of(load.query, load.hint);
    }

    /// Returns what is wrong with the candidate's answers, or nothing. Also warms up.
    std::string first_wrong(Kernels& candidate, const Tuning& tuning) {
        for (SceneKernels& kernels : candidate)
            for (const Workload& load : kernels.scene->workloads) {
                if (!goes_on()) return "";
                if (!differs(tuning, load)) continue;
                const std::string wrong = difference(load, answers(kernels, load), load.expected);
                if (!wrong.empty()) return wrong;
            }
        return "";
    }

    /// Returns the geometric mean, over workloads that are traced differently, of the candidate's least time relative
    /// to that of the best so far. Both take turns.
    double time_of(Kernels& candidate, const Tuning& tuning, Kernels& best) {
        Seconds candidate_seconds, best_seconds;
        for (int round = 0; round < kRounds && goes_on(); ++round) {
            std::size_t next = 0;
            for (std::size_t s = 0; s < candidate.size(); ++s)
                for (const Workload& load : candidate[s].scene->workloads) {
                    if (!differs(tuning, load)) continue;
                    note_least(best_seconds, next, best[s], load);
                    note_least(candidate_seconds, next, candidate[s], load);
                    ++next;
                }
            if (round + 1 >= kFirstLook && mean_ratio(candidate_seconds, best_seconds) > kHopeless) break;
        }
        return mean_ratio(candidate_seconds, best_seconds);
    }

    void note_least(Seconds& seconds, std::size_t at, SceneKernels& kernels, const Workload& load) {
        if (at >= seconds.size()) seconds.resize(at + 1, std::numeric_limits<double>::infinity());
        const Stopwatch watch;
        kernels.enqueue(context_, load, load.ray_buffer, load.answer_buffer, load.ray_count);
        context_.finish();
        seconds[at] = std::min(seconds[at], watch.seconds());
    }

    static double mean_ratio(const Seconds& numerator, const Seconds& denominator) {
        double sum = 0.0;
        for (std::size_t i = 0; i < numerator.size(); ++i) sum += std::log(numerator[i] / denominator[i]);
        return numerator.empty() ? 1.0 : std::exp(sum / static_cast<double>(numerator.size()));
    }

    /// Compares the result with the defaults: changes taken step by step must be faster together, or the defaults stay.
    void compare_with_defaults() {
        tell("comparing the result with the defaults");
        const Tuning tuned = std::exchange(result_.tuning, result_.defaults);
        Kernels candidate = kernels_of(tuned), best = kernels_of(result_.tuning);
        if (!first_wrong(candidate, tuned).empty()) return;
        const double time = time_of(candidate, tuned, best);
        if (time > 1.0 - kLeastGain) return;
        result_.tuning = tuned;
        result_.time = time;
    }

    Device device_;
    const TunerOptions& options_;
    TuningSpace space_;
    Stopwatch watch_;
    DeviceContext context_;
    std::vector<std::unique_ptr<ResidentScene>> scenes_;
    TunerResult result_;
};

}  // namespace

std::string_view to_string(Trial::Outcome outcome) {
    switch (outcome) {
        case Trial::Outcome::taken:
            return "taken";
        case Trial::Outcome::slower:
            return "no faster";
        case Trial::Outcome::wrong_hits:
            return "wrong hits";
        case Trial::Outcome::refused:
            break;
    }
    return "refused";
}

TunerResult tune_device(const Device& device, const std::vector<NamedScene>& scenes, const TunerOptions& options) {
    if (scenes.empty()) throw UsageError("there is no scene to tune with");
    if (options.size == 0 || options.size % 8 != 0)
        throw UsageError(fmt::format("the size {} is no positive multiple of 8", options.size));
    return Tuner(device, scenes, options).run();
}

}  // namespace castor
