// castor bench: measures rays a second, with checked answers.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <span>

#include "base/atomic_file.h"
#include "castor/error.h"
#include "castor/generated_scenes.h"
#include "castor/ray_sets.h"
#include "castor/roofs.h"
#include "commands.h"
#include "interrupt.h"
#include "machine.h"
#include "memory_options.h"
#include "report.h"
#include "scene_input.h"
#include "tune/contest.h"
#include "tune/kernel_bench.h"
#include "tune/work_per_ray.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr const char* kBenchFooter =
    R"(SCENE is a file (.xml, .ply, .obj) or a generated scene: scan, interior, objects or spheres, alone or with its
number of primitives, such as scan:1000000; instances:1000, which is a thousand placements of one scan of a
million triangles; or instances:1000x50000, with scans of 50000 triangles. Without SCENE, the set "standard" is
measured: the first four.

Rays: primary (of the first camera, in blocks of 8 x 8 pixels), shadow (from the primary hits to a point light; any
hit), diffuse (from the primary hits, distributed by the cosine), random (anywhere in the box of the scene).

Answers are checked before anything is timed: some against brute force, and those of every device and strategy against
the first one's, for all rays and bit by bit. A wrong answer ends the command with status 4. Then devices and strategies
take turns. A run is timed from the first enqueue to the end, with rays and answers on the device.

nodes and tests: the number of nodes of the tree, and of primitives (or leaf blocks of four), against which a ray is
tested. An instrumented build of the same kernels counts them outside the timing; a test of a bundle of rays counts
once. memory and flops: the best rate as a share of the device's limits, measured with kernels of our own: bytes read
and written over the memory's bandwidth, which caches may exceed, and operations over the rate of fma. The JSON document
states bytes and operations of each test.

--kernels measures device functions by themselves: the three triangle tests, sphere, plane, box, ray generation,
shading. Their answers are compared with a reference in double precision first.

Examples:
  castor bench --scene-set small --size 256
  castor bench bunny.ply scan:1000000 --rays primary,shadow --strategy wide,packet --device all
  castor bench interior --json > interior.json
  castor bench spheres --save-rays rays/
  castor bench --kernels --device all)";

struct BenchCommandOptions {
    std::vector<std::string> scenes;
    std::string scene_set;
    std::vector<std::string> rays = {"primary", "shadow", "diffuse", "random"};
    std::vector<std::string> strategies = {"auto"};
    std::string quality = "medium";
    std::string device;
    std::uint32_t size = 512;
    std::uint32_t repeat = 7;
    std::uint32_t seed = 1;
    std::string save_rays;
    bool kernels = false;
    bool use_profiles = true;
    DeviceLimits device_limits;
    ReportOptions report;
};

/// The parsed options.
struct Plan {
    std::vector<std::string> scenes;
    std::vector<RayKind> kinds;
    std::vector<Strategy> strategies;
    TreeQuality quality = TreeQuality::medium;
    std::vector<Device> devices;
};

Plan make_plan(const BenchCommandOptions& options) {
    Plan plan;
    if (options.size % 8 != 0)
        throw UsageError(fmt::format("--size: {} is no multiple of 8: rays are made in tiles of 8 x 8", options.size));
    for (const std::string& word : options.rays) plan.kinds.push_back(ray_kind_from_string(word));
    for (const std::string& word : options.strategies) plan.strategies.push_back(strategy_from_string(word));
    plan.quality = tree_quality_from_string(options.quality);
    plan.devices = select_devices(options.device, options.device_limits);
    if (options.kernels) return plan;
    plan.scenes = options.scenes;
    if (!options.scene_set.empty() || options.scenes.empty()) {
        const std::vector<std::string> set = scene_set(options.scene_set.empty() ? "standard" : options.scene_set);
        plan.scenes.insert(plan.scenes.end(), set.begin(), set.end());
    }
    for (const std::string& scene : plan.scenes) generated_scene_from_string(scene);  // throws for a wrong count
    return plan;
}

Scene make_scene(const std::string& name, bool quiet) {
    const std::optional<GeneratedScene> generated = generated_scene_from_string(name);
    return generated ? generate_scene(*generated) : read_scene(name, quiet);
}

/// The folder where rays are saved, each scene under a name of its own. Saves nothing if the folder's name is empty.
class RayFolder {
public:
    explicit RayFolder(const std::string& folder) : folder_(folder) {
        if (!folder.empty()) fs::create_directories(folder_);
    }

    /// Saves the geometry of a generated scene. Returns the file of the scene's geometry.
    std::string begin_scene(const std::string& name, const Scene& scene) {
        const bool is_generated = generated_scene_from_string(name).has_value();
        if (folder_.empty()) return is_generated ? "" : name;
        std::string stem = is_generated ? name : fs::path(name).stem().string();
        std::replace(stem.begin(), stem.end(), ':', '-');
        for (stem_ = stem; !used_.insert(stem_).second;) stem_ = fmt::format("{}-{}", stem, used_.size());
        return is_generated ? save_generated_scene(folder_ / stem_, scene).string() : name;
    }

    std::string save(const RaySet& set) const {
        if (folder_.empty()) return "";
        const fs::path file = folder_ / fmt::format("{}.{}.rays", stem_, to_string(set.kind));
        write_file_atomically(file, std::as_bytes(std::span(set.rays)));
        return file.string();
    }

private:
    fs::path folder_;
    std::string stem_;
    std::set<std::string> used_;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

double millions_per_second(std::size_t rays, double seconds) {
    return seconds > 0.0 ? static_cast<double>(rays) / seconds / 1e6 : 0.0;
}

struct Measurement {
    std::string scene;
    std::string scene_file;
    std::string ray_file;
    std::size_t triangles = 0, spheres = 0, planes = 0;
    const RaySet* set = nullptr;
    const Contender* contender = nullptr;
    const Score* score = nullptr;
    std::size_t brute_checked = 0;
    Roofs roofs;

    double best_rate() const {
        return millions_per_second(set->rays.size(), *std::min_element(score->seconds.begin(), score->seconds.end()));
    }
    double median_rate() const { return millions_per_second(set->rays.size(), median(score->seconds)); }
    WorkPerRay work() const { return work_per_ray(score->work, set->rays.size(), set->query); }
    double share_of_memory() const { return best_rate() * 1e6 * work().bytes / roofs.bytes_per_second; }
    double share_of_flops() const { return best_rate() * 1e6 * work().flops / roofs.flops_per_second; }
};

Json json_of(const TraceWork& work) {
    Json counts;
    for (const WorkFigures& figures : kWorkFigures) counts[figures.name] = work.*figures.count;
    return counts;
}

Json json_of(const Measurement& m) {
    const Contender& contender = *m.contender;
    const WorkPerRay work = m.work();
    return {{"scene", m.scene},
            {"scene_file", m.scene_file},
            {"triangles", m.triangles},
            {"spheres", m.spheres},
            {"planes", m.planes},
            {"rays", std::string(to_string(m.set->kind))},
            {"ray_file", m.ray_file},
            {"ray_count", m.set->rays.size()},
            {"query", m.set->query == Query::any ? "any" : "closest"},
            {"hint", m.set->hint == Coherence::coherent ? "coherent" : "incoherent"},
            {"device", contender.device.name},
            {"device_index", contender.device.index},
            {"strategy", std::string(to_string(contender.asked))},
            {"strategy_used", std::string(to_string(contender.tracer->strategy(m.set->hint, m.set->query)))},
            {"hits", m.score->hits},
            {"checked_against_brute_force", m.brute_checked},
            {"build_seconds", contender.tracer->build_seconds()},
            {"setup_seconds", contender.tracer->setup_seconds()},
            {"seconds", m.score->seconds},
            {"mrays_per_second", {{"best", m.best_rate()}, {"median", m.median_rate()}}},
            {"nodes_per_ray", work.nodes},
            {"tests_per_ray", work.tests},
            {"bytes_per_ray", work.bytes},
            {"flops_per_ray", work.flops},
            {"work", json_of(m.score->work)},
            {"share_of_roofs", {{"memory", m.share_of_memory()}, {"flops", m.share_of_flops()}}}};
}

Json json_of(const std::vector<Device>& devices, const std::vector<Roofs>& roofs) {
    Json list = Json::array();
    for (std::size_t i = 0; i < devices.size(); ++i)
        list.push_back({{"device_index", devices[i].index},
                        {"device", devices[i].name},
                        {"bytes_per_second", roofs[i].bytes_per_second},
                        {"flops_per_second", roofs[i].flops_per_second}});
    return list;
}

Json json_of_work_figures() {
    Json all;
    for (const WorkFigures& figures : kWorkFigures)
        all[figures.name] = {{"bytes", figures.bytes}, {"flops", figures.flops}};
    all[kRayFigures.name] = {{"bytes", kRayFigures.bytes}, {"flops", kRayFigures.flops}};
    return all;
}

Json make_document(const BenchCommandOptions& options, const Plan& plan, const std::vector<Roofs>& roofs,
                   Json results) {
    const Machine machine = describe_machine();
    return {
        {"castor_version", CASTOR_VERSION},
        {"machine", {{"cpu", machine.cpu}, {"cores", machine.cores}, {"os", machine.os}, {"kernel", machine.kernel}}},
        {"devices", cli::json_of(plan.devices)},
        {"roofs", json_of(plan.devices, roofs)},
        {"work_figures", json_of_work_figures()},
        {"size", options.size},
        {"repeat", options.repeat},
        {"seed", options.seed},
        {"results", std::move(results)}};
}

constexpr const char* kRow = "{:<20} {:<8} {:>9} {:>6}  {:<8} {:>9} {:>9} {:>8} {:>9} {:>7} {:>6}  {}\n";

std::string table_head() {
    return fmt::format(fmt::runtime(kRow), "scene", "rays", "count", "hits", "strategy", "best", "median", "nodes",
                       "tests", "memory", "flops", "device") +
           fmt::format(fmt::runtime(kRow), "", "", "", "", "", "Mray/s", "Mray/s", "/ray", "/ray", "of roof", "", "");
}

std::string roofs_line(const Device& device, const Roofs& roofs) {
    return fmt::format("{}: {:.1f} GB/s, {:.1f} Gflop/s\n", device.name, roofs.bytes_per_second * 1e-9,
                       roofs.flops_per_second * 1e-9);
}

std::string percent(double share) {
    return fmt::format("{:.{}f} %", 100.0 * share, share < 0.0995 ? 1 : 0);
}

std::string table_row(const Measurement& m) {
    const std::string name = m.scene.size() <= 20 ? m.scene : "…" + m.scene.substr(m.scene.size() - 19);
    return fmt::format(fmt::runtime(kRow), name, to_string(m.set->kind), m.set->rays.size(),
                       fmt::format("{:.0f} %", 100.0 * double(m.score->hits) / double(m.set->rays.size())),
                       to_string(m.contender->tracer->strategy(m.set->hint, m.set->query)),
                       fmt::format("{:.2f}", m.best_rate()), fmt::format("{:.2f}", m.median_rate()),
                       fmt::format("{:.2f}", m.work().nodes), fmt::format("{:.2f}", m.work().tests),
                       percent(m.share_of_memory()), percent(m.share_of_flops()), m.contender->device.name);
}

double best_rate(const KernelMeasurement& m) {
    return millions_per_second(m.count, *std::min_element(m.seconds.begin(), m.seconds.end()));
}
double median_rate(const KernelMeasurement& m) {
    return millions_per_second(m.count, median(m.seconds));
}

Json json_of(const KernelMeasurement& m, const Device& device) {
    return {{"kernel", m.kernel},
            {"device", device.name},
            {"device_index", device.index},
            {"unit", m.unit},
            {"count", m.count},
            {"checked", m.checked},
            {"seconds", m.seconds},
            {"millions_per_second", {{"best", best_rate(m)}, {"median", median_rate(m)}}}};
}

constexpr const char* kKernelRow = "{:<26} {:>11} {:<8} {:>9} {:>9}  {}\n";

std::string kernel_table_head() {
    return fmt::format(fmt::runtime(kKernelRow), "kernel", "count", "", "best", "median", "device") +
           fmt::format(fmt::runtime(kKernelRow), "", "", "", "M/s", "M/s", "");
}

std::string kernel_table_row(const KernelMeasurement& m, const Device& device) {
    return fmt::format(fmt::runtime(kKernelRow), m.kernel, m.count, m.unit, fmt::format("{:.1f}", best_rate(m)),
                       fmt::format("{:.1f}", median_rate(m)), device.name);
}

/// The command's work: scene by scene, each figure printed as soon as it is known.
class Bench {
public:
    Bench(const BenchCommandOptions& options, const Plan& plan)
        : options_(options), plan_(plan), folder_(options.save_rays) {}

    void run() {
        for (const Device& device : plan_.devices) {
            roofs_.push_back(measure_roofs(device));
            if (!options_.report.json) print_text(roofs_line(device, roofs_.back()));
        }
        if (options_.kernels) return run_kernels();
        if (!options_.report.json) print_text(table_head());
        for (const std::string& scene : plan_.scenes)
            if (!interrupted()) run_scene(scene);
    }

    Json document() && {
        Json all = make_document(options_, plan_, roofs_, std::move(results_));
        if (options_.kernels) all["kernels"] = std::move(kernels_);
        return all;
    }

private:
    void run_kernels() {
        if (!options_.report.json) print_text(kernel_table_head());
        for (const Device& device : plan_.devices)
            bench_kernels(
                device, options_.size, options_.repeat, options_.seed, [] { return !interrupted(); },
                [&](const KernelMeasurement& m) {
                    if (options_.report.json)
                        kernels_.push_back(json_of(m, device));
                    else
                        print_text(kernel_table_row(m, device));
                });
    }

    void run_scene(const std::string& name) {
        const Scene scene = make_scene(name, options_.report.quiet);
        Measurement m;
        m.scene = name;
        m.scene_file = folder_.begin_scene(name, scene);
        for (const Mesh& mesh : scene.meshes) m.triangles += mesh.triangles.size();
        for (const MeshInstance& instance : scene.instances)
            m.triangles += scene.meshes[instance.mesh].triangles.size();
        m.spheres = scene.spheres.size();
        m.planes = scene.planes.size();
        const std::vector<Contender> contenders =
            make_contenders(scene, plan_.devices, plan_.strategies, plan_.quality, options_.use_profiles);
        Tracer brute(scene, {plan_.devices[0]}, {Strategy::brute});
        for (const RaySet& set :
             make_ray_sets(scene, *contenders[0].tracer, plan_.kinds, options_.size, options_.seed)) {
            if (interrupted()) return;
            m.set = &set;
            m.ray_file = folder_.save(set);
            run_set(brute, contenders, m);
        }
    }

    void run_set(Tracer& brute, const std::vector<Contender>& contenders, Measurement m) {
        if (m.set->rays.empty()) {
            note("{}: there are no {} rays: the camera sees nothing", m.scene, to_string(m.set->kind));
            return;
        }
        const ContestResult contest = run_contest(brute, m.triangles + m.spheres + m.planes, contenders, *m.set,
                                                  options_.repeat, options_.seed, [] { return !interrupted(); });
        m.brute_checked = contest.brute_checked;
        for (std::size_t c = 0; c < contenders.size(); ++c) {
            m.contender = &contenders[c];
            m.roofs = roofs_[c / plan_.strategies.size()];
            m.score = &contest.scores[c];
            if (m.score->seconds.empty()) continue;
            if (options_.report.json)
                results_.push_back(json_of(m));
            else
                print_text(table_row(m));
        }
    }

    const BenchCommandOptions& options_;
    const Plan& plan_;
    RayFolder folder_;
    std::vector<Roofs> roofs_;  // one for each device
    Json results_ = Json::array();
    Json kernels_ = Json::array();
};

ExitStatus run(const BenchCommandOptions& options) {
    const Plan plan = make_plan(options);
    if (options.use_profiles) print_profile_warnings(plan.devices);
    catch_interrupts();
    Bench bench(options, plan);
    bench.run();
    if (options.report.json) print_json(std::move(bench).document());
    return interrupted() ? ExitStatus::interrupted : ExitStatus::done;
}

}  // namespace

void add_bench(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("bench", "Measure how many rays a second are answered");
    const auto options = std::make_shared<BenchCommandOptions>();
    command->add_option("SCENE", options->scenes, "scene files, or generated scenes (see below)");
    command->add_option("--scene-set", options->scene_set, "standard or small: all generated scenes");
    command->add_option("--rays", options->rays, "which rays, with commas between: primary, shadow, diffuse, random")
        ->delimiter(',')
        ->default_str("primary,shadow,diffuse,random");
    command
        ->add_option("--strategy", options->strategies,
                     "one or several with commas between (auto, brute, simt ...); the hits are the same")
        ->delimiter(',')
        ->default_str("auto");
    command
        ->add_option("--quality", options->quality,
                     "how much work goes into the tree: medium, or high, which takes longer and makes rays faster; the "
                     "hits are the same")
        ->capture_default_str();
    command->add_option(
        "--device", options->device,
        "index, type (cpu, gpu), part of a name, \"all\", or several with commas between, each measured by itself; "
        "else the first GPU, else the first device");
    command->add_option("--size", options->size, "N: N x N primary rays, and as many random ones; a multiple of 8")
        ->check(CLI::Range(8u, 8192u))
        ->capture_default_str();
    command->add_option("--repeat", options->repeat, "timed runs of each")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    command->add_option("--seed", options->seed, "of the random, diffuse and checked rays")->capture_default_str();
    command->add_option("--save-rays", options->save_rays,
                        "folder for the rays, and for the geometry of generated scenes, as files");
    CLI::Option* kernels =
        command->add_flag("--kernels", options->kernels, "measure single device functions instead of scenes");
    for (const char* other : {"SCENE", "--scene-set", "--rays", "--strategy", "--save-rays"})
        kernels->excludes(command->get_option(other));
    add_device_limit_options(*command, options->device_limits);
    add_profile_option(*command, options->use_profiles);
    add_report_options(*command, options->report);
    command->footer(kBenchFooter);
    command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace castor::cli
