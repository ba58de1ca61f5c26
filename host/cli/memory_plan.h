#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/tree_quality.h"
#include "report.h"
#include "scene_input.h"
#include "trace/strategy_choice.h"

namespace castor::cli {

/// Bytes that something is about to take.
struct MemoryNeed {
    std::string what;
    std::uint64_t bytes = 0;
};

/// What one memory is going to hold at the same time, and how much of it there is.
struct MemoryBudget {
    std::string owner;  // "host", or the device's name
    std::vector<MemoryNeed> needs;
    std::uint64_t available = 0;
    // Only of devices.
    MemoryNeed largest;  // buffer that is surely needed: columns that can be cut are not
    std::uint64_t largest_allowed = 0;
    std::size_t chunks = 1;  // that the scene is cut into
    bool streams = false;    // they take turns, since the memory does not hold all

    std::uint64_t needed() const;
};

/// The host's budget first, then each device's. Made before anything of it is allocated: columns and pictures are
/// counted exactly, trees are estimated from the number of primitives.
using MemoryPlan = std::vector<MemoryBudget>;

/// What devices are taken to have, at most.
struct DeviceLimits {
    std::optional<std::uint64_t> allocation;  // --allocation-limit
    std::optional<std::uint64_t> memory;      // --device-memory-limit
};

struct MemoryRequest {
    std::vector<Device> devices;  // with their limits
    std::vector<StrategyChoice> strategies;  // whose trees are to be there
    TreeQuality quality = TreeQuality::medium;
    std::uint64_t picture_bytes = 0;
    std::optional<std::uint64_t> limit;  // --memory-limit
};

/// Plans for the scene that was read: one that is built already needs nothing more of the host but for the picture and
/// trees that it has not.
MemoryPlan plan_memory(const SceneInput& input, const MemoryRequest& request);

/// Throws DeviceError naming who has too little, what is needed for what, and what there is.
void check_memory(const MemoryPlan& plan);

/// A line for people for each owner; and the same for programs.
void note_memory(const MemoryPlan& plan);
std::string memory_line(const MemoryBudget& budget);
Json json_of(const MemoryPlan& plan);

void add_memory_option(CLI::App& command, std::optional<std::uint64_t>& limit);
void add_device_limit_options(CLI::App& command, DeviceLimits& limits);

/// The selected devices, as if they had no more than the limits.
std::vector<Device> select_devices(const std::string& selection, const DeviceLimits& limits);

}  // namespace castor::cli
