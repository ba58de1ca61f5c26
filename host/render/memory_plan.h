#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/device.h"
#include "castor/scene.h"
#include "castor/tree_quality.h"
#include "trace/strategy_choice.h"

namespace castor {

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

struct MemoryRequest {
    std::vector<Device> devices;             // with their limits
    std::vector<StrategyChoice> strategies;  // whose trees are to be there
    TreeQuality quality = TreeQuality::medium;
    std::uint64_t picture_bytes = 0;
    std::optional<std::uint64_t> limit;
    std::uint64_t checkpoint_bytes = 0;  // 0: no checkpoints are written
    std::uint64_t block_samples = 0;     // the most pixel blocks times samples of a picture; 0: batches of rays
};

/// Returns the picture's number of pixel blocks times `samples_per_pixel` (0: the camera's own).
std::uint64_t block_samples(const Camera& camera, std::uint32_t samples_per_pixel);

/// Returns what checkpoints of a picture take while it is rendered in tiles of `tile_size` pixels (0: as large as each
/// device likes): a copy of the picture, and the sums of the pixel blocks that the devices have begun, which are held,
/// copied and written.
std::uint64_t checkpoint_bytes(const Camera& camera, std::uint64_t picture_bytes, const std::vector<Device>& devices,
                               std::uint32_t tile_size);

/// Plans for a scene that is to be flattened and built.
MemoryPlan plan_memory(const Scene& scene, const MemoryRequest& request);
/// Plans for a scene that is built already: the host needs memory only for the picture and for trees that are missing.
MemoryPlan plan_memory(const BuiltScene& scene, const MemoryRequest& request);

/// "72.0 MiB of columns, ...": what an owner needs and what it has, for people.
std::string to_string(const MemoryBudget& budget);

/// Throws DeviceError naming who has too little, what is needed for what, and what there is.
void check_memory(const MemoryPlan& plan);

}  // namespace castor
