#pragma once

#include <string>

#include "report.h"
#include "trace/tuning.h"

namespace castor::cli {

/// Returns the tuning as a profile file has it: {"strategies": {"closest_coherent": "packet", ...}, "launch_items":
/// ...}.
Json json_of(const Tuning& tuning, const Device& device);

/// Returns {"verdict": "trusted", "faults": [{"strategy": null or "wide", "reason": ...}]}.
Json json_of(const Diagnosis& diagnosis);

/// Returns one line: "packet (coherent rays) and wide, wide_lanes 16, ... launch_items 32768".
std::string describe(const Tuning& tuning, const Device& device);

/// Prints why stored profiles of these devices are ignored, if they are, and what the doctor found wrong.
void print_profile_warnings(const std::vector<Device>& devices);

/// Adds --no-profile, which clears `use_profiles`.
void add_profile_option(CLI::App& command, bool& use_profiles);

}  // namespace castor::cli
