#pragma once

#include <memory>
#include <vector>

#include "bvh/box.h"
#include "bvh/compressed.h"
#include "bvh/wide.h"
#include "castor/device.h"
#include "castor/tracer.h"
#include "progress.h"
#include "scene/mapped_file.h"
#include "scene/scene_arrays.h"
#include "trace/strategy_choice.h"

namespace castor {

/// A scene's columns and the trees that the chosen strategies walk: of each kind one for every geometry, side by side.
struct PreparedScene {
    std::shared_ptr<const MappedFile> file;  // in which columns stand; null: all are in memory of their own
    Scene description;                       // what is not geometry
    std::uint64_t fingerprint = 0;           // of the arrays
    SceneArrays arrays;
    Box bounds;                // of all bounded primitives, of instances a little larger; empty if there is none, or no strategy walks a tree
    CompressedBvh compressed;  // empty if no strategy needs it
    WideBvh wide;              // likewise
    Column<shared::InstanceNode> instance_nodes;  // empty if no strategy walks a tree, or there are no instances but number 0
    bool has_compressed = false;  // built: the tree of nothing is empty too
    bool has_wide = false;
    double flatten_seconds = 0.0;
    double build_seconds = 0.0;
};

inline constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};

/// Flattens, and builds the trees that these strategies walk, the wide one in chunks whose columns have at most so many bytes. Throws SceneError.
PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies,
                            TreeQuality quality = TreeQuality::medium, std::uint64_t max_column_bytes = kUnlimited,
                            const Progress& progress = {});
/// The same; the scene's geometry is given back before trees are built, so that both are never held.
PreparedScene prepare_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies,
                            TreeQuality quality = TreeQuality::medium, std::uint64_t max_column_bytes = kUnlimited,
                            const Progress& progress = {});

/// The largest buffer that all of the devices can have.
std::uint64_t common_allocation(const std::vector<Device>& devices);

/// Builds those of the trees that these strategies walk which are not there yet. Returns whether there were any.
bool add_trees(PreparedScene& prepared, const std::vector<StrategyChoice>& strategies,
               TreeQuality quality = TreeQuality::medium, std::uint64_t max_column_bytes = kUnlimited,
               const Progress& progress = {});

/// Calls visit(name, column) for every column of a scene and its trees. What is listed here is saved, and counted where
/// memory is planned.
template <class Prepared, class Visit>
void for_each_column(Prepared& prepared, const Visit& visit) {
    visit("vertex_position", prepared.arrays.vertex_position);
    visit("triangle_vertices", prepared.arrays.triangle_vertices);
    visit("vertex_normal", prepared.arrays.vertex_normal);
    visit("mesh_ranges", prepared.arrays.mesh_ranges);
    visit("sphere_center_radius", prepared.arrays.sphere_center_radius);
    visit("sphere_material", prepared.arrays.sphere_material);
    visit("plane_point", prepared.arrays.plane_point);
    visit("plane_normal", prepared.arrays.plane_normal);
    visit("plane_material", prepared.arrays.plane_material);
    visit("geometries", prepared.arrays.geometries);
    visit("instances", prepared.arrays.instances);
    visit("materials", prepared.arrays.materials);
    visit("lights", prepared.arrays.lights);
    visit("compressed_nodes", prepared.compressed.nodes);
    visit("compressed_primitives", prepared.compressed.primitives);
    visit("compressed_roots", prepared.compressed.roots);
    visit("wide_chunks", prepared.wide.chunks);
    visit("wide_nodes", prepared.wide.nodes);
    visit("triangle_blocks", prepared.wide.triangle_blocks);
    visit("sphere_blocks", prepared.wide.sphere_blocks);
    visit("wide_roots", prepared.wide.roots);
    visit("instance_nodes", prepared.instance_nodes);
}

}  // namespace castor
