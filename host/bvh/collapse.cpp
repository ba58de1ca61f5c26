#include "bvh/collapse.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "bvh/box.h"

namespace castor {

Collapse::Collapse(const SceneArrays& arrays, const Bvh& bvh, const CollapseOptions& options)
    : arrays_(arrays), bvh_(bvh), options_(options), plans_(bvh.nodes.size()) {
    // Children stand behind their parents. Node 1 is unused.
    for (std::size_t i = bvh_.nodes.size(); i-- > 0;)
        if (i != 1) plan(static_cast<std::uint32_t>(i));
}

std::vector<WideChild> Collapse::children_of(std::uint32_t node) const {
    const Plan& plan = plans_[node];
    std::vector<WideChild> children;
    children.reserve(kWidth);
    if (is_binary_leaf(node))
        gather_leaves(node, children);
    else if (plan.is_leaf)  // the root alone
        children.push_back({node, plan.range, true});
    else
        gather_split(node, plan.left_places[0], kWidth, children);
    return children;
}

std::uint32_t Collapse::block_count(const PrimitiveRange& range) const {
    const auto blocks = [&](std::uint32_t count) { return (count + options_.block_size - 1) / options_.block_size; };
    return options_.kinds_apart ? blocks(range.triangles) + blocks(range.spheres) : blocks(range.count());
}

PrimitiveRange Collapse::count_kinds(std::uint32_t first, std::uint32_t count) const {
    PrimitiveRange range{first, 0, 0};
    for (std::uint32_t i = first; i < first + count; ++i)
        ++(bvh_.primitives[i] < arrays_.triangle_count() ? range.triangles : range.spheres);
    return range;
}

/// How many leaves of the wide tree these primitives need.
int Collapse::leaf_count(const PrimitiveRange& range) const {
    const auto leaves = [&](std::uint32_t count) {
        const std::uint32_t capacity = options_.block_size * options_.max_blocks;
        return static_cast<int>((count + capacity - 1) / capacity);
    };
    return options_.kinds_apart ? leaves(range.triangles) + leaves(range.spheres) : leaves(range.count());
}

void Collapse::plan(std::uint32_t node) {
    Plan& plan = plans_[node];
    const shared::BvhNode& binary = bvh_.nodes[node];
    const float area = half_area(box_of(binary));
    plan.left_places.fill(0);
    if (is_binary_leaf(node)) {
        plan.range = count_kinds(binary.first, binary.count);
        plan_leaf(plan, area, options_.block_cost * area * block_count(plan.range));
        return;
    }
    const Plan& left = plans_[binary.first];
    const Plan& right = plans_[binary.first + 1];
    plan.range = {std::min(left.range.first, right.range.first), left.range.triangles + right.range.triangles,
                  left.range.spheres + right.range.spheres};
    std::array<float, kWidth> split_cost;
    for (int places = 2; places <= kWidth; ++places) {
        float best = std::numeric_limits<float>::infinity();
        for (int k = 1; k < places; ++k) {
            const float cost = left.cost[k - 1] + right.cost[places - k - 1];
            if (cost < best) {
                best = cost;
                plan.left_places[places - 1] = static_cast<std::uint8_t>(k);
            }
        }
        split_cost[places - 1] = best;
    }
    const float node_cost = options_.node_cost * area + split_cost[kWidth - 1];
    const float leaf_cost = options_.block_cost * area * block_count(plan.range);
    plan.is_leaf = leaf_count(plan.range) == 1 && leaf_cost <= node_cost;
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

/// A binary leaf that needs more leaves than there are places gets a wide node of its own.
void Collapse::plan_leaf(Plan& plan, float area, float leaf_cost) const {
    const int leaves = leaf_count(plan.range);
    assert(leaves <= kWidth);
    plan.is_leaf = leaves == 1;
    for (int places = 1; places <= kWidth; ++places)
        plan.cost[places - 1] = leaf_cost + (places < leaves ? options_.node_cost * area : 0.0f);
}

void Collapse::gather(std::uint32_t node, int places, std::vector<WideChild>& children) const {
    const Plan& plan = plans_[node];
    if (is_binary_leaf(node) && leaf_count(plan.range) <= places) {
        gather_leaves(node, children);
        return;
    }
    while (places > 1 && plan.left_places[places - 1] == 0) --places;
    if (places == 1)
        children.push_back({node, plan.range, plan.is_leaf});
    else
        gather_split(node, plan.left_places[places - 1], places, children);
}

void Collapse::gather_split(std::uint32_t node, int left_places, int places, std::vector<WideChild>& children) const {
    gather(bvh_.nodes[node].first, left_places, children);
    gather(bvh_.nodes[node].first + 1, places - left_places, children);
}

void Collapse::gather_leaves(std::uint32_t node, std::vector<WideChild>& children) const {
    const PrimitiveRange& range = plans_[node].range;
    if (options_.kinds_apart) {
        if (range.triangles > 0) children.push_back({node, {range.first, range.triangles, 0}, true});
        if (range.spheres > 0) children.push_back({node, {range.first, 0, range.spheres}, true});
        return;
    }
    const std::uint32_t capacity = options_.block_size * options_.max_blocks;
    for (std::uint32_t done = 0; done < range.count(); done += capacity)
        children.push_back({node, count_kinds(range.first + done, std::min(capacity, range.count() - done)), true});
}

}  // namespace castor
