#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/device.h"
#include "castor/scene.h"
#include "castor/tuner.h"
#include "trace/diagnosis_file.h"
#include "trace/strategy_choice.h"

namespace castor {

/// One number of a Tuning and the values that it may have on a device, ascending.
struct TuningNumber {
    std::string_view name;
    std::uint32_t Tuning::*value;
    std::vector<std::uint32_t> allowed;
};

/// Every value that `castor tune` may choose. Nothing else is taken from a file, so that the tests can try them all.
struct TuningSpace {
    std::vector<Strategy> strategies;  // for each kind of ray
    std::vector<TuningNumber> numbers;
};
/// The defaults lie within it.
TuningSpace tuning_space(const Device& device);

/// Returns " -DNAME=VALUE ..." for the program of a strategy.
std::string build_options(const Tuning& tuning, Strategy strategy);

/// What a device works with.
struct TuningInUse {
    Tuning tuning;
    std::filesystem::path profile_file;  // that it was read from; empty: the defaults
    std::optional<Diagnosis> diagnosis;  // what `castor doctor` found; empty: it was not asked
    std::vector<Warning> warnings;       // a profile is ignored, the doctor found something, a promise is not kept
};

/// Returns the device's stored profile if there is a valid one and `use_profile` is set, else the defaults; `wanted`
/// for all rays unless it is `automatic`. Strategies that `castor doctor` found wrong are replaced by others unless
/// wanted, with a warning either way. Throws nothing but bad_alloc.
TuningInUse tuning_in_use(const Device& device, bool use_profile = true, Strategy wanted = Strategy::automatic);

/// Returns a strategy to use in place of `strategy`: itself unless it is quarantined, else one that is not and that
/// tuning_space(device) allows, at worst `brute`.
Strategy without_quarantined(Strategy strategy, const Device& device, const Diagnosis& diagnosis);

/// Returns the tuning in use of each device.
std::vector<TuningInUse> choose_tunings(Strategy wanted, const std::vector<Device>& devices, bool use_profiles);

std::vector<StrategyChoice> strategies_of(const std::vector<TuningInUse>& tunings);
/// Returns the warnings of all devices, without duplicates.
std::vector<Warning> warnings_of(const std::vector<TuningInUse>& tunings);

}  // namespace castor
