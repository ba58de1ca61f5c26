#include "trace/prepared_scene.h"

#include <algorithm>

#include "stopwatch.h"
#include "trace/instance_tree.h"

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

PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
                            std::uint64_t max_column_bytes) {
    PreparedScene prepared = flatten_alone(scene);
    add_trees(prepared, strategies, quality, max_column_bytes);
    return prepared;
}

PreparedScene prepare_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
                            std::uint64_t max_column_bytes) {
    PreparedScene prepared = flatten_alone(scene);
    scene = prepared.description;
    add_trees(prepared, strategies, quality, max_column_bytes);
    return prepared;
}

bool add_trees(PreparedScene& prepared, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
               std::uint64_t max_column_bytes) {
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
    // A saved scene's columns stand in its file, where they cannot grow.
    if (needs_wide) prepared.wide = WideBvh{};
    if (needs_compressed) prepared.compressed = CompressedBvh{};
    std::vector<Box> boxes(prepared.arrays.geometries.size());
    const bool is_one_tree = boxes.size() == 1;  // trees of instances are not cut into chunks
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const Bvh bvh = build_bvh(prepared.arrays, options, i);
        if (!bvh.nodes.empty()) boxes[i] = box_of(bvh.nodes.front());
        if (needs_wide) append(prepared.wide, collapse_bvh(prepared.arrays, bvh, is_one_tree ? max_column_bytes : kUnlimited));
        if (needs_compressed) append(prepared.compressed, compress_bvh(prepared.arrays, bvh));
    }
    if (!prepared.has_wide && !prepared.has_compressed) {
        prepared.instance_nodes = build_instance_tree(prepared.arrays, boxes);
        prepared.bounds = boxes.front();
        if (!prepared.instance_nodes.empty()) prepared.bounds.extend(box_of(prepared.instance_nodes.front()));
    }
    prepared.has_wide |= needs_wide;
    prepared.has_compressed |= needs_compressed;
    prepared.build_seconds += build_watch.seconds();
    return true;
}

std::uint64_t common_allocation(const std::vector<Device>& devices) {
    std::uint64_t bytes = kUnlimited;
    for (const Device& device : devices) bytes = std::min(bytes, device.max_allocation_bytes);
    return bytes;
}

}  // namespace castor
