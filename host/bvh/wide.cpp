#include "bvh/wide.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "bvh/box.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr int kWidth = 8;
constexpr std::uint32_t kBlockSize = 4;
constexpr std::uint32_t kMaxBlocks = CASTOR_WIDE_COUNT_MASK + 1;

// Prices of a visit of a wide node and of a test of a block, measured on diffuse rays.
constexpr float kNodeCost = 1.0f;
constexpr float kBlockCost = 0.6f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Box box_of(const shared::BvhNode& node) {
    return {{node.lower[0], node.lower[1], node.lower[2]}, {node.upper[0], node.upper[1], node.upper[2]}};
}

/// The primitives of a subtree, which are consecutive in Bvh::primitives; triangles and spheres never share a block.
struct Range {
    std::uint32_t first = 0;
    std::uint32_t triangles = 0;
    std::uint32_t spheres = 0;

    std::uint32_t count() const { return triangles + spheres; }
    bool is_mixed() const { return triangles > 0 && spheres > 0; }
    std::uint32_t blocks() const { return (triangles + kBlockSize - 1) / kBlockSize + (spheres + kBlockSize - 1) / kBlockSize; }
};

/// For each binary node and each number of places 1 … 8: the least cost of hanging its subtree into at most so many children of one wide node,
/// and how: how many places go to its left child, or 0 for one place less. For one place: whether it becomes a leaf.
struct Plan {
    std::array<float, kWidth> cost;
    std::array<std::uint8_t, kWidth> left_places;
    bool is_leaf;
    Range range;
};

/// A child of a wide node in the making: a binary node, or one kind of a leaf's primitives.
struct Child {
    std::uint32_t node;
    Range range;
    bool is_leaf;
};

class Collapse {
public:
    Collapse(const SceneArrays& arrays, const Bvh& bvh) : arrays_(arrays), bvh_(bvh), plans_(bvh.nodes.size()) {}

    WideBvh run() {
        if (bvh_.nodes.empty()) return {};
        // Children stand behind their parents. Node 1 is unused.
        for (std::size_t i = bvh_.nodes.size(); i-- > 0;)
            if (i != 1) plan(static_cast<std::uint32_t>(i));
        wide_.root = add_node(0);
        fill_blocks();
        return std::move(wide_);
    }

private:
    bool is_binary_leaf(std::uint32_t node) const { return bvh_.nodes[node].count > 0; }

    Range range_of(std::uint32_t node) const {
        const shared::BvhNode& n = bvh_.nodes[node];
        if (n.count == 0) {
            const Range& left = plans_[n.first].range;
            const Range& right = plans_[n.first + 1].range;
            return {std::min(left.first, right.first), left.triangles + right.triangles, left.spheres + right.spheres};
        }
        Range range{n.first, 0, 0};
        for (std::uint32_t i = n.first; i < n.first + n.count; ++i)
            ++(bvh_.primitives[i] < arrays_.triangle_count() ? range.triangles : range.spheres);
        return range;
    }

    void plan(std::uint32_t node) {
        Plan& plan = plans_[node];
        plan.range = range_of(node);
        const float area = half_area(box_of(bvh_.nodes[node]));
        const float leaf_cost = kBlockCost * area * plan.range.blocks();
        plan.left_places.fill(0);
        if (is_binary_leaf(node)) {
            plan.is_leaf = true;
            plan.cost.fill(leaf_cost);
            if (plan.range.is_mixed()) plan.cost[0] += kNodeCost * area;
            return;
        }
        const Plan& left = plans_[bvh_.nodes[node].first];
        const Plan& right = plans_[bvh_.nodes[node].first + 1];
        std::array<float, kWidth> split_cost;
        for (int places = 2; places <= kWidth; ++places) {
            float best = kInfinity;
            for (int k = 1; k < places; ++k) {
                const float cost = left.cost[k - 1] + right.cost[places - k - 1];
                if (cost < best) {
                    best = cost;
                    plan.left_places[places - 1] = static_cast<std::uint8_t>(k);
                }
            }
            split_cost[places - 1] = best;
        }
        const float node_cost = kNodeCost * area + split_cost[kWidth - 1];
        const bool fits = !plan.range.is_mixed() && plan.range.blocks() <= kMaxBlocks;
        plan.is_leaf = fits && leaf_cost <= node_cost;
        plan.cost[0] = plan.is_leaf ? leaf_cost : node_cost;
        plan.left_places[0] = plan.left_places[kWidth - 1];  // those of its own wide node
        for (int places = 2; places <= kWidth; ++places) {
            plan.cost[places - 1] = split_cost[places - 1];
            if (plan.cost[places - 2] <= split_cost[places - 1]) {
                plan.cost[places - 1] = plan.cost[places - 2];
                plan.left_places[places - 1] = 0;
            }
        }
    }

    void gather(std::uint32_t node, int places, std::vector<Child>& children) const {
        const Plan& plan = plans_[node];
        if (is_binary_leaf(node) && plan.range.is_mixed() && places > 1) {
            gather_kinds(node, children);
            return;
        }
        while (places > 1 && plan.left_places[places - 1] == 0) --places;
        if (places == 1) {
            children.push_back({node, plan.range, plan.is_leaf && !plan.range.is_mixed()});
            return;
        }
        gather_split(node, plan.left_places[places - 1], places, children);
    }

    void gather_split(std::uint32_t node, int left_places, int places, std::vector<Child>& children) const {
        gather(bvh_.nodes[node].first, left_places, children);
        gather(bvh_.nodes[node].first + 1, places - left_places, children);
    }

    void gather_kinds(std::uint32_t node, std::vector<Child>& children) const {
        const Range& range = plans_[node].range;
        children.push_back({node, {range.first, range.triangles, 0}, true});
        children.push_back({node, {range.first, 0, range.spheres}, true});
    }

    std::uint32_t add_node(std::uint32_t node) {
        std::vector<Child> children;
        const Plan& plan = plans_[node];
        if (plan.is_leaf && !plan.range.is_mixed())  // the root alone
            children.push_back({node, plan.range, true});
        else if (is_binary_leaf(node))
            gather_kinds(node, children);
        else
            gather_split(node, plans_[node].left_places[0], kWidth, children);

        const std::uint32_t index = static_cast<std::uint32_t>(wide_.nodes.size());
        wide_.nodes.push_back(empty_node());
        for (std::size_t place = 0; place < children.size(); ++place) {
            const Child& child = children[place];
            const std::uint32_t code = child.is_leaf ? add_leaf(child) : add_node(child.node);
            shared::WideNode& wide = wide_.nodes[index];  // may have moved
            wide.child[place] = code;
            const Box box = box_of(bvh_.nodes[child.node]);
            for (int axis = 0; axis < 3; ++axis) {
                wide.planes[axis][0][place] = box.lower[axis];
                wide.planes[axis][1][place] = box.upper[axis];
            }
        }
        return index;
    }

    static shared::WideNode empty_node() {
        shared::WideNode node{};
        for (auto& axis : node.planes) {
            std::fill(std::begin(axis[0]), std::end(axis[0]), kInfinity);
            std::fill(std::begin(axis[1]), std::end(axis[1]), -kInfinity);
        }
        std::fill(std::begin(node.child), std::end(node.child), CASTOR_INVALID_INDEX);
        return node;
    }

    std::uint32_t add_leaf(const Child& child) {
        const bool spheres = child.range.spheres > 0;
        std::uint32_t& next = spheres ? sphere_block_count_ : triangle_block_count_;
        const std::uint32_t first = next;
        const std::uint32_t blocks = child.range.blocks();
        next += blocks;
        // A child code has no room for more blocks.
        if (next > CASTOR_WIDE_FIRST_MASK)
            throw Error(fmt::format("the scene needs more than {} blocks of four primitives, the most that the wide tree can number; "
                                    "use the strategy simt", CASTOR_WIDE_FIRST_MASK));
        leaves_.push_back({child.node, first, spheres});
        return CASTOR_WIDE_LEAF | (spheres ? CASTOR_WIDE_SPHERES : 0u) | (blocks - 1) << CASTOR_WIDE_COUNT_SHIFT | first;
    }

    void fill_blocks() {
        wide_.triangle_blocks.resize(triangle_block_count_);
        wide_.sphere_blocks.resize(sphere_block_count_);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves_.size(), 1024), [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) fill_leaf(leaves_[i]);
        });
    }

    struct Leaf {
        std::uint32_t node;
        std::uint32_t first_block;
        bool spheres;
    };

    void fill_leaf(const Leaf& leaf) {
        const Range& range = plans_[leaf.node].range;
        std::vector<std::uint32_t> numbers;
        for (std::uint32_t i = range.first; i < range.first + range.count(); ++i)
            if ((bvh_.primitives[i] >= arrays_.triangle_count()) == leaf.spheres) numbers.push_back(bvh_.primitives[i]);
        for (std::size_t i = 0; i < numbers.size(); i += kBlockSize) {
            const std::size_t block = leaf.first_block + i / kBlockSize;
            const std::size_t count = std::min<std::size_t>(kBlockSize, numbers.size() - i);
            if (leaf.spheres)
                fill_spheres(wide_.sphere_blocks[block], &numbers[i], count);
            else
                fill_triangles(wide_.triangle_blocks[block], &numbers[i], count);
        }
    }

    void fill_triangles(shared::TriangleBlock& block, const std::uint32_t* numbers, std::size_t count) const {
        for (std::size_t lane = 0; lane < kBlockSize; ++lane) {
            block.primitive[lane] = lane < count ? numbers[lane] : CASTOR_INVALID_INDEX;
            for (int vertex = 0; vertex < 3; ++vertex)
                for (int axis = 0; axis < 3; ++axis)
                    block.vertex[vertex][axis][lane] =
                        lane < count ? arrays_.vertex_position[arrays_.triangle_vertices[numbers[lane]][vertex]][axis] : kNaN;
        }
    }

    void fill_spheres(shared::SphereBlock& block, const std::uint32_t* numbers, std::size_t count) const {
        for (std::size_t lane = 0; lane < kBlockSize; ++lane) {
            block.primitive[lane] = lane < count ? numbers[lane] : CASTOR_INVALID_INDEX;
            for (int i = 0; i < 4; ++i)
                block.center_radius[i][lane] =
                    lane < count ? arrays_.sphere_center_radius[numbers[lane] - arrays_.triangle_count()][i] : kNaN;
        }
    }

    const SceneArrays& arrays_;
    const Bvh& bvh_;
    std::vector<Plan> plans_;
    std::vector<Leaf> leaves_;
    std::uint32_t triangle_block_count_ = 0;
    std::uint32_t sphere_block_count_ = 0;
    WideBvh wide_;
};

}  // namespace

WideBvh collapse_bvh(const SceneArrays& arrays, const Bvh& bvh) { return Collapse(arrays, bvh).run(); }

}  // namespace castor
