#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bvh/bvh.h"
#include "scene/scene_arrays.h"

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

/// The 8-wide tree that costs least by the surface area heuristic among those whose nodes and leaves are subtrees of a
/// binary one: dynamic programming over the binary nodes (Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray
/// Traversal on GPUs Through Compressed Wide BVHs", §3.2). A binary leaf that is too much for one leaf of the wide tree
/// becomes several with one box.
class Collapse {
public:
    static constexpr int kWidth = 8;

    /// Plans the tree. `arrays` and `bvh` must outlive it.
    Collapse(const SceneArrays& arrays, const Bvh& bvh, const CollapseOptions& options);

    /// The one to eight children of the wide node that stands for binary node `node`: the root, or the `node` of a
    /// child that is no leaf.
    std::vector<WideChild> children_of(std::uint32_t node) const;

    /// How many blocks the range fills.
    std::uint32_t block_count(const PrimitiveRange& range) const;

    /// All primitives below a node of the binary tree.
    const PrimitiveRange& range_of(std::uint32_t node) const { return plans_[node].range; }

private:
    // For each binary node and each number of places 1 … 8: the least cost of hanging its subtree into at most so many
    // children of one wide node, and how: how many places go to its left child, or 0 for one place less. For one place:
    // whether it becomes a leaf.
    struct Plan {
        std::array<float, kWidth> cost;
        std::array<std::uint8_t, kWidth> left_places;
        bool is_leaf;
        PrimitiveRange range;
    };

    bool is_binary_leaf(std::uint32_t node) const { return bvh_.nodes[node].count > 0; }
    PrimitiveRange count_kinds(std::uint32_t first, std::uint32_t count) const;
    int leaf_count(const PrimitiveRange& range) const;
    void plan(std::uint32_t node);
    void plan_leaf(Plan& plan, float area, float leaf_cost) const;
    void gather(std::uint32_t node, int places, std::vector<WideChild>& children) const;
    void gather_split(std::uint32_t node, int left_places, int places, std::vector<WideChild>& children) const;
    void gather_leaves(std::uint32_t node, std::vector<WideChild>& children) const;

    const SceneArrays& arrays_;
    const Bvh& bvh_;
    CollapseOptions options_;
    std::vector<Plan> plans_;
};

}  // namespace castor
