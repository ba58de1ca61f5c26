#include "tuning_report.h"

#include <CLI/CLI.hpp>

namespace castor::cli {

Json json_of(const Tuning& tuning, const Device& device) {
    Json document;
    for (const auto& [kind, name] : kRayKindsOfChoice)
        document["strategies"][std::string(name)] = to_string(tuning.strategies.*kind);
    for (const TuningNumber& number : tuning_space(device).numbers)
        document[std::string(number.name)] = tuning.*number.value;
    return document;
}

Json json_of(const Diagnosis& diagnosis) {
    Json faults = Json::array();
    for (const Fault& fault : diagnosis.faults)
        faults.push_back(
            {{"strategy", fault.strategy ? Json(to_string(*fault.strategy)) : Json()}, {"reason", fault.reason}});
    return {{"verdict", verdict(diagnosis)}, {"faults", std::move(faults)}};
}

std::string describe(const Tuning& tuning, const Device& device) {
    const auto of_query = [&](Query query) {
        const Strategy coherent = tuning.strategies.of(query, Coherence::coherent);
        const Strategy incoherent = tuning.strategies.of(query, Coherence::incoherent);
        if (coherent == incoherent) return std::string(to_string(coherent));
        return fmt::format("{} (coherent rays) and {}", to_string(coherent), to_string(incoherent));
    };
    const std::string closest = of_query(Query::closest), any = of_query(Query::any);
    std::string text = closest == any ? closest : fmt::format("closest hit by {}, any hit by {}", closest, any);
    for (const TuningNumber& number : tuning_space(device).numbers)
        text += fmt::format(", {} {}", number.name, tuning.*number.value);
    return text;
}

void print_profile_warnings(const std::vector<Device>& devices) {
    print_warnings(warnings_of(choose_tunings(Strategy::automatic, devices, true)));
}

void add_profile_option(CLI::App& command, bool& use_profiles) {
    command.add_flag_callback(
        "--no-profile", [&use_profiles] { use_profiles = false; },
        "use the devices' defaults, whatever \"castor tune\" stored");
}

}  // namespace castor::cli
