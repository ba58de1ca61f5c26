#include "trace/prepared_scene.h"

#include <algorithm>

#include "stopwatch.h"

namespace castor {

namespace {

Scene without_geometry(const Scene& scene) {
    Scene description;
    description.file = scene.file;
    description.background = scene.background;
    description.ambient_light = scene.ambient_light;
    description.shadow_ray_epsilon = scene.shadow_ray_epsilon;
    description.max_recursion_depth = scene.max_recursion_depth;
    description.cameras = scene.cameras;
    description.lights = scene.lights;
    description.materials = scene.materials;
    description.warnings = scene.warnings;
    return description;
}

PreparedScene flatten_alone(const Scene& scene) {
    PreparedScene prepared;
    const Stopwatch watch;
    prepared.description = without_geometry(scene);
    prepared.arrays = flatten(scene);
    prepared.flatten_seconds = watch.seconds();
    return prepared;
}

}  // namespace

PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality) {
    PreparedScene prepared = flatten_alone(scene);
    add_trees(prepared, strategies, quality);
    return prepared;
}

PreparedScene prepare_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality) {
    PreparedScene prepared = flatten_alone(scene);
    scene = prepared.description;
    add_trees(prepared, strategies, quality);
    return prepared;
}

bool add_trees(PreparedScene& prepared, const std::vector<StrategyChoice>& strategies, TreeQuality quality) {
    const auto needs = [&](Strategy strategy) {
        return std::any_of(strategies.begin(), strategies.end(),
                           [&](const StrategyChoice& choice) { return choice.uses(strategy); });
    };
    const bool needs_wide = !prepared.has_wide && (needs(Strategy::wide) || needs(Strategy::packet));
    const bool needs_compressed = !prepared.has_compressed && needs(Strategy::simt);
    if (!needs_wide && !needs_compressed) return false;

    const Stopwatch build_watch;
    BvhOptions options = needs_wide ? kForBlocks : BvhOptions{};
    options.quality = quality;
    const Bvh bvh = build_bvh(prepared.arrays, options);
    if (!bvh.nodes.empty()) prepared.bounds = box_of(bvh.nodes.front());
    if (needs_wide) prepared.wide = collapse_bvh(prepared.arrays, bvh);
    if (needs_compressed) prepared.compressed = compress_bvh(prepared.arrays, bvh);
    prepared.has_wide |= needs_wide;
    prepared.has_compressed |= needs_compressed;
    prepared.build_seconds += build_watch.seconds();
    return true;
}

}  // namespace castor
