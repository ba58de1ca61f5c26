#include "trace/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "opencl/quirks.h"
#include "trace/profile_file.h"

namespace castor {

Tuning default_tuning(const Device& device) {
    Tuning tuning;
    tuning.local_size = 64;
    tuning.wide_lanes = CASTOR_DEFAULT_WIDE_LANES;
    const bool is_like_gpu = device_quirks(device).is_like_gpu;
    // A GPU needs many work-items, and a batch takes a work-item as many turns of loops as all of its rays do: where
    // these are limited (DeviceQuirks::loop_turns), it must be small.
    tuning.wide_batch = is_like_gpu ? 4 : CASTOR_DEFAULT_WIDE_BATCH;
    tuning.strategies = device.type == DeviceType::cpu && !is_like_gpu
                            ? StrategyChoice{Strategy::wide, Strategy::packet, Strategy::wide, Strategy::packet}
                            : StrategyChoice::all(Strategy::simt);
    // A GPU needs many rays in flight. PoCL compiles a kernel again for launches of 65535 and more work-items, so that
    // others' stay below.
    tuning.launch_items = is_like_gpu ? 1u << 22 : 1u << 15;
    return tuning;
}

TuningSpace tuning_space(const Device& device) {
    TuningSpace space;
    const bool is_like_gpu = device_quirks(device).is_like_gpu;
    // On a GPU a work-item of `wide` or `packet` has a whole group, and its wide stack, for itself.
    space.strategies =
        is_like_gpu ? std::vector{Strategy::simt} : std::vector{Strategy::simt, Strategy::wide, Strategy::packet};
    space.numbers = {
        {"wide_lanes", &Tuning::wide_lanes, {1, 2, 4, 8, 16, 32}},
        {"wide_batch", &Tuning::wide_batch, {4, 16, 32, 64, 128, 256}},
        {"local_size", &Tuning::local_size, {16, 32, 64, 128, 256}},
        {"launch_items", &Tuning::launch_items,
         is_like_gpu ? std::vector{1u << 16, 1u << 18, 1u << 20, 1u << 22}
                     : std::vector{1u << 8, 1u << 10, 1u << 12, 1u << 15}},
    };
    return space;
}

std::string build_options(const Tuning& tuning, Strategy strategy) {
    if (!walks_wide_tree(strategy)) return "";
    return fmt::format(" -DCASTOR_WIDE_LANES={} -DCASTOR_WIDE_BATCH={}u", tuning.wide_lanes, tuning.wide_batch);
}

Strategy without_quarantined(Strategy strategy, const Device& device, const Diagnosis& diagnosis) {
    if (!diagnosis.quarantines(strategy)) return strategy;
    // First those that traverse the tree that is there anyway.
    const std::array others = device.type == DeviceType::cpu
                                  ? std::array{Strategy::wide, Strategy::packet, Strategy::simt}
                                  : std::array{Strategy::simt, Strategy::wide, Strategy::packet};
    const std::vector<Strategy> allowed = tuning_space(device).strategies;
    for (const Strategy other : others)
        if (!diagnosis.quarantines(other) && std::count(allowed.begin(), allowed.end(), other) > 0) return other;
    return Strategy::brute;
}

namespace {

void read_profile_into(TuningInUse& in_use, const Device& device) {
    const std::filesystem::path file = profile_file(device);
    if (file.empty()) return;
    const StoredProfile stored = read_profile(file, device);
    if (stored.tuning) {
        in_use.tuning = *stored.tuning;
        in_use.profile_file = file;
    } else if (!stored.problem.empty()) {
        in_use.warnings.push_back(
            {file.string(), 0,
             fmt::format("this device profile is ignored: {}; \"castor tune\" makes a new one", stored.problem)});
    }
}

std::string first_reason(const Diagnosis& diagnosis, bool of_device) {
    const auto found = std::find_if(diagnosis.faults.begin(), diagnosis.faults.end(),
                                    [&](const Fault& fault) { return !fault.strategy == of_device; });
    return found->reason.substr(0, found->reason.find('\n'));
}

void heed_diagnosis(TuningInUse& in_use, const Device& device, Strategy wanted) {
    const std::filesystem::path file = diagnosis_file(device);
    if (file.empty()) return;
    StoredDiagnosis stored = read_diagnosis(file, device);
    const auto warn = [&](const std::string& text) { in_use.warnings.push_back({file.string(), 0, text}); };
    if (!stored.problem.empty())
        warn(fmt::format("what \"castor doctor\" found is ignored: {}; run it again", stored.problem));
    in_use.diagnosis = std::move(stored.diagnosis);
    if (!in_use.diagnosis || in_use.diagnosis->faults.empty()) return;
    const Diagnosis& diagnosis = *in_use.diagnosis;
    StrategyChoice& strategies = in_use.tuning.strategies;
    if (wanted == Strategy::automatic)
        for (const auto& [kind, name] : kRayKindsOfChoice)
            strategies.*kind = without_quarantined(strategies.*kind, device, diagnosis);

    if (diagnosis.device_fails())
        return warn(
            fmt::format("{} IS NOT TO BE TRUSTED, and its results may be wrong: {}. Run \"castor doctor\" again "
                        "after the driver or Castor was changed",
                        device.name, first_reason(diagnosis, true)));
    std::string names;
    for (const Strategy strategy : diagnosis.quarantined())
        names += fmt::format("{}{}", names.empty() ? "" : ", ", to_string(strategy));
    warn(fmt::format("{}: {} {} what \"castor doctor\" found wrong with this driver: {}", device.name, names,
                     diagnosis.quarantines(wanted) ? "is in use as asked, against" : "is not used because of",
                     first_reason(diagnosis, false)));
}

}  // namespace

TuningInUse tuning_in_use(const Device& device, bool use_profile, Strategy wanted) {
    TuningInUse in_use{default_tuning(device), {}, {}, {}};
    if (use_profile) read_profile_into(in_use, device);
    if (wanted != Strategy::automatic) in_use.tuning.strategies = StrategyChoice::all(wanted);
    heed_diagnosis(in_use, device, wanted);
    for (std::string& text : broken_promises(device)) in_use.warnings.push_back({"", 0, std::move(text)});
    return in_use;
}

std::vector<TuningInUse> choose_tunings(Strategy wanted, const std::vector<Device>& devices, bool use_profiles) {
    std::vector<TuningInUse> tunings;
    for (const Device& device : devices) tunings.push_back(tuning_in_use(device, use_profiles, wanted));
    return tunings;
}

std::vector<StrategyChoice> strategies_of(const std::vector<TuningInUse>& tunings) {
    std::vector<StrategyChoice> choices;
    for (const TuningInUse& in_use : tunings) choices.push_back(in_use.tuning.strategies);
    return choices;
}

std::vector<Warning> warnings_of(const std::vector<TuningInUse>& tunings) {
    std::vector<Warning> warnings;
    for (const TuningInUse& in_use : tunings)
        for (const Warning& warning : in_use.warnings)
            if (std::none_of(warnings.begin(), warnings.end(), [&](const Warning& other) {
                    return other.file == warning.file && (!other.file.empty() || other.text == warning.text);
                }))
                warnings.push_back(warning);
    return warnings;
}

}  // namespace castor
