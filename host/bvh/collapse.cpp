#include "bvh/collapse.h"

#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <cassert>
#include <limits>

#include "base/box.h"

namespace castor {

namespace {

// Levels of the binary tree below which a subtree is planned by one task.
constexpr int kTaskDepth = 8;

}  // namespace

Collapse::Collapse(const Primitives& primitives, const Bvh& bvh, const CollapseOptions& options,
                   const Progress& progress)
    : primitives_(primitives), bvh_(bvh), options_(options), plans_(bvh.nodes.size()) {
    ProgressCount primitives_done(progress, bvh_.primitives.size());
    if (!bvh_.nodes.empty()) plan(0, 0, primitives_done);
}

WideChildren Collapse::children_of(std::uint32_t node) const {
    WideChildren children;
    if (is_binary_leaf(node))
        gather_leaves(range_of(node), node, children);
    else if (plans_[node].is_leaf())  // the root alone
        children.push_back({node, range_of(node), true});
    else
        gather_split(node, plans_[node].left_places[0], kWidth, children);
    return children;
}

std::uint32_t Collapse::block_count(const PrimitiveRange& range) const {
    const auto blocks = [&](std::uint32_t count) { return (count + options_.block_size - 1) / options_.block_size; };
    return options_.kinds_apart ? blocks(range.triangles) + blocks(range.spheres) : blocks(range.count());
}

PrimitiveRange Collapse::count_kinds(std::uint32_t first, std::uint32_t count) const {
    if (primitives_.sphere_count() == 0) return {first, count, 0};
    PrimitiveRange range{first, 0, 0};
    for (std::uint32_t i = first; i < first + count; ++i)
        ++(bvh_.primitives[i] < primitives_.triangle_count() ? range.triangles : range.spheres);
    return range;
}

/// The primitives below a node are consecutive.
PrimitiveRange Collapse::range_of(std::uint32_t node) const {
    std::uint32_t leftmost = node, rightmost = node;
    while (!is_binary_leaf(leftmost)) leftmost = bvh_.nodes[leftmost].first;
    while (!is_binary_leaf(rightmost)) rightmost = bvh_.nodes[rightmost].first + 1;
    const std::uint32_t first = bvh_.nodes[leftmost].first;
    return count_kinds(first, bvh_.nodes[rightmost].first + bvh_.nodes[rightmost].count - first);
}

/// How many leaves of the wide tree these primitives need.
int Collapse::leaf_count(const PrimitiveRange& range) const {
    const auto leaves = [&](std::uint32_t count) {
        const std::uint32_t capacity = options_.block_size * options_.max_blocks;
        return static_cast<int>((count + capacity - 1) / capacity);
    };
    return options_.kinds_apart ? leaves(range.triangles) + leaves(range.spheres) : leaves(range.count());
}

Collapse::PlanCost Collapse::plan(std::uint32_t node, int depth, ProgressCount& primitives_done) {
    const BvhNode& binary = bvh_.nodes[node];
    const float area = static_cast<float>(half_area(box_of(binary)));
    if (is_binary_leaf(node)) {
        if (depth < kTaskDepth) primitives_done.add(binary.count);
        return plan_leaf(binary, area);
    }

    PlanCost left, right;
    const auto plan_left = [&] { left = plan(binary.first, depth + 1, primitives_done); };
    const auto plan_right = [&] { right = plan(binary.first + 1, depth + 1, primitives_done); };
    if (depth < kTaskDepth) {
        tbb::parallel_invoke(plan_left, plan_right);
    } else {
        plan_left();
        plan_right();
    }
    PlanCost best;
    best.range = {left.range.first, left.range.triangles + right.range.triangles,
                  left.range.spheres + right.range.spheres};
    auto& left_places = plans_[node].left_places;
    for (int places = 2; places <= kWidth; ++places) {
        best.cost[places - 1] = std::numeric_limits<float>::infinity();
        for (int k = 1; k < places; ++k) {
            const float cost = left.cost[k - 1] + right.cost[places - k - 1];
            if (cost < best.cost[places - 1]) {
                best.cost[places - 1] = cost;
                left_places[places - 1] = static_cast<std::uint8_t>(k);
            }
        }
    }
    if (depth == kTaskDepth) primitives_done.add(best.range.count());
    const float node_cost = options_.node_cost * area + best.cost[kWidth - 1];
    const float leaf_cost = options_.block_cost * area * static_cast<float>(block_count(best.range));
    const bool is_leaf = leaf_count(best.range) == 1 && leaf_cost <= node_cost;
    best.cost[0] = is_leaf ? leaf_cost : node_cost;
    left_places[0] = is_leaf ? Plan::kLeaf : left_places[kWidth - 1];
    for (int places = 2; places <= kWidth; ++places) {
        if (best.cost[places - 2] > best.cost[places - 1]) continue;
        best.cost[places - 1] = best.cost[places - 2];
        left_places[places - 1] = 0;
    }
    return best;
}

/// A binary leaf that needs more leaves than there are places gets a wide node of its own.
Collapse::PlanCost Collapse::plan_leaf(const BvhNode& binary, float area) const {
    PlanCost result;
    result.range = count_kinds(binary.first, binary.count);
    const float leaf_cost = options_.block_cost * area * static_cast<float>(block_count(result.range));
    const int leaves = leaf_count(result.range);
    assert(leaves <= kWidth);
    for (int places = 1; places <= kWidth; ++places)
        result.cost[places - 1] = leaf_cost + (places < leaves ? options_.node_cost * area : 0.0f);
    return result;
}

void Collapse::gather(std::uint32_t node, int places, WideChildren& children) const {
    if (is_binary_leaf(node)) {
        const PrimitiveRange range = range_of(node);
        if (leaf_count(range) <= places)
            gather_leaves(range, node, children);
        else
            children.push_back({node, {}, false});
        return;
    }
    const Plan& plan = plans_[node];
    while (places > 1 && plan.left_places[places - 1] == 0) --places;
    if (places > 1)
        gather_split(node, plan.left_places[places - 1], places, children);
    else if (plan.is_leaf())
        children.push_back({node, range_of(node), true});
    else
        children.push_back({node, {}, false});
}

void Collapse::gather_split(std::uint32_t node, int left_places, int places, WideChildren& children) const {
    gather(bvh_.nodes[node].first, left_places, children);
    gather(bvh_.nodes[node].first + 1, places - left_places, children);
}

void Collapse::gather_leaves(const PrimitiveRange& range, std::uint32_t node, WideChildren& children) const {
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
