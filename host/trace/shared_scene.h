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
                                         TreeQuality quality,
                                         std::uint64_t max_column_bytes, const ProgressHook& progress = {});

std::shared_ptr<SharedScene> share_scene(Scene&& scene, const std::vector<TuningInUse>& tunings, TreeQuality quality,
                                         std::uint64_t max_column_bytes, const ProgressHook& progress = {});

/// The scene with all trees that these devices walk: one that is not there is built, which `warnings` is told.
std::shared_ptr<SharedScene> complete_scene(const BuiltScene& scene, const std::vector<TuningInUse>& tunings,
                                            TreeQuality quality, std::uint64_t max_column_bytes,
                                            std::vector<Warning>& warnings);

}  // namespace castor
