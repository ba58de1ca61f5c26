#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/box.h"
#include "base/column.h"
#include "base/progress.h"
#include "bvh/primitive_ref.h"
#include "bvh/primitives.h"
#include "castor/shared/constants.h"
#include "castor/tree_quality.h"

namespace castor {

/// Inner (count = 0): children are nodes `first` and `first + 1`. Leaf: primitives Bvh::primitives[first .. first +
/// count).
struct BvhNode {
    float lower[3];
    std::uint32_t first;
    float upper[3];
    std::uint32_t count;
};
static_assert(sizeof(BvhNode) == 32);

inline Box box_of(const BvhNode& node) {
    return {make_float4(node.lower[0], node.lower[1], node.lower[2]),
            make_float4(node.upper[0], node.upper[1], node.upper[2])};
}

/// A binary tree over the boxes of triangles (numbers 0 …) and spheres (numbers triangle_count …). Node 0 is the root;
/// the two children of an inner node stand side by side, `first` even from 2 on (node 1 is unused), so that a pair
/// shares a cache line. A node's box is the exact union of its primitives' (or their pieces') boxes: min and max of
/// coordinates, no rounding. A sphere's box is (c - r, c + r), each rounded to nearest.
struct Bvh {
    Column<BvhNode> nodes;             // empty if there is no bounded primitive
    Column<std::uint32_t> primitives;  // leaf order -> number; each bounded, non-degenerate primitive once unless cut
    std::uint32_t depth = 0;           // edges from the root to the deepest leaf, < CASTOR_MAX_STACK
};

/// Prices of the surface area heuristic, in units of one test of 1 << block_bits primitives at once.
struct BvhOptions {
    int block_bits = 0;
    float traversal_cost = 1.0f;  // of a visit of an inner node
    TreeQuality quality = TreeQuality::medium;
};

/// Builds the tree by the binned surface area heuristic, in parallel. Deterministic: the same primitives give the same
/// tree, whatever the number of threads. Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies".
/// Without primitives the tree is empty. Pieces of triangles that are cut have boxes of their own and stand in several
/// leaves: see PrimitiveRefs. Then subtrees are moved: see reinsert_nodes.
Bvh build_bvh(const Primitives& primitives, const BvhOptions& options = {}, const Progress& progress = {});

/// Builds the same kind of tree over any boxes. Changes the order of `refs`.
Bvh build_bvh(std::span<PrimitiveRef> refs, const BvhOptions& options);

}  // namespace castor
