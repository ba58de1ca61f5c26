// castor devices: lists the OpenCL devices.
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "castor/device.h"
#include "commands.h"
#include "opencl/quirks.h"
#include "report.h"
#include "trace/tuning.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

constexpr const char* kDevicesFooter =
    R"(After --device, the other commands take an index, a type or a part of a name. "profile" is what "castor
tune" stored for the device, "doctor" the verdict of "castor doctor".

Examples:
  castor devices
  castor devices --json
  castor render scene.xml --device gpu)";

std::string abilities(const Device& device) {
    return fmt::format("infinities and NaN {}, fused multiply-add {}, exact divide and square root {}, denormals {}",
                       device.infinity_and_nan ? "yes" : "NO", device.fused_multiply_add ? "yes" : "in software",
                       device.correctly_rounded_divide_sqrt ? "yes" : "by integers",
                       device.denormals ? "yes" : "flushed to zero");
}

std::string description(const Device& device, const TuningInUse& in_use) {
    const DeviceQuirks quirks = device_quirks(device);
    return fmt::format(
        "{}: {}\n"
        "   type                {}, {} compute units\n"
        "   platform            {}, {}\n"
        "   driver              {}\n"
        "   version             {}, {}\n"
        "   memory              {}{}\n"
        "   largest allocation  {}\n"
        "   exact arithmetic    {}\n"
        "   quirks              {}\n"
        "   build options       {}\n"
        "   profile             {}\n"
        "   in use              {}\n"
        "   doctor              {}\n",
        device.index, device.name, to_string(device.type), device.compute_units, device.platform_name,
        device.platform_version, device.driver_version, device.device_version, device.opencl_c_version,
        byte_count(device.global_memory_bytes), device.unified_memory ? ", shared with the host" : "",
        byte_count(device.max_allocation_bytes), abilities(device),
        quirks.remarks.empty() ? "none" : fmt::format("{}", fmt::join(quirks.remarks, "; ")), quirks.build_options,
        in_use.profile_file.empty() ? "none in use: the defaults" : in_use.profile_file.string(),
        describe(in_use.tuning, device), in_use.diagnosis ? verdict(*in_use.diagnosis) : "not asked yet");
}

Json document(const Device& device, const TuningInUse& in_use) {
    const DeviceQuirks quirks = device_quirks(device);
    Json json = json_of(device);
    json["quirks"] = quirks.remarks;
    json["build_options"] = quirks.build_options;
    json["broken_promises"] = broken_promises(device);
    json["profile"] = json_of(in_use.tuning, device);
    json["profile"]["file"] = in_use.profile_file.empty() ? Json() : Json(in_use.profile_file.string());
    json["profile"]["warnings"] = json_of(in_use.warnings);
    json["doctor"] = in_use.diagnosis ? json_of(*in_use.diagnosis) : Json();
    return json;
}

ExitStatus run(const ReportOptions& report) {
    std::vector<std::string> problems;
    const std::vector<Device> devices = list_devices(&problems);
    for (const std::string& problem : problems) print_warnings({{"", 0, problem}});
    if (devices.empty()) castor::select_devices("all");  // throws, naming what to install
    print_profile_warnings(devices);
    if (report.json) {
        Json documents = Json::array();
        for (const Device& device : devices) documents.push_back(document(device, tuning_in_use(device)));
        print_json(Json{{"devices", std::move(documents)}, {"problems", problems}});
        return ExitStatus::done;
    }
    std::string text;
    for (const Device& device : devices) text += description(device, tuning_in_use(device));
    print_text(text);
    return ExitStatus::done;
}

}  // namespace

void add_devices(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("devices", "List the OpenCL devices and what they can do");
    const auto report = std::make_shared<ReportOptions>();
    add_report_options(*command, *report);
    command->footer(kDevicesFooter);
    command->callback([report, &action] { action = [report] { return run(*report); }; });
}

}  // namespace castor::cli
