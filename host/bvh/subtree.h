#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/column.h"
#include "bvh/bvh.h"

namespace castor {

/// A tree as tasks build it, before anyone knows where its nodes will stand: small trees are blocks of nodes, large
/// ones have two subtrees.
struct Subtree {
    BvhNode root{};              // inner, and a block: `first` counts within `nodes`
    std::uint32_t depth = 0;     // edges to the deepest leaf, from the root of the whole tree
    std::vector<BvhNode> nodes;  // the block: all descendants in pairs of children, depth first
    std::unique_ptr<Subtree> left, right;
};

/// The nodes in their final order, depth first by pairs: the root, an unused node, and then pairs of children.
Column<BvhNode> lay_out(const Subtree& tree);

}  // namespace castor
