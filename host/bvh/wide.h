#pragma once

#include <cstdint>

#include "base/column.h"
#include "bvh/bvh.h"
#include "castor/shared/types.h"

namespace castor {

/// An 8-wide tree whose leaves are blocks of four triangles or four spheres in SoA form: for devices that test boxes
/// and primitives with vectors.
struct WideBvh {
    Column<shared::WideNode> nodes;
    Column<shared::TriangleBlock> triangle_blocks;
    Column<shared::SphereBlock> sphere_blocks;
    std::uint32_t root = CASTOR_INVALID_INDEX;  // number of a node; CASTOR_INVALID_INDEX: no bounded primitive
    Column<std::uint32_t> roots;  // of several trees side by side, as `append` leaves them; the first of them is `root`
};

/// A node without children: no ray enters any of its boxes.
shared::WideNode empty_wide_node();

/// Sets the child at `place`, and its box.
void set_child(shared::WideNode& node, std::size_t place, std::uint32_t child, const Box& box);

/// Appends the tree to others, and its root to `trees.roots`. Throws Error as collapse_bvh does.
void append(WideBvh& trees, WideBvh&& tree);

/// Prices for a binary tree that is to be collapsed: leaves are tested by blocks of four; a visit of a wide node stands
/// for several of the binary tree.
inline constexpr BvhOptions kForBlocks{.block_bits = 2, .traversal_cost = 0.3f};

/// Collapses a binary tree to the 8-wide one that costs least where a leaf costs what its blocks do: see Collapse.
/// Throws Error if there are more blocks than a child code can number (2^27 - 1).
WideBvh collapse_bvh(const Primitives& primitives, const Bvh& bvh, const Progress& progress = {});

}  // namespace castor
