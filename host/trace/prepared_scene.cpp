#include "trace/prepared_scene.h"

#include <algorithm>

#include "scene/fingerprint.h"
#include "stopwatch.h"
#include "trace/instance_tree.h"

namespace castor {

namespace {

// Shares of the time: flattening of all; a binary tree, and the 8-wide one, of those that are built of a geometry.
constexpr double kFlattening = 0.06;
constexpr double kBinary = 0.7;
constexpr double kWide = 0.85;

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

PreparedScene flatten_alone(const Scene& scene, const Progress& progress) {
    PreparedScene prepared;
    const Stopwatch watch;
    prepared.description = without_geometry(scene);
    prepared.arrays = flatten(scene, progress);
    prepared.fingerprint = fingerprint(prepared.arrays);
    prepared.flatten_seconds = watch.seconds();
    return prepared;
}

// Of all bounded primitives.
double share_of(const SceneArrays& arrays, std::size_t geometry) {
    const std::size_t all = arrays.triangle_count() + arrays.sphere_count();
    const shared::Geometry& part = arrays.geometries[geometry];
    return all == 0 ? 0.0 : (double(part.triangle_count) + double(part.sphere_count)) / double(all);
}

}  // namespace

PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
                            std::uint64_t max_column_bytes, const Progress& progress) {
    PreparedScene prepared = flatten_alone(scene, progress.part(0.0, kFlattening));
    add_trees(prepared, strategies, quality, max_column_bytes, progress.part(kFlattening, 1.0));
    return prepared;
}

PreparedScene prepare_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
                            std::uint64_t max_column_bytes, const Progress& progress) {
    PreparedScene prepared = flatten_alone(scene, progress.part(0.0, kFlattening));
    scene = prepared.description;
    add_trees(prepared, strategies, quality, max_column_bytes, progress.part(kFlattening, 1.0));
    return prepared;
}

bool add_trees(PreparedScene& prepared, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
               std::uint64_t max_column_bytes, const Progress& progress) {
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
    double done = 0.0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const double begin = done;
        done += share_of(prepared.arrays, i);
        const Progress part = progress.part(begin, done);
        const double wide_end = needs_compressed ? kWide : 1.0;
        const Bvh bvh = build_bvh(prepared.arrays, options, i, part.part(0.0, kBinary));
        if (!bvh.nodes.empty()) boxes[i] = box_of(bvh.nodes.front());
        if (needs_wide) append(prepared.wide, collapse_bvh(prepared.arrays, bvh, is_one_tree ? max_column_bytes : kUnlimited, part.part(kBinary, wide_end)));
        if (needs_compressed) append(prepared.compressed, compress_bvh(prepared.arrays, bvh, part.part(needs_wide ? wide_end : kBinary, 1.0)));
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
