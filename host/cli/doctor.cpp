// castor doctor: finds out whether an OpenCL driver can be trusted.
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/atomic_file.h"
#include "base/host_memory.h"
#include "castor/error.h"
#include "commands.h"
#include "doctor/examination.h"
#include "doctor/probe.h"
#include "interrupt.h"
#include "number_check.h"
#include "report.h"
#include "trace/device_file.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;
using doctor::Examination;
using doctor::ExaminationOptions;
using doctor::FoundDevice;
using doctor::Listing;
using doctor::PartOutcome;

constexpr const char* kDoctorFooter =
    R"(Examines each device in processes of its own, so that a driver that crashes or hangs is reported. Checks
arithmetic, struct layouts, queues and memory; the kernels' functions against double precision; brute force
likewise; every strategy against brute force, on ordinary and nasty geometry; and a small picture, bit for bit.

The verdict is: trusted, trusted except some strategies, or not usable. It is stored in $XDG_STATE_HOME/castor/doctor or
~/.local/state/castor/doctor, for this driver and this version of Castor (CASTOR_PROFILE_DIR names another folder in
place of castor; if it is empty, nothing is stored). A strategy that failed is then not chosen automatically, and every
command warns of it, until the doctor finds nothing wrong. The exit status is 0 if all is well, else 4.

Examples:
  castor doctor
  castor doctor --device gpu --json
  castor doctor --seconds 300 --seed 2 --dry-run)";

struct DoctorCommandOptions {
    std::string device = "all";
    double seconds = 12.0;
    double patience = 180.0;
    std::optional<std::uint64_t> memory;
    std::uint32_t seed = 1;
    bool dry_run = false;
    std::string probe;               // set in a child process: "list", or the index of a device
    std::vector<std::string> parts;  // the parts to examine: for child processes, and for tests
    ReportOptions report;
};

ExitStatus run_probe(const DoctorCommandOptions& options) {
    if (options.probe == "list")
        doctor::list_devices_to_parent();
    else
        doctor::examine_for_parent(std::stoul(options.probe), options.parts, options.seconds, options.seed);
    return ExitStatus::done;
}

/// Three quarters of what is left: a compiler that takes all of it would stop whatever else the machine does.
std::uint64_t memory_for_a_step() {
    return available_host_memory() / 4 * 3;
}

/// Returns the file for the diagnosis. Throws, before the work begins, if it cannot be written.
fs::path prepare_file(const Device& device, bool dry_run) {
    const fs::path file = dry_run ? fs::path() : diagnosis_file(device);
    if (file.empty()) return file;
    make_device_folder(file);
    check_writable(file);
    return file;
}

std::vector<FoundDevice> selected(const Listing& listing, const std::string& selection) {
    std::vector<Device> devices;
    for (const FoundDevice& found : listing.devices) devices.push_back(found.device);
    std::vector<FoundDevice> patients;
    for (const Device& device : select_devices(devices, selection)) patients.push_back(listing.devices[device.index]);
    return patients;
}

Json document(const Device& device, const Examination& examination, const fs::path& file) {
    Json document = json_of(examination.diagnosis);
    document["device"] = json_of(device);
    for (const PartOutcome& part : examination.parts) document["parts"][part.name] = part.passed ? "passed" : "failed";
    document["remarks"] = examination.remarks;
    document["seconds"] = examination.seconds;
    document["file"] = file.empty() ? Json() : Json(file.string());
    return document;
}

std::string summary(const Device& device, const Examination& examination, const fs::path& file) {
    const auto names = [&](bool passed) {
        std::vector<std::string> list;
        for (const PartOutcome& part : examination.parts)
            if (part.passed == passed) list.push_back(part.name);
        return list.empty() ? std::string("none") : fmt::format("{}", fmt::join(list, ", "));
    };
    std::string text = fmt::format("{}: {}\n   passed   {}\n   failed   {}\n", describe(device),
                                   verdict(examination.diagnosis), names(true), names(false));
    for (const Fault& fault : examination.diagnosis.faults)
        text += fmt::format("   {:<8} {}\n", fault.strategy ? to_string(*fault.strategy) : "fault", fault.reason);
    for (const std::string& remark : examination.remarks) text += fmt::format("   note     {}\n", remark);
    text += fmt::format("   driver   {}\n   kept in  {}\n", device.driver_version,
                        file.empty() ? "no file" : file.string());
    return text;
}

ExitStatus run(const DoctorCommandOptions& options) {
    if (!options.probe.empty()) return run_probe(options);
    if (options.device.find('/') != std::string::npos)
        throw UsageError(
            fmt::format("--device: \"{}\" names parts of devices; castor doctor looks at whole ones", options.device));
    catch_interrupts();
    const ExaminationOptions examination_options{options.seconds,
                                                 {options.patience, options.memory.value_or(memory_for_a_step())},
                                                 options.seed,
                                                 options.parts,
                                                 [&](const std::string& step) {
                                                     if (!options.report.quiet) note("  {}", step);
                                                 },
                                                 [] { return !interrupted(); }};
    const Listing listing = doctor::list_patients(examination_options);
    if (interrupted()) return ExitStatus::interrupted;
    for (const std::string& problem : listing.problems) note("castor: {}", problem);
    bool all_well = listing.problems.empty();
    // Without any device, select_devices says what to install, unless another reason is known.
    const std::vector<FoundDevice> patients =
        listing.devices.empty() && !all_well ? std::vector<FoundDevice>() : selected(listing, options.device);
    std::vector<fs::path> files;
    for (const FoundDevice& patient : patients) files.push_back(prepare_file(patient.device, options.dry_run));

    Json documents = Json::array();
    for (std::size_t i = 0; i < patients.size(); ++i) {
        const Device& device = patients[i].device;
        if (!options.report.quiet) note("{}", describe(device));
        const Examination examination = doctor::examine(patients[i], examination_options);
        if (!examination.finished) break;
        all_well = all_well && examination.diagnosis.faults.empty();
        if (!files[i].empty()) write_diagnosis(files[i], device, examination.diagnosis);
        if (options.report.json)
            documents.push_back(document(device, examination, files[i]));
        else
            print_text(summary(device, examination, files[i]));
    }
    if (interrupted()) note("interrupted: what was known of the device that was being examined is as it was");
    if (options.report.json)
        print_json(Json{
            {"castor_version", CASTOR_VERSION}, {"problems", listing.problems}, {"devices", std::move(documents)}});
    if (interrupted()) return ExitStatus::interrupted;
    return all_well ? ExitStatus::done : ExitStatus::device;
}

}  // namespace

void add_doctor(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("doctor", "Find out whether the devices' drivers can be trusted");
    const auto options = std::make_shared<DoctorCommandOptions>();
    command
        ->add_option("--device", options->device,
                     "index, type (cpu, gpu), part of a name, \"all\", or several with commas between")
        ->capture_default_str();
    command->add_option("--seconds", options->seconds, "seconds of random checks for each device, without compiling")
        ->check(number_in(0.0, 86400.0))
        ->capture_default_str();
    command->add_option("--patience", options->patience, "seconds; a step that takes longer counts as hung")
        ->check(number_in(0.1, 86400.0))
        ->capture_default_str();
    command
        ->add_option("--memory-limit", options->memory,
                     "bytes (or 500M, 16G ...); a step whose process takes more is a fault (default: three quarters of "
                     "the memory that is left)")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::PositiveNumber);
    command->add_option("--seed", options->seed, "seed of the random checks")->capture_default_str();
    command->add_flag("--dry-run", options->dry_run, "examine, but store nothing");
    command->add_option("--probe", options->probe)->group("");  // hidden
    command->add_option("--parts", options->parts)->delimiter(',')->group("");
    add_report_options(*command, options->report);
    command->footer(kDoctorFooter);
    command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace castor::cli
