// castor build: reads a scene file and writes a built one, from which render, trace and info start at once.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "base/atomic_file.h"
#include "base/stopwatch.h"
#include "castor/built_scene.h"
#include "castor/error.h"
#include "commands.h"
#include "interrupt.h"
#include "memory_options.h"
#include "report.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr const char* kBuildFooter =
    R"(The file holds the scene's columns and the trees that the devices traverse, with checksums, for this version of
the format and this byte order. castor render, trace and info take it as SCENE. They map the file, and a device
that shares the host's memory uses it in place. Do not change it while it is in use; castor build replaces a file
in one step.

Examples:
  castor build lucy.ply -o lucy.castor
  castor build hall.xml -o hall.castor --quality high --device all)";

struct BuildCommandOptions {
    std::string scene;
    std::string output;
    std::string device;
    std::string strategy = "auto";
    std::string quality = "medium";
    bool use_profiles = true;
    std::optional<std::uint64_t> memory_limit;
    DeviceLimits device_limits;
    bool strict = false;
    LoadOptions load;
    ReportOptions report;
};

void check_files(const BuildCommandOptions& options) {
    std::error_code ignored;
    if (fs::equivalent(options.scene, options.output, ignored))
        throw UsageError(fmt::format("--output: {} would be overwritten, and it is read", options.scene));
    check_writable(options.output);
}

/// Returns a warning for each device that has too little memory to render the scene, as castor render would say. With
/// `strict` this is the DeviceError that castor render would throw.
std::vector<Warning> check_devices(const SceneInput& input, MemoryRequest request, bool strict) {
    for (const Camera& camera : input.scene.cameras)
        request.pictures.push_back({camera, {}, input.scene.lights.size()});
    MemoryPlan plan = plan_memory(input, request);
    plan.erase(plan.begin());  // the host's, for pictures of which there are none here
    if (strict) check_memory(plan);
    std::vector<Warning> warnings;
    for (const MemoryBudget& budget : plan) {
        const std::string reason = shortage(budget);
        if (reason.empty()) continue;
        const std::string text =
            fmt::format("is built for other devices or limits, since {} cannot render it: {}", budget.owner, reason);
        const auto is_known = [&](const Warning& warning) { return warning.text == text; };  // parts of one device
        if (std::none_of(warnings.begin(), warnings.end(), is_known)) warnings.push_back({input.scene.file, 0, text});
    }
    print_warnings(warnings);
    return warnings;
}

ExitStatus run(const BuildCommandOptions& options) {
    const BuildOptions build_options{strategy_from_string(options.strategy), tree_quality_from_string(options.quality),
                                     options.use_profiles};
    const std::vector<Device> devices = select_devices(options.device, options.device_limits);
    check_files(options);
    catch_interrupts();

    const Stopwatch load_watch;
    if (is_built_scene(options.scene))
        throw SceneError(options.scene, 0, "is a built scene; one that is not built was expected");
    SceneInput input =
        read_scene_input(options.scene, build_options.quality, {options.report.quiet, options.strict, options.load});
    const double load_seconds = load_watch.seconds();
    const MemoryRequest request{.devices = devices,
                                .strategy = build_options.strategy,
                                .use_profiles = options.use_profiles,
                                .quality = build_options.quality,
                                .limit = options.memory_limit};
    MemoryPlan memory = plan_memory(input, request);
    memory.resize(1);  // only the host's budget: nothing is uploaded
    if (!options.report.quiet) note_memory(memory);
    check_memory(memory);
    const std::vector<Warning> of_devices = check_devices(input, request, options.strict);
    input.build(devices, build_options, options.report.quiet);
    const BuiltScene& built = *input.built;
    const std::vector<Warning>& of_geometry = contents_of(built).arrays().warnings;
    print_warnings(of_geometry);
    std::vector<Warning> warnings = input.scene.warnings;
    warnings.insert(warnings.end(), of_devices.begin(), of_devices.end());
    warnings.insert(warnings.end(), of_geometry.begin(), of_geometry.end());
    const Stopwatch write_watch;
    {
        Phase phase("writing " + options.output, options.report.quiet);
        built.save(options.output, phase.hook());
    }
    const double write_seconds = write_watch.seconds();

    const std::uint64_t bytes = fs::file_size(options.output);
    if (!options.report.quiet) {
        note("seconds: load {:.3f}, flatten {:.3f}, build {:.3f}, write {:.3f}", load_seconds, built.flatten_seconds(),
             built.build_seconds(), write_seconds);
        note("{}: {}", fs::absolute(options.output).string(), byte_count(bytes));
    }
    if (options.report.json)
        print_json({{"scene", options.scene},
                    {"file", fs::absolute(options.output).string()},
                    {"bytes", bytes},
                    {"quality", options.quality},
                    {"memory", json_of(memory)},
                    {"seconds",
                     {{"load", load_seconds},
                      {"flatten", built.flatten_seconds()},
                      {"build", built.build_seconds()},
                      {"write", write_seconds}}},
                    {"warnings", json_of(warnings)}});
    return ExitStatus::done;
}

}  // namespace

void add_build(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("build", "Build a scene's trees and save all, to be rendered without reading or building");
    const auto options = std::make_shared<BuildCommandOptions>();
    command->add_option("SCENE", options->scene, "scene (.xml, .json) or mesh (.ply, .obj)")->required();
    command->add_option("-o,--output", options->output, "file to write")->required();
    command->add_option("--device", options->device, "the devices whose trees are built, as in castor render");
    command->add_option("--strategy", options->strategy, "the strategy whose tree is built instead (brute: none)")
        ->capture_default_str();
    command
        ->add_option("--quality", options->quality,
                     "how much work goes into the tree: medium, or high, which takes longer and makes rays faster")
        ->capture_default_str();
    add_memory_option(*command, options->memory_limit);
    add_device_limit_options(*command, options->device_limits);
    add_profile_option(*command, options->use_profiles);
    add_load_options(*command, options->load);
    add_strict_option(*command, options->strict);
    add_report_options(*command, options->report);
    command->footer(kBuildFooter);
    command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace castor::cli
