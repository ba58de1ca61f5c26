#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/box.h"
#include "base/column.h"
#include "base/progress.h"
#include "castor/shared/scene_columns.h"
#include "castor/tree_quality.h"
#include "scene/scene_arrays.h"

namespace castor {

/// A part of a scene that is a scene by itself: columns of some of the triangles and spheres, with numbers of their
/// own, and the trees over these. A scene that a device takes as it is has one chunk; a larger one is cut in space.
/// What is not cut (planes, instances, materials, lights, textures, settings) is in the first chunk alone. All chunks
/// have all geometries, each with those of its primitives that are here and the whole one's largest_coordinate: what a
/// ray hits is the same in any chunk.
///
/// primitive_numbers gives the number within the geometry for each number here (triangles, spheres, planes), ascending
/// among a geometry's triangles, its spheres and the planes. It is empty where the chunk is the whole scene, whose
/// numbers follow from `geometries`. The trees of all geometries stand side by side, see CompressedBvh and WideBvh;
/// instance_nodes is the tree over the first chunk's instances, empty if there are none, or no other tree;
/// wide_instance_nodes is the same with eight children a node, where there are wide trees.
struct Chunk {
    SceneArrays arrays;
#define CASTOR_MEMBER_flat(name, host)
#define CASTOR_MEMBER_tree(name, host) Column<host> name;
#define CASTOR_TREE_MEMBER(name, host, device, per, place, made, trace, surface) CASTOR_MEMBER_##made(name, host)
    CASTOR_SCENE_COLUMNS(CASTOR_TREE_MEMBER)
#undef CASTOR_MEMBER_flat
#undef CASTOR_MEMBER_tree
#undef CASTOR_TREE_MEMBER
    std::uint32_t compressed_levels = 0;             // see CompressedBvh
    std::uint32_t wide_root = CASTOR_INVALID_INDEX;  // see WideBvh
    Box bounds;  // of bounded primitives, of instances a little larger; empty if there is nothing, or no tree
    bool has_compressed = false;  // built: the tree of nothing is empty too
    bool has_wide = false;
};

// Where a chunk has a column, by its `made` in the list of columns.
#define CASTOR_COLUMN_OF_CHUNK_flat(chunk, name) (chunk).arrays.name
#define CASTOR_COLUMN_OF_CHUNK_tree(chunk, name) (chunk).name

/// Calls visit(name, column) for the columns of which chunks have parts.
template <class AnyChunk, class Visit>
void for_each_cut_column(AnyChunk& chunk, const Visit& visit) {
#define CASTOR_VISIT_cut(name, column) visit(name, column);
#define CASTOR_VISIT_chunk(name, column)
#define CASTOR_VISIT_scene(name, column)
#define CASTOR_VISIT(name, host, device, per, place, made, trace, surface) \
    CASTOR_VISIT_##place(#name, CASTOR_COLUMN_OF_CHUNK_##made(chunk, name))
    CASTOR_SCENE_COLUMNS(CASTOR_VISIT)
#undef CASTOR_VISIT_cut
#undef CASTOR_VISIT_chunk
#undef CASTOR_VISIT_scene
#undef CASTOR_VISIT
}

/// The same for the others: small ones, and what is not cut.
template <class AnyChunk, class Visit>
void for_each_uncut_column(AnyChunk& chunk, const Visit& visit) {
#define CASTOR_VISIT_cut(name, column)
#define CASTOR_VISIT_chunk(name, column) visit(name, column);
#define CASTOR_VISIT_scene(name, column) visit(name, column);
#define CASTOR_VISIT(name, host, device, per, place, made, trace, surface) \
    CASTOR_VISIT_##place(#name, CASTOR_COLUMN_OF_CHUNK_##made(chunk, name))
    CASTOR_SCENE_COLUMNS(CASTOR_VISIT)
#undef CASTOR_VISIT_cut
#undef CASTOR_VISIT_chunk
#undef CASTOR_VISIT_scene
#undef CASTOR_VISIT
}

/// Calls visit(name, column) for all columns of a chunk, in the order in which they are saved.
template <class AnyChunk, class Visit>
void for_each_column(AnyChunk& chunk, const Visit& visit) {
    for_each_cut_column(chunk, visit);
    for_each_uncut_column(chunk, visit);
}

/// Returns whether a tree of the chunk has a primitive more than once, as it has of triangles that are cut (see
/// presplit).
bool has_pieces(const Chunk& chunk);

/// Which trees are wanted.
struct TreeNeeds {
    bool wide = false;
    bool compressed = false;
};

/// Bytes per bounded primitive, somewhat more than was measured on scans of one to four million triangles (82 to 95
/// medium, 110 to 140 high). Where medium quality cuts long triangles it is as much as with high. Building counts what
/// is held at its peak, the tree included.
struct BytesPerPrimitive {
    double building;
    double wide_tree, wide_blocks;  // the tree, and of it the largest column
    double compressed_tree;
};
const BytesPerPrimitive& bytes_per_primitive(TreeQuality quality);

/// The bytes that a scene or a chunk takes on a device.
struct SceneSizes {
    std::uint64_t largest_column = 0;  // of those that can be cut
    std::uint64_t total = 0;
};

/// Returns the bytes of the columns that all chunks use, and that the first one has.
std::uint64_t scene_column_bytes(const Chunk& chunk);

/// Returns the sizes of a chunk with all wanted trees, without the columns that all chunks use: exact where the trees
/// exist, estimated where they do not.
SceneSizes sizes_of(const Chunk& chunk, const TreeNeeds& needs, TreeQuality quality);

/// Adds the estimated sizes of trees over so many bounded primitives.
void add_estimated_trees(SceneSizes& sizes, std::uint64_t primitives, const TreeNeeds& needs, TreeQuality quality);

/// How much of a scene a device can hold.
struct ChunkLimits {
    static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
    std::uint64_t column_bytes = kUnlimited;  // in one buffer
    std::uint64_t scene_bytes =
        kUnlimited;  // at once; of a larger scene chunks stream, each no larger than kShareOfChunk of this
    static constexpr std::uint64_t kShareOfChunk = 4;

    /// What is left where columns that all chunks use take so many bytes: of little memory at least a part, so that
    /// chunks do not become ever smaller for the sake of what cannot be cut.
    ChunkLimits without(std::uint64_t scene_columns) const {
        if (scene_bytes == kUnlimited) return *this;
        const std::uint64_t left = scene_bytes - std::min(scene_columns, scene_bytes);
        return {column_bytes, std::max(left, scene_bytes / kShareOfChunk)};
    }

    /// The most that a chunk may take, of a scene of so many bytes.
    std::uint64_t chunk_bytes(std::uint64_t scene_total) const {
        return scene_total > scene_bytes ? scene_bytes / kShareOfChunk : kUnlimited;
    }
};

/// Returns into how many chunks something of these sizes must be cut, in a scene of `scene_total` bytes; 1 if it fits.
std::size_t chunks_needed(const SceneSizes& sizes, std::uint64_t scene_total, const ChunkLimits& limits);

/// Cuts a chunk in space into about so many, evenly by primitives; each primitive is in one of them, degenerate
/// triangles are in none. Trees are not cut: the new chunks have none. One chunk, with all of it, if there is less than
/// two bounded primitives.
std::vector<Chunk> cut(const Chunk& whole, std::size_t parts, const Progress& progress = {});

}  // namespace castor
