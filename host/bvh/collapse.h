#pragma once

#include <array>
#include <cstdint>

#include "base/column.h"
#include "bvh/bvh.h"

namespace castor {

/// Primitives that are consecutive in Bvh::primitives.
struct PrimitiveRange {
    std::uint32_t first = 0;
    std::uint32_t triangles = 0;
    std::uint32_t spheres = 0;

    std::uint32_t count() const { return triangles + spheres; }
};

/// What the leaves of a wide tree may hold, and prices of the surface area heuristic.
struct CollapseOptions {
    std::uint32_t block_size;  // primitives that are tested at once
    std::uint32_t max_blocks;  // of a leaf
    bool kinds_apart;          // a leaf has triangles or spheres, not both
    float node_cost;           // of a visit of a wide node
    float block_cost;          // of a test of a block
};

/// A child of a wide node: another wide node, or a leaf.
struct WideChild {
    std::uint32_t node;    // of the binary tree: its box is the child's
    PrimitiveRange range;  // of a leaf. Where kinds are kept apart in a binary leaf that has both: as many of its
                           // `first` …, but of one kind
    bool is_leaf;
};

/// The one to eight children of a wide node.
class WideChildren {
public:
    static constexpr std::size_t kWidth = 8;

    void push_back(const WideChild& child) { children_[size_++] = child; }
    std::size_t size() const { return size_; }
    const WideChild& operator[](std::size_t i) const { return children_[i]; }
    const WideChild* begin() const { return children_.data(); }
    const WideChild* end() const { return children_.data() + size_; }

private:
    std::array<WideChild, kWidth> children_;
    std::size_t size_ = 0;
};

/// The 8-wide tree that costs least by the surface area heuristic among those whose nodes and leaves are subtrees of a
/// binary one: dynamic programming over the binary nodes (Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray
/// Traversal on GPUs Through Compressed Wide BVHs", §3.2). A binary leaf that is too much for one leaf of the wide tree
/// becomes several with one box.
class Collapse {
public:
    static constexpr int kWidth = WideChildren::kWidth;
    /// The share of the time in which a tree is planned. Then it is written.
    static constexpr double kPlanning = 0.4;

    /// Plans the tree, in parallel. The primitives and `bvh` must outlive it. Keeps 8 bytes a binary node.
    Collapse(const Primitives& primitives, const Bvh& bvh, const CollapseOptions& options,
             const Progress& progress = {});

    /// The children of the wide node that stands for binary node `node`: the root, or the `node` of a child that is no
    /// leaf.
    WideChildren children_of(std::uint32_t node) const;

    /// How many blocks the range fills.
    std::uint32_t block_count(const PrimitiveRange& range) const;

private:
    // For each number of places 1 … 8: how the subtree of a binary node hangs at least cost into at most so many
    // children of one wide node. That is how many places go to its left child, or 0 for one place less. One place:
    // kLeaf, or else the left child's places in a wide node of its own. Of no meaning for binary leaves.
    struct Plan {
        static constexpr std::uint8_t kLeaf = 255;
        std::array<std::uint8_t, kWidth> left_places;

        bool is_leaf() const { return left_places[0] == kLeaf; }
    };
    // What each of these costs.
    struct PlanCost {
        std::array<float, kWidth> cost{};
        PrimitiveRange range;
    };

    bool is_binary_leaf(std::uint32_t node) const { return bvh_.nodes[node].count > 0; }
    PrimitiveRange count_kinds(std::uint32_t first, std::uint32_t count) const;
    PrimitiveRange range_of(std::uint32_t node) const;
    int leaf_count(const PrimitiveRange& range) const;
    PlanCost plan(std::uint32_t node, int depth, ProgressCount& primitives_done);
    PlanCost plan_leaf(const BvhNode& binary, float area) const;
    void gather(std::uint32_t node, int places, WideChildren& children) const;
    void gather_split(std::uint32_t node, int left_places, int places, WideChildren& children) const;
    void gather_leaves(const PrimitiveRange& range, std::uint32_t node, WideChildren& children) const;

    Primitives primitives_;
    const Bvh& bvh_;
    CollapseOptions options_;
    Column<Plan> plans_;
};

}  // namespace castor
