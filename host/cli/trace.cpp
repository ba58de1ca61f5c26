// castor trace: reads a file of rays and writes a file of hits.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "base/atomic_file.h"
#include "base/stopwatch.h"
#include "castor/error.h"
#include "castor/tracer.h"
#include "commands.h"
#include "hits_part.h"
#include "interrupt.h"
#include "memory_options.h"
#include "number_check.h"
#include "part.h"
#include "ray_file.h"
#include "report.h"
#include "scene_input.h"
#include "team.h"
#include "trace/remote_batch.h"
#include "trace/scene_contents.h"
#include "tune/resident_batch.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr const char* kTraceFooter =
    R"(Ray file: eight little-endian float32 a ray: origin xyz, t_min, direction xyz, t_max. t is in units of the
direction's length.
Hit file: twenty bytes a ray: t, u, v as float32, primitive, instance as uint32. A miss has t = infinity and primitive =
instance = 0xffffffff. `primitive` counts triangles in file order, then spheres, then planes.
With --query any, an occluded ray has t = u = v = 0 and primitive = instance = 0; any other ray has a miss.

--query count and list are about crossings: points where a ray passes through a surface. Of triangles that share an edge
one is crossed there, a sphere where the ray enters and where it leaves. With count the file has four bytes a ray: how
many crossings there are, as uint32. With list --limit N these come first, then N hits of each ray: its first crossings
by t, instance and primitive, and misses if it has fewer. Without --limit the counts come first, then all crossings of
the first ray, of the second, and so on.

Times: one run warms up, then each repeat is timed. With one device, rays and hits lie in its memory, and the time is
that of the query alone. With several devices, or one to which the scene is streamed, it includes copying rays and hits;
so does that of count and list.
Ctrl-C ends the repeats; if it comes before the end of the first run, no hits are written.

--part i/n answers the i-th of n parts of the rays. The file then also says which rays these are, and castor merge makes
a hit file of all parts.

Examples:
  castor trace bunny.ply --rays rays.bin --hits hits.bin
  castor trace bunny.ply --rays shadow.bin --hits hits.bin --query any --repeat 5 --json
  castor trace bunny.ply --rays rays.bin --hits part2 --part 2/8
  castor trace bunny.ply --rays rays.bin --hits counts.bin --query count
  castor trace bunny.ply --rays rays.bin --hits first4.bin --query list --limit 4)";

struct TraceCommandOptions {
    std::string scene;
    std::string rays;
    std::string hits;
    std::string device;
    std::string query = "closest";
    std::optional<std::uint32_t> limit;  // of --query list; none: all crossings
    std::string hint = "incoherent";
    std::string strategy = "auto";
    std::string quality = "medium";
    std::optional<std::string> part;
    std::uint32_t repeat = 1;
    bool cull_back_faces = false;
    bool use_profiles = true;
    bool distributes_scene = false;
    double deadline_seconds = TracerOptions().deadline_seconds;
    std::optional<std::uint64_t> memory_limit;
    DeviceLimits device_limits;
    bool strict = false;
    LoadOptions load;
    ReportOptions report;
};

/// Throws UsageError if the file of hits would overwrite an input file.
void check_files(const TraceCommandOptions& options) {
    for (const std::string& input : {options.scene, options.rays}) {
        std::error_code ignored;
        if (fs::equivalent(input, options.hits, ignored) && fs::is_regular_file(input, ignored))
            throw UsageError(fmt::format("--hits: {} would be overwritten, and it is read", input));
    }
    check_writable(options.hits);
}

struct Timing {
    std::vector<double> seconds;  // one for each repeat

    double best() const { return seconds.empty() ? 0.0 : *std::min_element(seconds.begin(), seconds.end()); }
    double mrays_per_second(std::size_t rays) const { return best() > 0.0 ? double(rays) / best() / 1e6 : 0.0; }
};

struct Traced {
    RayAnswers answers;
    Timing timing;
    std::vector<DeviceShare> shares;
};

/// What all rays are asked.
struct Question {
    Query query;
    std::optional<std::uint32_t> limit;
    Coherence hint;

    bool is_of_crossings() const { return query == Query::count || query == Query::list; }
};

std::string text_of(const Question& question) {
    const std::string query(to_string(question.query));
    return question.limit ? fmt::format("{}, {} of a ray at most", query, *question.limit) : query;
}

/// Returns how many rays hit or cross anything.
std::size_t count_hits(const RayAnswers& answers) {
    if (!answers.counts.empty())
        return std::count_if(answers.counts.begin(), answers.counts.end(),
                             [](std::uint32_t count) { return count > 0; });
    return std::count_if(answers.hits.begin(), answers.hits.end(),
                         [](const Hit& hit) { return hit.primitive != CASTOR_INVALID_INDEX; });
}

std::uint64_t count_crossings(const RayAnswers& answers) {
    return std::accumulate(answers.counts.begin(), answers.counts.end(), std::uint64_t{0});
}

/// Returns the JSON document. `traced` is nullopt if a signal came before all rays were answered.
Json document(const TraceCommandOptions& options, const std::vector<Device>& devices, const Tracer& tracer,
              const Question& question, std::size_t rays, const std::optional<Traced>& traced, std::size_t hit_rays,
              std::uint64_t crossings, const std::vector<Warning>& warnings, const Team* team) {
    const Timing timing = traced ? traced->timing : Timing();
    return {{"scene", options.scene},
            {"rays", rays},
            {"hits", traced ? Json(hit_rays) : Json()},
            {"crossings", traced && question.is_of_crossings() ? Json(crossings) : Json()},
            {"device", names_of(devices)},
            {"devices", json_of(devices)},
            {"shares", json_of(traced ? traced->shares : tracer.shares())},
            {"strategy", std::string(to_string(tracer.strategy(question.hint, question.query)))},
            {"query", options.query},
            {"limit", options.limit ? Json(*options.limit) : Json()},
            {"hint", options.hint},
            {"build_seconds", tracer.build_seconds()},
            {"setup_seconds", tracer.setup_seconds()},
            {"seconds", timing.seconds},
            {"mrays_per_second", timing.mrays_per_second(rays)},
            {"traffic", team ? json_of(team->traffic()) : Json()},
            {"warnings", json_of(warnings)}};
}

/// Runs once to warm up, then `repeat` times. `run` returns its seconds, or nullopt after a signal, which ends the
/// repeats. Returns nullopt if the first run did not answer all rays.
template <class Run>
std::optional<Timing> time_runs(std::uint32_t repeat, const Run& run) {
    if (!run()) return std::nullopt;
    Timing timing;
    for (std::uint32_t i = 0; i < repeat; ++i) {
        const std::optional<double> seconds = run();
        if (!seconds) break;
        timing.seconds.push_back(*seconds);
    }
    return timing;
}

bool go_on() {
    return !interrupted();
}

/// Answers the rays, together with the manager's workers if there is one. Returns whether all rays are answered; if
/// not, and `answers` held them before, it does so still.
bool answer(Tracer& tracer, std::span<const Ray> rays, const Question& question, RayAnswers& answers,
            Manager* manager = nullptr) {
    const auto& [query, limit, hint] = question;
    if (question.is_of_crossings()) answers.counts.resize(rays.size());
    switch (query) {
        case Query::closest:
            answers.hits.resize(rays.size());
            return manager ? trace_together(tracer, rays, answers.hits, hint, go_on, *manager)
                           : tracer.closest_hit(rays, answers.hits, hint, go_on);
        case Query::any: {
            std::vector<std::uint8_t> occluded(rays.size());
            const bool is_complete = manager ? trace_together(tracer, rays, occluded, hint, go_on, *manager)
                                             : tracer.any_hit(rays, occluded, hint, go_on);
            if (is_complete) answers.hits = hits_of_occlusion(occluded);
            return is_complete;
        }
        case Query::count:
            return manager ? count_together(tracer, rays, answers.counts, hint, go_on, *manager)
                           : tracer.count_crossings(rays, answers.counts, hint, go_on);
        case Query::list:
            break;
    }
    if (limit) {
        answers.hits.resize(rays.size() * *limit);
        return manager ? list_together(tracer, rays, *limit, answers.hits, answers.counts, hint, go_on, *manager)
                       : tracer.list_crossings(rays, *limit, answers.hits, answers.counts, hint, go_on);
    }
    std::optional<CrossingLists> all = tracer.list_all_crossings(rays, hint, go_on);
    if (!all) return false;
    for (std::size_t i = 0; i < rays.size(); ++i)
        answers.counts[i] = static_cast<std::uint32_t>(all->first[i + 1] - all->first[i]);
    answers.hits = std::move(all->crossings);
    return true;
}

/// Traces on one device, with rays and hits in its memory while time is taken. The scene must not stream.
std::optional<Traced> trace_on_one(Tracer& tracer, const Device& device, std::span<const Ray> rays,
                                   const Question& question, std::uint32_t repeat) {
    // This first ray compiles the kernels in a thread of its own, for which Ctrl-C does not wait.
    RayAnswers first;
    if (!rays.empty() && !answer(tracer, rays.first(1), question, first)) return std::nullopt;
    ResidentBatch batch(tracer, device, rays, question.query, question.hint);
    DeviceShare share;
    share.device = tracer.shares().at(0).device;
    share.setup_seconds = tracer.shares().at(0).setup_seconds;
    const std::optional<Timing> timing = time_runs(repeat, [&] {
        const std::optional<double> seconds = batch.run(go_on);
        if (seconds) {
            ++share.tiles;
            share.rays += rays.size();
            share.busy_seconds += *seconds;
        }
        return seconds;
    });
    if (!timing) return std::nullopt;
    return Traced{{{}, batch.hits()}, *timing, {share}};
}

/// Traces on several devices, which get rays by their speeds and take over the rays of a device that fails.
std::optional<Traced> trace_on_several(Tracer& tracer, std::span<const Ray> rays, const Question& question,
                                       std::uint32_t repeat, Manager* manager) {
    RayAnswers answers;
    const std::optional<Timing> timing = time_runs(repeat, [&]() -> std::optional<double> {
        const Stopwatch watch;
        if (!answer(tracer, rays, question, answers, manager)) return std::nullopt;
        return watch.seconds();
    });
    if (!timing) return std::nullopt;
    return Traced{std::move(answers), *timing, tracer.shares()};
}

TracerOptions tracer_options_of(const TraceCommandOptions& options, const Team* team) {
    return {.strategy = strategy_from_string(options.strategy),
            .cull_back_faces = options.cull_back_faces,
            .quality = tree_quality_from_string(options.quality),
            .use_profiles = options.use_profiles,
            .deadline_seconds = options.deadline_seconds,
            .stop_deadline_seconds = kStopDeadlineSeconds,
            .scene_share = options.distributes_scene ? team->scene_share() : SceneShare()};
}

Coherence hint_of(const TraceCommandOptions& options) {
    return options.hint == "coherent" ? Coherence::coherent : Coherence::incoherent;
}

Question question_of(const TraceCommandOptions& options) {
    return {query_from_string(options.query), options.limit, hint_of(options)};
}

/// Throws UsageError where options do not go together.
void check_question(const TraceCommandOptions& options, const Team* team) {
    const Question question = question_of(options);
    if (options.limit && question.query != Query::list)
        throw UsageError(fmt::format("--limit is for --query list, and the query is {}", options.query));
    if (question.query != Query::list || options.limit) return;
    if (options.part)
        throw UsageError("--part takes --query list with --limit only: castor merge needs as many of each ray");
    if (team) throw UsageError("castor-mpi takes --query list with --limit only");
}

ExitStatus run(const TraceCommandOptions& options, Team* team) {
    const TracerOptions tracer_options = tracer_options_of(options, team);
    const Question question = question_of(options);
    const std::vector<Device> devices =
        select_devices(options.device, options.device_limits, team ? team->host() : std::string());
    const Part part = options.part ? parse_part(*options.part) : Part();
    const std::vector<Ray> all_rays = read_rays(options.rays);
    const std::uint64_t first = all_rays.size() * (part.number - 1) / part.count;
    const std::uint64_t end = all_rays.size() * part.number / part.count;
    const std::span<const Ray> rays = std::span(all_rays).subspan(first, end - first);
    check_files(options);
    catch_interrupts();
    SceneInput input =
        read_scene_input(options.scene, tracer_options.quality, {options.report.quiet, options.strict, options.load});

    check_memory(plan_memory(input, {.devices = devices,
                                     .strategy = tracer_options.strategy,
                                     .use_profiles = options.use_profiles,
                                     .quality = tracer_options.quality,
                                     .limit = options.memory_limit}));
    prepare_scene(input, options.scene, devices,
                  {tracer_options.strategy, tracer_options.quality, options.use_profiles}, team,
                  options.distributes_scene, options.report.quiet);
    auto tracer = input.make<Tracer>(devices, tracer_options, options.report.quiet);
    print_warnings(tracer.warnings());
    if (question.limit) tracer.list_crossings({}, *question.limit, {}, {});  // throws where no ray's would fit
    Manager* const manager = team ? &team->gather(devices, options.deadline_seconds, options.report.quiet) : nullptr;
    if (!options.report.quiet) note("tracing {} rays", rays.size());
    const bool is_resident = devices.size() == 1 && !tracer.streams() && !manager && !question.is_of_crossings();
    std::optional<Traced> traced = is_resident ? trace_on_one(tracer, devices[0], rays, question, options.repeat)
                                               : trace_on_several(tracer, rays, question, options.repeat, manager);
    for (const DeviceShare& share : tracer.shares())
        if (!share.failure.empty())
            note("warning: {}; the device is dropped", share.failure);
        else if (share.left_busy > 0 && !interrupted())
            note("warning: {} was still busy when a run was done, and was not waited for", share.device);
    const std::size_t hit_rays = traced ? count_hits(traced->answers) : 0;
    const std::uint64_t crossings = traced ? count_crossings(traced->answers) : 0;
    if (traced && options.part)
        save_hits_part(options.hits, {describe_batch(contents_of(*input.built).fingerprint, all_rays, text_of(question),
                                                     options.cull_back_faces),
                                      all_rays.size(), first, rays.size(), std::move(traced->answers)});
    else if (traced)
        write_answers(options.hits, traced->answers);

    if (!options.report.quiet) {
        for (std::size_t i = 0; i < devices.size(); ++i)
            note("device: {}, strategy {}", describe(devices[i]),
                 to_string(tracer.strategy(question.hint, question.query, i)));
        if (traced && traced->shares.size() > 1) note_shares(traced->shares);
        note("seconds: build {:.3f}, setup {:.3f}", tracer.build_seconds(), tracer.setup_seconds());
        if (traced)
            note("{} of {} rays {}, {:.1f} Mray/s in the best of {} runs, {:.6f} s: {}", hit_rays, rays.size(),
                 question.is_of_crossings() ? fmt::format("cross {} times", crossings) : "hit",
                 traced->timing.mrays_per_second(rays.size()), traced->timing.seconds.size(), traced->timing.best(),
                 fs::absolute(options.hits).string());
        if (team) note_traffic(team->traffic());
    }
    if (options.report.json) {
        std::vector<Warning> warnings = input.scene.warnings;
        warnings.insert(warnings.end(), tracer.warnings().begin(), tracer.warnings().end());
        print_json(
            document(options, devices, tracer, question, rays.size(), traced, hit_rays, crossings, warnings, team));
    }
    if (!traced) {
        note("interrupted before all rays were answered: no hits are written");
        return ExitStatus::interrupted;
    }
    const std::size_t runs = traced->timing.seconds.size();
    if (runs == options.repeat) return ExitStatus::done;
    note("interrupted: the hits are written, {} of {} repeats are timed", runs, options.repeat);
    return ExitStatus::interrupted;
}

/// Traces for the team's leader, which has the same command line.
ExitStatus serve(const TraceCommandOptions& options, Team& team) {
    return serve_team<Tracer>(
        team, options.device, options.device_limits, options.deadline_seconds,
        [&](const SceneInput& input, const std::vector<Device>& devices) {
            return input.make<Tracer>(devices, tracer_options_of(options, &team), true);
        },
        [&](Tracer& tracer, const Scene&, RankServer& server) {
            const Question question = question_of(options);
            while (serve_trace(tracer, question.query, question.limit.value_or(0), question.hint, server)) continue;
        });
}

}  // namespace

void add_trace(CLI::App& app, Action& action, Team* team) {
    CLI::App* command = app.add_subcommand("trace", "Find the hits of a file of rays");
    const auto options = std::make_shared<TraceCommandOptions>();
    command->add_option("SCENE", options->scene, kSceneHelp)->required();
    command->add_option("--rays", options->rays, "file of rays to read")->required();
    command->add_option("--hits", options->hits, "file of hits to write")->required();
    command
        ->add_option("--query", options->query,
                     "closest: the nearest hit; any: whether there is one; count: how many crossings; list: which ones")
        ->check(CLI::IsMember({"closest", "any", "count", "list"}))
        ->capture_default_str();
    command->add_option("--limit", options->limit, "of --query list: the first so many crossings of each ray; else all")
        ->check(CLI::Range(1u, 0xffffffffu));
    command
        ->add_option("--hint", options->hint,
                     "whether neighbouring rays are close and alike; may change the speed, never the hits")
        ->check(CLI::IsMember({"coherent", "incoherent"}))
        ->capture_default_str();
    command->add_option("--part", options->part,
                        "i/n: only the i-th of n parts of the rays, from 1 on, for castor merge");
    command->add_option("--repeat", options->repeat, "timed runs")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    command->add_option("--strategy", options->strategy, "how rays find hits (auto, brute ...); the hits are the same")
        ->capture_default_str();
    command
        ->add_option("--quality", options->quality,
                     "how much work goes into the tree: medium, or high, which takes longer and makes rays faster; the "
                     "hits are the same")
        ->capture_default_str();
    command->add_option(
        "--device", options->device,
        "index, type (cpu, gpu), part of a name, \"all\", or several with commas between; else the first GPU, "
        "else the first device");
    command
        ->add_option("--deadline", options->deadline_seconds,
                     "seconds after which a device that does not answer is dropped")
        ->check(number_in(0.1, 1e9))
        ->capture_default_str();
    command->add_flag("--cull-back-faces", options->cull_back_faces, "flat triangles seen from behind are not hit");
    add_memory_option(*command, options->memory_limit);
    add_device_limit_options(*command, options->device_limits);
    add_profile_option(*command, options->use_profiles);
    add_load_options(*command, options->load);
    add_strict_option(*command, options->strict);
    add_report_options(*command, options->report);
    if (team) add_distribute_option(*command, options->distributes_scene);
    command->footer(kTraceFooter);
    command->callback([options, &action, team] {
        action = [options, team] {
            check_question(*options, team);
            return team && !team->leads() ? serve(*options, *team) : run(*options, team);
        };
    });
}

}  // namespace castor::cli
