#include "doctor/examination.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdlib.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "doctor/check.h"
#include "opencl/device_json.h"

namespace castor::doctor {

namespace {

namespace fs = std::filesystem;

/// The files that tell an OpenCL loader of drivers, by ocl-icd's and Khronos' rules.
std::vector<fs::path> driver_files() {
    const char* variable = std::getenv("OCL_ICD_VENDORS");
    const fs::path place = variable && *variable ? variable : "/etc/OpenCL/vendors";
    std::error_code ignored;
    if (!fs::is_directory(place, ignored)) return {place};
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(place, ignored))
        if (entry.path().extension() == ".icd") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

struct Answer {
    std::vector<Device> devices;
    std::vector<std::string> problems;
    ChildEnd end;
};

/// Nothing is compiled for a list, so its memory is not looked at.
ChildLimits limits_of_listing(const ExaminationOptions& options) {
    return {options.limits.patience_seconds, std::numeric_limits<std::uint64_t>::max()};
}

Answer ask_for_devices(const Environment& environment, const ExaminationOptions& options) {
    Answer answer;
    answer.end = run_child(
        {"doctor", "--probe", "list"}, environment, limits_of_listing(options),
        [&](const std::string& line) {
            const Json report = Json::parse(line, nullptr, false);
            if (!report.is_object()) return;
            if (report.contains("device")) answer.devices.push_back(device_of(report.at("device")));
            if (report.contains("problem")) answer.problems.push_back(report.at("problem"));
        },
        options.go_on);
    return answer;
}

void add_answer(Listing& listing, Answer answer, const Environment& environment) {
    for (std::size_t index = 0; index < answer.devices.size(); ++index) {
        answer.devices[index].index = listing.devices.size();
        listing.devices.push_back({std::move(answer.devices[index]), index, environment});
    }
    listing.problems.insert(listing.problems.end(), answer.problems.begin(), answer.problems.end());
}

std::vector<std::string> all_part_names() {
    std::vector<std::string> names;
    for (const Part& part : make_parts()) names.push_back(part.name);
    return names;
}

/// The share of the time that the longest step has.
double longest_step() {
    double longest = 0.0;
    for (const Part& part : make_parts())
        longest = std::max(longest, part.time_share / static_cast<double>(part.checks.size()));
    return longest;
}

std::optional<Strategy> strategy_of(const std::string& part_name) {
    for (const Part& part : make_parts())
        if (part.name == part_name) return part.strategy;
    return std::nullopt;
}

}  // namespace

class SingleDriverFolders {
public:
    SingleDriverFolders() {
        std::string name = (fs::temp_directory_path() / "castor-doctor-XXXXXX").string();
        if (!::mkdtemp(name.data())) throw FileError(name, "cannot be made");
        root_ = name;
    }
    ~SingleDriverFolders() {
        std::error_code ignored;
        fs::remove_all(root_, ignored);
    }
    SingleDriverFolders(const SingleDriverFolders&) = delete;
    SingleDriverFolders& operator=(const SingleDriverFolders&) = delete;

    Environment only(const fs::path& driver_file) {
        const fs::path folder = root_ / std::to_string(count_++);
        fs::create_directory(folder);
        fs::copy_file(driver_file, folder / driver_file.filename());
        return {{"OCL_ICD_VENDORS", folder.string()}};
    }

private:
    fs::path root_;
    int count_ = 0;
};

Listing list_patients(const ExaminationOptions& options) {
    Listing listing;
    options.on_step("asking for platforms and devices");
    Answer answer = ask_for_devices({}, options);
    if (answer.end.succeeded()) {
        add_answer(listing, std::move(answer), {});
        return listing;
    }
    const std::string together = describe(answer.end, limits_of_listing(options));
    const std::vector<fs::path> files = driver_files();
    if (files.size() < 2) {
        listing.problems.push_back(fmt::format("{} cannot be asked for its devices: {}",
                                               files.empty() ? "OpenCL" : files.front().string(), together));
        return listing;
    }
    listing.folders = std::make_shared<SingleDriverFolders>();
    std::size_t wrong = 0;
    for (const fs::path& file : files) {
        if (!options.go_on()) return listing;
        options.on_step(fmt::format("asking {} alone", file.string()));
        const Environment environment = listing.folders->only(file);
        Answer alone = ask_for_devices(environment, options);
        if (alone.end.succeeded()) {
            add_answer(listing, std::move(alone), environment);
            continue;
        }
        ++wrong;
        listing.problems.push_back(
            fmt::format("{} cannot be asked for its devices: {}. While it is installed no program can use OpenCL; "
                        "OCL_ICD_VENDORS names a folder with the other drivers' files",
                        file.string(), describe(alone.end, limits_of_listing(options))));
    }
    if (wrong == 0)
        listing.problems.push_back(
            fmt::format("the drivers can be asked for their devices one by one, but not together: {}. OCL_ICD_VENDORS "
                        "names a folder "
                        "with some of the drivers' files",
                        together));
    return listing;
}

Examination examine(const FoundDevice& patient, const ExaminationOptions& options) {
    Examination examination;
    const Stopwatch watch;
    std::vector<std::string> remaining = options.parts.empty() ? all_part_names() : options.parts;
    ChildLimits limits = options.limits;
    limits.patience_seconds += longest_step() * options.seconds;
    while (!remaining.empty()) {
        std::string part, step;
        bool part_failed = false;
        const auto finish = [&](bool passed) {
            examination.parts.push_back({part, passed});
            std::erase(remaining, part);
            part.clear();
        };
        const auto note_fault = [&](const std::string& reason) {
            part_failed = true;
            examination.diagnosis.faults.push_back({strategy_of(part), reason});
        };
        const auto on_line = [&](const std::string& text) {
            const Json report = Json::parse(text, nullptr, false);
            if (!report.is_object())
                return note_fault(
                    fmt::format("{}: the driver has written into the report: {}", step, text.substr(0, 200)));
            const auto has = [&](const char* name) { return report.contains(name); };
            if (has("part")) part = report.at("part"), part_failed = false;
            if (has("step")) {
                step = report.at("step");
                options.on_step(part.empty() ? step : part + ": " + step);
            }
            if (has("fault")) note_fault(report.at("fault"));
            if (has("remark")) examination.remarks.push_back(report.at("remark"));
            if (has("part_done")) finish(!part_failed);
        };
        const ChildEnd end = run_child({"doctor", "--probe", std::to_string(patient.index), "--parts",
                                        fmt::format("{}", fmt::join(remaining, ",")), "--seconds",
                                        fmt::format("{}", options.seconds), "--seed", std::to_string(options.seed)},
                                       patient.environment, limits, on_line, options.go_on);
        if (end.kind == ChildEnd::Kind::interrupted) return examination;
        if (end.succeeded() && remaining.empty()) break;
        const std::string reason = fmt::format("{}: {}", step, describe(end, limits));
        if (part.empty()) {  // it does not even begin, or ends badly after all is done
            note_fault(reason);
            break;
        }
        note_fault(reason);
        finish(false);
    }
    for (const std::string& name : remaining) examination.parts.push_back({name, false});
    examination.seconds = watch.seconds();
    examination.finished = true;
    return examination;
}

}  // namespace castor::doctor
