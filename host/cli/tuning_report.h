#pragma once

#include <string>

#include "report.h"
#include "trace/tuning.h"

namespace castor::cli {

/// {"strategies": {"closest_coherent": "packet", ...}, "launch_items": ...}: the device's part of a profile file.
Json json_of(const Tuning& tuning, const Device& device);

/// {"verdict": "trusted", "faults": [{"strategy": null or "wide", "reason": ...}]}.
Json json_of(const Diagnosis& diagnosis);

/// One line: "closest hit: packet for coherent rays, wide for others; ... launch_items 32768, ...".
std::string describe(const Tuning& tuning, const Device& device);

/// Prints why a stored profile of these devices is not used, if one is not, and what the doctor found wrong with them.
void print_profile_warnings(const std::vector<Device>& devices);

/// Adds --no-profile, which clears `use_profiles`.
void add_profile_option(CLI::App& command, bool& use_profiles);

}  // namespace castor::cli
