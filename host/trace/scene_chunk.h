#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/box.h"
#include "base/column.h"
#include "base/progress.h"
#include "bvh/compressed.h"
#include "bvh/wide.h"
#include "castor/tree_quality.h"
#include "scene/scene_arrays.h"

namespace castor {

/// A part of a scene that is a scene by itself: columns of some of the triangles and spheres, with numbers of their
/// own, and the trees over these. A scene that a device takes as it is has one chunk; a larger one is cut in space.
/// What is not cut (planes, instances, materials, lights, settings) is in the first chunk alone. All chunks have all
/// geometries, each with those of its primitives that are here and the whole one's largest_coordinate: what a ray hits
/// is the same in any chunk.
struct SceneChunk {
    SceneArrays arrays;
    /// Number here (triangles, spheres, planes) -> number within the geometry, ascending among a geometry's triangles,
    /// its spheres and the planes. Empty: the chunk is the whole scene, whose numbers follow from `geometries`.
    Column<std::uint32_t> primitive_numbers;
    Box bounds;  // of what is bounded, of instances a little larger; empty if there is nothing, or no tree
    CompressedBvh compressed;                     // of each geometry one, side by side
    WideBvh wide;                                 // likewise
    Column<shared::InstanceNode> instance_nodes;  // of the first chunk's instances; empty if there are none, or no tree
    bool has_compressed = false;                  // built: the tree of nothing is empty too
    bool has_wide = false;
};

/// Calls visit(name, column) for the columns of which chunks have parts.
template <class Chunk, class Visit>
void for_each_cut_column(Chunk& chunk, const Visit& visit) {
    visit("vertex_position", chunk.arrays.vertex_position);
    visit("triangle_vertices", chunk.arrays.triangle_vertices);
    visit("vertex_normal", chunk.arrays.vertex_normal);
    visit("sphere_center_radius", chunk.arrays.sphere_center_radius);
    visit("sphere_material", chunk.arrays.sphere_material);
    visit("primitive_numbers", chunk.primitive_numbers);
    visit("compressed_nodes", chunk.compressed.nodes);
    visit("compressed_primitives", chunk.compressed.primitives);
    visit("wide_nodes", chunk.wide.nodes);
    visit("triangle_blocks", chunk.wide.triangle_blocks);
    visit("sphere_blocks", chunk.wide.sphere_blocks);
}

/// The others: small ones, and what is not cut.
template <class Chunk, class Visit>
void for_each_uncut_column(Chunk& chunk, const Visit& visit) {
    visit("mesh_ranges", chunk.arrays.mesh_ranges);
    visit("plane_point", chunk.arrays.plane_point);
    visit("plane_normal", chunk.arrays.plane_normal);
    visit("plane_material", chunk.arrays.plane_material);
    visit("geometries", chunk.arrays.geometries);
    visit("instances", chunk.arrays.instances);
    visit("materials", chunk.arrays.materials);
    visit("lights", chunk.arrays.lights);
    visit("compressed_roots", chunk.compressed.roots);
    visit("wide_roots", chunk.wide.roots);
    visit("instance_nodes", chunk.instance_nodes);
}

/// All columns of a chunk: what is listed here is saved, uploaded, and counted where memory is planned.
template <class Chunk, class Visit>
void for_each_column(Chunk& chunk, const Visit& visit) {
    for_each_cut_column(chunk, visit);
    for_each_uncut_column(chunk, visit);
}

/// The trees that are wanted.
struct TreeNeeds {
    bool wide = false;
    bool compressed = false;
};

/// Bytes a bounded primitive, somewhat more than was measured on scans of one to four million triangles (82 to 95
/// medium, 110 to 140 high). Building counts what is held at its peak, the tree included.
struct BytesPerPrimitive {
    double building;
    double wide_tree, wide_blocks;  // the tree, and of it the largest column
    double compressed_tree;
};
const BytesPerPrimitive& bytes_per_primitive(TreeQuality quality);

/// What a scene or a chunk takes on a device.
struct SceneSizes {
    std::uint64_t largest_column = 0;  // of those that can be cut
    std::uint64_t total = 0;
};

/// Of a chunk once it has the trees: exact but for trees that are yet to be built.
SceneSizes sizes_of(const SceneChunk& chunk, const TreeNeeds& needs, TreeQuality quality);

/// Adds what trees over so many bounded primitives are going to take.
void add_estimated_trees(SceneSizes& sizes, std::uint64_t primitives, const TreeNeeds& needs, TreeQuality quality);

/// What a device can hold of a scene.
struct ChunkLimits {
    static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
    std::uint64_t column_bytes = kUnlimited;  // in one buffer
    std::uint64_t scene_bytes =
        kUnlimited;  // at once; of a larger scene chunks stream, each no larger than kShareOfChunk of this
    static constexpr std::uint64_t kShareOfChunk = 4;

    /// The most that a chunk may take, of a scene of so many bytes.
    std::uint64_t chunk_bytes(std::uint64_t scene_total) const {
        return scene_total > scene_bytes ? scene_bytes / kShareOfChunk : kUnlimited;
    }
};

/// Into how many chunks something of these sizes is to be cut, in a scene of `scene_total` bytes: 1 if it fits.
std::size_t chunks_needed(const SceneSizes& sizes, std::uint64_t scene_total, const ChunkLimits& limits);

/// Cuts a chunk in space into about so many, evenly by primitives; each primitive is in one of them, degenerate
/// triangles are in none. Trees are not cut: the new chunks have none. One chunk, with all of it, if there is less than
/// two bounded primitives.
std::vector<SceneChunk> cut(const SceneChunk& whole, std::size_t parts, const Progress& progress = {});

}  // namespace castor
