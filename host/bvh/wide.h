#pragma once

#include <cstdint>

#include "bvh/bvh.h"
#include "castor/shared/types.h"
#include "column.h"
#include "scene/scene_arrays.h"

namespace castor {

/// A part of a WideBvh's columns that is a tree by itself: its children's numbers count from the part's first node and blocks, its root is the first node.
struct WideChunk {
    std::uint64_t first_node, node_count;
    std::uint64_t first_triangle_block, triangle_block_count;
    std::uint64_t first_sphere_block, sphere_block_count;
};

/// An 8-wide tree whose leaves are blocks of four triangles or four spheres in SoA form: for devices that test boxes
/// and primitives with vectors. Cut in space into chunks where its columns would be too large for a device's buffers.
struct WideBvh {
    Column<shared::WideNode> nodes;
    Column<shared::TriangleBlock> triangle_blocks;
    Column<shared::SphereBlock> sphere_blocks;
    std::uint32_t root = CASTOR_INVALID_INDEX;  // number of a node in each chunk; CASTOR_INVALID_INDEX: no bounded primitive
    Column<std::uint32_t> roots;  // of several trees side by side, as `append` leaves them; the first of them is `root`
    Column<WideChunk> chunks;     // one alone where there are several trees; empty: no bounded primitive
};

/// Appends the tree to others, and its root to `trees.roots`. Throws Error as collapse_bvh does.
void append(WideBvh& trees, WideBvh&& tree);

/// Prices for a binary tree that is to be collapsed: leaves are tested by blocks of four; a visit of a wide node stands
/// for several of the binary tree.
inline constexpr BvhOptions kForBlocks{.block_bits = 2, .traversal_cost = 0.3f};

/// Collapses a binary tree to the 8-wide one that costs least where a leaf costs what its blocks do: see Collapse. No column of a chunk is larger than
/// `max_column_bytes`, but for those of a single leaf, nor has it more blocks than a child code can number.
WideBvh collapse_bvh(const SceneArrays& arrays, const Bvh& bvh, std::uint64_t max_column_bytes = ~std::uint64_t{0},
                     const Progress& progress = {});

}  // namespace castor
