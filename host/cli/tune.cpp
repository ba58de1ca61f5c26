// castor tune: finds out what is fastest on a device, and stores it for later runs.
#include <CLI/CLI.hpp>
#include <memory>

#include "base/atomic_file.h"
#include "castor/error.h"
#include "castor/generated_scenes.h"
#include "castor/tuner.h"
#include "commands.h"
#include "interrupt.h"
#include "number_check.h"
#include "report.h"
#include "scene_input.h"
#include "trace/device_file.h"
#include "trace/profile_file.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr const char* kTuneFooter =
    R"(Tries strategies for each kind of ray, sizes of launches and groups, and how many rays a work-item traces
interleaved. SCENE is a file or a generated scene as for "castor bench"; without any, scan:200000, interior:50000
and objects:100000 are used. A change is taken if it is faster and every answer has the same bits as with the
defaults; some of these are compared with brute force.

The result is stored in $XDG_STATE_HOME/castor/profiles or ~/.local/state/castor/profiles (CASTOR_PROFILE_DIR names
another folder; if it is empty, profiles are off), and all commands use it. It changes the speed, never a hit. It is for
one device, driver and version of Castor; "castor devices" says whether it is in use. To forget it, delete the file.
Ctrl-C keeps the old one.

Examples:
  castor tune
  castor tune --device all --dry-run
  castor tune bunny.ply --seconds 20 --json)";

struct TuneCommandOptions {
    std::vector<std::string> scenes;
    std::string device;
    std::uint32_t size = 0;
    double seconds = 60.0;
    std::uint32_t seed = 1;
    bool dry_run = false;
    ReportOptions report;
};

std::vector<NamedScene> make_scenes(std::vector<std::string> names, bool quiet) {
    if (names.empty()) names = {"scan:200000", "interior:50000", "objects:100000"};
    std::vector<NamedScene> scenes;
    for (const std::string& name : names) {
        const std::optional<GeneratedScene> generated = generated_scene_from_string(name);
        scenes.push_back({name, generated ? generate_scene(*generated) : read_scene(name, quiet)});
    }
    return scenes;
}

/// Returns the file for the profile. Throws, before the work begins, if it cannot be written.
fs::path prepare_file(const Device& device) {
    const fs::path file = profile_file(device);
    if (file.empty())
        throw UsageError(
            "there is no folder for profiles: CASTOR_PROFILE_DIR is empty, or there is no home; --dry-run needs none");
    make_device_folder(file);
    check_writable(file);
    return file;
}

Json document(const Trial& trial) {
    Json document = {{"name", trial.name},
                     {"value", trial.value},
                     {"outcome", std::string(to_string(trial.outcome))},
                     {"time", nullptr}};
    if (trial.time > 0.0) document["time"] = trial.time;
    if (!trial.problem.empty()) document["problem"] = trial.problem;
    return document;
}

Json document(const Device& device, const TunerResult& result, const fs::path& file, bool written) {
    Json trials = Json::array();
    for (const Trial& trial : result.trials) trials.push_back(document(trial));
    return {{"device", json_of(device)},
            {"profile", json_of(result.tuning, device)},
            {"defaults", json_of(result.defaults, device)},
            {"time", result.time},
            {"file", file.string()},
            {"written", written},
            {"all_tried", result.all_tried},
            {"checked_rays", result.checked_rays},
            {"checked_against_brute_force", result.brute_checked_rays},
            {"seconds", result.seconds},
            {"trials", std::move(trials)}};
}

std::string summary(const Device& device, const TunerResult& result, const fs::path& file, bool written) {
    const std::string gain =
        result.tuning == result.defaults
            ? std::string("the defaults are the best that was found")
            : fmt::format("rays take {:.2f} of the time that they take with the defaults", result.time);
    return fmt::format(
        "{}\n"
        "   result   {}\n"
        "   profile  {}\n"
        "   checked  {} answers of each trial, {} of them by brute force\n"
        "   file     {}\n",
        describe(device), gain, describe(result.tuning, device), result.checked_rays, result.brute_checked_rays,
        written ? file.string() : "none: --dry-run");
}

TunerOptions tuner_options(const TuneCommandOptions& options, const Device& device) {
    TunerOptions tuner;
    tuner.size = options.size ? options.size : device.type == DeviceType::gpu ? 1024 : 256;
    tuner.seconds = options.seconds;
    tuner.seed = options.seed;
    tuner.go_on = [] { return !interrupted(); };
    const bool quiet = options.report.quiet;
    tuner.on_stage = [quiet](const std::string& stage) {
        if (!quiet) note("  {}", stage);
    };
    tuner.on_trial = [quiet](const Trial& trial) {
        const std::string time = trial.time > 0.0 ? fmt::format("time {:.2f}", trial.time) : "";
        // Faults are printed even with --quiet.
        if (!trial.problem.empty())
            note("warning: {} {} is not taken: {}", trial.name, trial.value, trial.problem);
        else if (!quiet)
            note("  {:<20} {:<16} {:<9} {}", trial.name, trial.value, time, to_string(trial.outcome));
    };
    return tuner;
}

ExitStatus run(const TuneCommandOptions& options) {
    if (options.size % 8 != 0)
        throw UsageError(fmt::format("--size: {} is no multiple of 8: rays are made in tiles of 8 x 8", options.size));
    const std::vector<Device> devices = castor::select_devices(options.device);
    std::vector<fs::path> files;
    for (const Device& device : devices) files.push_back(options.dry_run ? profile_file(device) : prepare_file(device));
    catch_interrupts();
    const std::vector<NamedScene> scenes = make_scenes(options.scenes, options.report.quiet);

    Json documents = Json::array();
    for (std::size_t i = 0; i < devices.size() && !interrupted(); ++i) {
        const Device& device = devices[i];
        print_warnings(tuning_in_use(device, false).warnings);
        if (!options.report.quiet) note("{}: about {:.0f} seconds", describe(device), options.seconds);
        const TunerResult result = tune_device(device, scenes, tuner_options(options, device));
        if (!result.finished) break;
        if (!result.all_tried)
            note("warning: time ran out after {} trials; --seconds gives more", result.trials.size());
        if (!options.dry_run) write_profile(files[i], device, result.tuning);
        if (options.report.json)
            documents.push_back(document(device, result, files[i], !options.dry_run));
        else
            print_text(summary(device, result, files[i], !options.dry_run));
    }
    if (interrupted()) note("interrupted: the profile of the device that was being measured is as it was");
    if (options.report.json) print_json(Json{{"castor_version", CASTOR_VERSION}, {"devices", std::move(documents)}});
    return interrupted() ? ExitStatus::interrupted : ExitStatus::done;
}

}  // namespace

void add_tune(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("tune", "Find out what is fastest on a device, and store it");
    const auto options = std::make_shared<TuneCommandOptions>();
    command->add_option("SCENE", options->scenes, "scene files, or generated scenes (see below)");
    command->add_option(
        "--device", options->device,
        "index, type (cpu, gpu), part of a name, \"all\", or several with commas between, one after the other; "
        "else the first GPU, else the first device");
    command->add_option("--seconds", options->seconds, "seconds for each device, after which no further trial begins")
        ->check(number_in(0.0, 86400.0))
        ->capture_default_str();
    command
        ->add_option("--size", options->size,
                     "N: N x N primary rays, and as many random ones; a multiple of 8; else 256, on a GPU 1024")
        ->check(CLI::Range(8u, 8192u));
    command->add_option("--seed", options->seed, "seed of the random, diffuse and checked rays")->capture_default_str();
    command->add_flag("--dry-run", options->dry_run, "measure, but store nothing");
    add_report_options(*command, options->report);
    command->footer(kTuneFooter);
    command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace castor::cli
