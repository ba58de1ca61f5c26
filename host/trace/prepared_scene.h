#pragma once

#include <vector>

#include "bvh/box.h"
#include "bvh/compressed.h"
#include "bvh/wide.h"
#include "castor/device.h"
#include "castor/tracer.h"
#include "scene/scene_arrays.h"
#include "trace/strategy_choice.h"

namespace castor {

/// A scene's columns and the trees that the chosen strategies walk.
struct PreparedScene {
    SceneArrays arrays;
    Box bounds;                // of all bounded primitives; empty if there is none, or no strategy walks a tree
    CompressedBvh compressed;  // empty if no strategy needs it
    WideBvh wide;              // likewise
    double flatten_seconds = 0.0;
    double build_seconds = 0.0;
};

/// Flattens, and builds the trees that these strategies walk. Throws SceneError.
PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies,
                            TreeQuality quality = TreeQuality::medium);

}  // namespace castor
