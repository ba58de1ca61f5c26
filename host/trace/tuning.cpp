#include "trace/tuning.h"

#include <fmt/format.h>

#include <algorithm>

#include "trace/profile_file.h"

namespace castor {

Tuning default_tuning(const Device& device) {
    Tuning tuning;
    tuning.local_size = 64;
    tuning.wide_lanes = CASTOR_DEFAULT_WIDE_LANES;
    tuning.wide_batch = CASTOR_DEFAULT_WIDE_BATCH;
    tuning.strategies = device.type == DeviceType::cpu
                            ? StrategyChoice{Strategy::wide, Strategy::packet, Strategy::wide, Strategy::packet}
                            : StrategyChoice::all(Strategy::simt);
    // A GPU needs many rays in flight. PoCL compiles a kernel again for launches of 65535 and more work-items, so that
    // others' stay below.
    tuning.launch_items = device.type == DeviceType::gpu ? 1u << 22 : 1u << 15;
    return tuning;
}

TuningSpace tuning_space(const Device& device) {
    TuningSpace space;
    const bool is_gpu = device.type == DeviceType::gpu;
    // On a GPU a work-item of `wide` or `packet` has a whole group, and its wide stack, for itself.
    space.strategies =
        is_gpu ? std::vector{Strategy::simt} : std::vector{Strategy::simt, Strategy::wide, Strategy::packet};
    space.numbers = {
        {"wide_lanes", &Tuning::wide_lanes, {1, 2, 4, 8, 16, 32}},
        // Multiples of CASTOR_GROUP_RAYS.
        {"wide_batch", &Tuning::wide_batch, {16, 32, 64, 128, 256}},
        {"local_size", &Tuning::local_size, {16, 32, 64, 128, 256}},
        {"launch_items", &Tuning::launch_items,
         is_gpu ? std::vector{1u << 16, 1u << 18, 1u << 20, 1u << 22}
                : std::vector{1u << 8, 1u << 10, 1u << 12, 1u << 15}},
    };
    return space;
}

std::string build_options(const Tuning& tuning, Strategy strategy) {
    if (!walks_wide_tree(strategy)) return "";
    return fmt::format(" -DCASTOR_WIDE_LANES={} -DCASTOR_WIDE_BATCH={}u", tuning.wide_lanes, tuning.wide_batch);
}

TuningInUse tuning_in_use(const Device& device, bool use_profile) {
    TuningInUse in_use{default_tuning(device), {}, {}};
    const std::filesystem::path file = use_profile ? profile_file(device) : std::filesystem::path();
    if (file.empty()) return in_use;
    const StoredProfile stored = read_profile(file, device);
    if (stored.tuning) {
        in_use.tuning = *stored.tuning;
        in_use.profile_file = file;
    } else if (!stored.problem.empty()) {
        in_use.warnings.push_back(
            {file.string(), 0,
             fmt::format("this device profile is ignored: {}; \"castor tune\" makes a new one", stored.problem)});
    }
    return in_use;
}

std::vector<TuningInUse> choose_tunings(Strategy wanted, const std::vector<Device>& devices, bool use_profiles) {
    std::vector<TuningInUse> tunings;
    for (const Device& device : devices) {
        tunings.push_back(tuning_in_use(device, use_profiles));
        if (wanted != Strategy::automatic) tunings.back().tuning.strategies = StrategyChoice::all(wanted);
    }
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
            if (std::none_of(warnings.begin(), warnings.end(),
                             [&](const Warning& other) { return other.file == warning.file; }))
                warnings.push_back(warning);
    return warnings;
}

}  // namespace castor
