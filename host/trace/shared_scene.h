#pragma once

#include <memory>
#include <mutex>

#include "castor/built_scene.h"
#include "trace/prepared_scene.h"
#include "trace/tuning.h"

namespace castor {

/// A prepared scene that several renderers and tracers use. `mutex` is held where trees are added and columns uploaded;
/// what has been uploaded does not change.
struct SharedScene {
    PreparedScene prepared;
    std::mutex mutex;
};

std::shared_ptr<SharedScene> share_scene(const Scene& scene, const std::vector<TuningInUse>& tunings,
                                         TreeQuality quality, const ChunkLimits& limits,
                                         const ProgressHook& progress = {});

std::shared_ptr<SharedScene> share_scene(Scene&& scene, const std::vector<TuningInUse>& tunings, TreeQuality quality,
                                         const ChunkLimits& limits, const ProgressHook& progress = {});

/// The scene with all trees that these devices walk, in chunks that they can hold: what is not there is built, and what
/// is too large cut and built anew, which `warnings` is told. The latter makes another scene, since the chunks may be
/// in use.
std::shared_ptr<SharedScene> complete_scene(const BuiltScene& scene, const std::vector<TuningInUse>& tunings,
                                            TreeQuality quality, const ChunkLimits& limits,
                                            std::vector<Warning>& warnings);

}  // namespace castor
