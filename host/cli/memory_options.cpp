#include "memory_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace castor::cli {

MemoryPlan plan_memory(const SceneInput& input, const MemoryRequest& request) {
    return input.built ? castor::plan_memory(*input.built, request) : castor::plan_memory(input.scene, request);
}

void note_memory(const MemoryPlan& plan) {
    for (const MemoryBudget& budget : plan) note("memory, {}", to_string(budget));
}

Json json_of(const MemoryPlan& plan) {
    Json list = Json::array();
    for (const MemoryBudget& budget : plan) {
        Json parts = Json::object();
        for (const MemoryNeed& need : budget.needs) parts[need.what] = need.bytes;
        list.push_back(
            {{"owner", budget.owner}, {"needed", budget.needed()}, {"available", budget.available}, {"parts", parts}});
        if (budget.largest_allowed > 0) {
            list.back()["chunks"] = budget.chunks;
            list.back()["streams"] = budget.streams;
        }
    }
    return list;
}

void add_memory_option(CLI::App& command, std::optional<std::uint64_t>& limit) {
    command
        .add_option(
            "--memory-limit", limit,
            "bytes (or 500M, 16G ...) to plan with, on the host and on each device, instead of what they have left")
        ->transform(CLI::AsSizeValue(false));
}

void add_device_limit_options(CLI::App& command, DeviceLimits& limits) {
    command
        .add_option("--allocation-limit", limits.allocation,
                    "bytes (or 64M, 1G ...) that one buffer on a device may have, if less than what the device allows: "
                    "a larger scene is cut into chunks")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::PositiveNumber);
    command
        .add_option("--device-memory-limit", limits.memory,
                    "bytes that a device may use, if less than what it has: chunks of a larger scene take turns")
        ->transform(CLI::AsSizeValue(false))
        ->check(CLI::PositiveNumber);
}

std::vector<Device> select_devices(const std::string& selection, const DeviceLimits& limits, const std::string& host) {
    std::vector<Device> devices = castor::select_devices(selection);
    for (Device& device : devices) {
        device.host = host;
        device.max_allocation_bytes =
            std::min(device.max_allocation_bytes, limits.allocation.value_or(device.max_allocation_bytes));
        device.global_memory_bytes =
            std::min(device.global_memory_bytes, limits.memory.value_or(device.global_memory_bytes));
    }
    return devices;
}

}  // namespace castor::cli
