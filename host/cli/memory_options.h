#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/memory_plan.h"
#include "report.h"
#include "scene_input.h"

namespace CLI {
class App;
}

namespace castor::cli {

/// What devices are taken to have, at most.
struct DeviceLimits {
    std::optional<std::uint64_t> allocation;  // --allocation-limit
    std::optional<std::uint64_t> memory;      // --device-memory-limit
};

/// Plans for the scene that was read, or built.
MemoryPlan plan_memory(const SceneInput& input, const MemoryRequest& request);

/// A line for people for each owner; and the same for programs.
void note_memory(const MemoryPlan& plan);
Json json_of(const MemoryPlan& plan);

void add_memory_option(CLI::App& command, std::optional<std::uint64_t>& limit);
void add_device_limit_options(CLI::App& command, DeviceLimits& limits);

/// The selected devices, as if they had no more than the limits. `host`: Device::host of all.
std::vector<Device> select_devices(const std::string& selection, const DeviceLimits& limits,
                                   const std::string& host = {});

}  // namespace castor::cli
