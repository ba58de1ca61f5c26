#include "trace/diagnosis_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "castor/error.h"
#include "trace/device_file.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "castor doctor's diagnosis";
constexpr int kFormatVersion = 1;
/// What is kept of a reason: a build log may be long.
constexpr std::size_t kLongestReason = 2000;

const std::string& text_of(const DeviceJson& value, const char* name) {
    if (!value.is_string()) throw DeviceFileProblem(fmt::format("its {} is {}, here it is a text", name, shown(value)));
    return value.get_ref<const std::string&>();
}

Fault fault_of(const DeviceJson& entry) {
    Fault fault;
    fault.reason = text_of(member(entry, "reason"), "reason");
    const DeviceJson& strategy = member(entry, "strategy");
    if (strategy.is_null()) return fault;
    try {
        fault.strategy = strategy_from_string(text_of(strategy, "strategy"));
    } catch (const UsageError&) {
        throw DeviceFileProblem(fmt::format("its strategy is {}, which there is not", shown(strategy)));
    }
    return fault;
}

StoredDiagnosis diagnosis_of(const DeviceJson& document, const Device& device) {
    if (member(document, "format") == kFormat && member(document, "castor_version") != CASTOR_VERSION) return {};
    check_device_document(document, kFormat, kFormatVersion, device);
    const DeviceJson& entries = member(document, "faults");
    if (!entries.is_array()) throw DeviceFileProblem(fmt::format("its faults are {}, not a list", shown(entries)));
    Diagnosis diagnosis;
    for (const DeviceJson& entry : entries) diagnosis.faults.push_back(fault_of(entry));
    return {std::move(diagnosis), ""};
}

}  // namespace

bool Diagnosis::device_fails() const {
    return std::any_of(faults.begin(), faults.end(), [](const Fault& fault) { return !fault.strategy; });
}

bool Diagnosis::quarantines(Strategy strategy) const {
    return std::any_of(faults.begin(), faults.end(), [&](const Fault& fault) { return fault.strategy == strategy; });
}

std::vector<Strategy> Diagnosis::quarantined() const {
    std::vector<Strategy> strategies;
    for (const Fault& fault : faults)
        if (fault.strategy && std::count(strategies.begin(), strategies.end(), *fault.strategy) == 0)
            strategies.push_back(*fault.strategy);
    return strategies;
}

std::string verdict(const Diagnosis& diagnosis) {
    if (diagnosis.device_fails()) return "not usable";
    std::string names;
    for (const Strategy strategy : diagnosis.quarantined())
        names += fmt::format("{}{}", names.empty() ? "" : ", ", to_string(strategy));
    return names.empty() ? "trusted" : "trusted except " + names;
}

fs::path diagnosis_file(const Device& device) {
    const fs::path folder = device_folder("doctor");
    return folder.empty() ? fs::path() : folder / device_file_name(device, device_identity(device).dump());
}

StoredDiagnosis read_diagnosis(const fs::path& file, const Device& device) {
    try {
        const std::string text = read_device_file(file);
        if (text.empty()) return {};
        return diagnosis_of(parse_device_document(text), device);
    } catch (const DeviceFileProblem& problem) {
        return {std::nullopt, problem.what()};
    }
}

void write_diagnosis(const fs::path& file, const Device& device, const Diagnosis& diagnosis) {
    DeviceJson document = device_document(kFormat, kFormatVersion, device);
    document["verdict"] = verdict(diagnosis);
    document["faults"] = DeviceJson::array();
    for (const Fault& fault : diagnosis.faults)
        document["faults"].push_back(
            {{"strategy", fault.strategy ? DeviceJson(to_string(*fault.strategy)) : DeviceJson()},
             {"reason", fault.reason.substr(0, kLongestReason)}});
    write_device_file(file, document.dump(2, ' ', false, DeviceJson::error_handler_t::replace) + "\n");
}

}  // namespace castor
