#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "castor/api.h"
#include "castor/built_scene.h"
#include "castor/device.h"
#include "castor/renderer.h"
#include "castor/scene.h"
#include "castor/tracer.h"
#include "castor/tree_quality.h"

namespace castor {

/// Bytes that something is about to take.
struct MemoryNeed {
    std::string what;
    std::uint64_t bytes = 0;
};

/// What one memory is going to hold at the same time, and how much of it there is.
struct CASTOR_API MemoryBudget {
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

/// A picture that is to be rendered.
struct PlannedPicture {
    Camera camera;
    RenderOptions options;
    std::size_t light_count = 0;  // of the scene; matters only for planes of lights
    bool has_layers = false;      // all planes are written into one file: see write_layers
};

struct MemoryRequest {
    std::vector<Device> devices = {};           // with their limits; none: all trees are built
    Strategy strategy = Strategy::automatic;    // as in TracerOptions
    bool use_profiles = true;                   // likewise
    TreeQuality quality = TreeQuality::medium;  // likewise
    std::vector<PlannedPicture> pictures = {};  // one after the other; none: batches of rays are traced
    std::optional<std::uint64_t> limit = {};    // of every owner's memory, in place of what it has
};

/// Returns the bytes that a picture takes on the host while it is rendered, without checkpoints.
CASTOR_API std::uint64_t picture_bytes(const PlannedPicture& picture);

/// Plans for a scene that is to be flattened and built.
CASTOR_API MemoryPlan plan_memory(const Scene& scene, const MemoryRequest& request);
/// Plans for a scene that is built already: the host needs memory only for the picture and for trees that are missing.
CASTOR_API MemoryPlan plan_memory(const BuiltScene& scene, const MemoryRequest& request);

/// "host: about 97.0 MiB of 16.0 GiB (columns 72.0 MiB, ...)": what an owner needs and what it has, for people.
CASTOR_API std::string to_string(const MemoryBudget& budget);

/// Returns what is needed for what, and what there is, if the owner has too little; empty if it has enough.
CASTOR_API std::string shortage(const MemoryBudget& budget);

/// Throws DeviceError naming who has too little, and the shortage.
CASTOR_API void check_memory(const MemoryPlan& plan);

}  // namespace castor
