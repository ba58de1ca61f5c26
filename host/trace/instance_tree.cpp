#include "trace/instance_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <tuple>
#include <utility>

#include "bvh/bvh.h"
#include "bvh/wide.h"
#include "scene/placement.h"

namespace castor {

namespace {

/// Where a ray may hit an instance: in `box`, enlarged by `slope` times the largest coordinate |o| of the ray's origin.
/// All norms are largest coordinates, or row sums of matrices; e = 2^-24.
///
/// Let A and b be to_object as it is, M the inverse of A, a = ||A||, m = ||M||, a m <= 2^20; B the box of the cover
/// that holds the primitive's, or its piece's; L the whole geometry's largest coordinate, and W that of all M(B - b).
/// The device rounds o' = A o + b to within 4e (a |o| + |b|) and d' = A d to within 4e a |d|. If it accepts a hit at t,
/// then t lies between entry and exit of the primitive's own box as computed, so that o' + t d' lies in B but for 72e
/// (L + |o'|): CASTOR_BOX_PADDING is 64e, and the slab arithmetic takes 4e at most. So the exact image of the world's
/// point w = o + t d lies in B but for
///     E = 72e (L + |o'|) + 4e (a |o| + |b|) + 4e a t |d|.
/// t |d| <= |w| + |o| <= W + m E + |o|, and the m E in it is a quarter of E at most. With |o'| <= (1 + 4e)(a |o| + |b|)
///     E <= 4/3 (72e + 4e + 5e) (L + |b| + a (|o| + W)) <= 128e (L + |b| + a (|o| + W)),
/// and w lies in M(B - b) but for m E; 2^-100 more covers what underflows. Entry and exit of this box as computed,
/// without padding of their own, take another 4e (W + |o|); there are 32e here. M is computed in double precision: what
/// that is off is less than 2^-30 of the terms above.
///
/// An instance that moves by v while the shutter is open meets at time s the ray from o - s v, which is rounded to
/// within e (|o| + |v|). So w - s v lies in the box above, enlarged for |o| + |v| in place of |o|, but for this
/// rounding: the box of both ends of the motion, with slope + 2e in place of slope, and (slope + 2e) |v| more of
/// padding, covers w at any time. Its coordinates are up to W + |v|.
struct InstanceBounds {
    Box box;
    float slope;

    InstanceBounds(const shared::Instance& instance, const BoxCover& geometry, float largest_coordinate) {
        constexpr double kRounding = 0x1p-24;
        glm::dmat3 to_object;
        glm::dvec3 b;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) to_object[column][row] = instance.to_object[row][column];
            b[row] = instance.to_object[row][3];
        }
        const glm::dmat3 to_world = glm::inverse(to_object);
        const glm::dmat3 magnitudes(glm::abs(to_world[0]), glm::abs(to_world[1]), glm::abs(to_world[2]));
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        glm::dvec3 lower(kInfinity), upper(-kInfinity);
        for (const Box& part : geometry) {
            const glm::dvec3 part_lower(part.lower[0], part.lower[1], part.lower[2]);
            const glm::dvec3 part_upper(part.upper[0], part.upper[1], part.upper[2]);
            const glm::dvec3 middle = to_world * (0.5 * (part_lower + part_upper) - b);
            const glm::dvec3 half = magnitudes * (0.5 * (part_upper - part_lower));
            lower = glm::min(lower, middle - half);
            upper = glm::max(upper, middle + half);
        }
        const auto largest = [](const glm::dvec3& v) {
            return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
        };
        const double world = std::max(largest(lower), largest(upper));
        const double a = row_norm(to_object), m = row_norm(to_world);
        const glm::dvec3 motion(instance.motion[0], instance.motion[1], instance.motion[2]);
        const double moved = largest(motion);
        const double exact_slope = kRounding * (m * 128 * a + 32 + (moved > 0.0 ? 2 : 0));
        const double padding = m * (128 * kRounding * (largest_coordinate + largest(b) + a * world) + 0x1p-100) +
                               32 * kRounding * (world + moved) + exact_slope * moved;
        for (int axis = 0; axis < 3; ++axis) {
            const double begin = std::min(0.0, motion[axis]), end = std::max(0.0, motion[axis]);
            box.lower[axis] = rounded_down(lower[axis] + begin - padding);
            box.upper[axis] = -rounded_down(-(upper[axis] + end + padding));
        }
        slope = -rounded_down(-exact_slope);
    }

    static float rounded_down(double x) {
        const float rounded = static_cast<float>(x);
        return static_cast<double>(rounded) <= x ? rounded
                                                 : std::nextafter(rounded, -std::numeric_limits<float>::infinity());
    }
};

class InstanceTreeBuilder {
public:
    InstanceTreeBuilder(const Column<shared::Instance>& instances, const Column<shared::Geometry>& geometries,
                        const std::vector<BoxCover>& covers) {
        std::vector<PrimitiveRef> refs;
        for (std::size_t i = 1; i < instances.size(); ++i) {
            const std::uint32_t geometry = instances[i].geometry;
            if (covers[geometry].empty()) continue;
            bounds_.emplace_back(instances[i], covers[geometry], geometries[geometry].largest_coordinate);
            numbers_.push_back(static_cast<std::uint32_t>(i));
            refs.push_back(PrimitiveRef::make(bounds_.back().box, static_cast<std::uint32_t>(refs.size())));
        }
        bvh_ = build_bvh(refs, BvhOptions{});
    }

    Column<shared::InstanceNode> build() {
        if (bvh_.nodes.empty()) return {};
        nodes_.resize(1);
        write(0, 0);
        return std::move(nodes_);
    }

private:
    void write(std::size_t at, std::uint32_t binary) {
        const BvhNode& node = bvh_.nodes[binary];
        if (node.count > 0) return write_leaf(at, node.first, node.count);
        const std::size_t first = append_pair();
        write(first, node.first);
        write(first + 1, node.first + 1);
        join(at, first);
    }

    /// One instance is a leaf, more are a pair: the first of them, and the others.
    void write_leaf(std::size_t at, std::uint32_t first, std::uint32_t count) {
        if (count == 1) {
            const std::uint32_t place = bvh_.primitives[first];
            store(nodes_[at], bounds_[place].box, bounds_[place].slope, numbers_[place], 1);
            return;
        }
        const std::size_t pair = append_pair();
        write_leaf(pair, first, 1);
        write_leaf(pair + 1, first + 1, count - 1);
        join(at, pair);
    }

    std::size_t append_pair() {
        nodes_.resize(nodes_.size() + 2);
        return nodes_.size() - 2;
    }

    void join(std::size_t at, std::size_t first) {
        Box box = box_of(nodes_[first]);
        box.extend(box_of(nodes_[first + 1]));
        store(nodes_[at], box, std::max(nodes_[first].slope, nodes_[first + 1].slope),
              static_cast<std::uint32_t>(first), 0);
    }

    static void store(shared::InstanceNode& node, const Box& box, float slope, std::uint32_t first,
                      std::uint32_t is_leaf) {
        node = {};
        for (int axis = 0; axis < 3; ++axis) {
            node.lower[axis] = box.lower[axis];
            node.upper[axis] = box.upper[axis];
        }
        node.first = first;
        node.is_leaf = is_leaf;
        node.slope = slope;
    }

    std::vector<InstanceBounds> bounds_;
    std::vector<std::uint32_t> numbers_;  // of the instances
    Bvh bvh_;                             // over places in bounds_
    Column<shared::InstanceNode> nodes_;
};

/// Makes the tree with eight children a node that costs least by the surface area heuristic among those whose nodes are
/// nodes of the binary one: see Collapse, which does the same for trees over primitives.
class InstanceTreeWidener {
public:
    explicit InstanceTreeWidener(const Column<shared::InstanceNode>& nodes) : nodes_(nodes), plans_(nodes.size()) {
        for (std::size_t i = nodes.size(); i-- > 0;)
            if (!nodes[i].is_leaf) plan(i);
    }

    Column<shared::WideNode> widen() {
        if (!nodes_.empty()) write(0);
        return std::move(wide_);
    }

private:
    static constexpr int kWidth = 8;

    /// How a subtree hangs into at most 1 … 8 children of one wide node, by number less one: what that costs, and how
    /// many of them go to its left child; 0: one less does. At one: those of a wide node of its own. All zero for a
    /// leaf.
    struct Plan {
        std::array<float, kWidth> cost{};
        std::array<std::uint8_t, kWidth> left{};
    };

    void plan(std::size_t i) {
        const Plan &left = plans_[nodes_[i].first], &right = plans_[nodes_[i].first + 1];
        Plan& plan = plans_[i];
        const auto split = [&](int places) {
            std::pair<float, std::uint8_t> best{std::numeric_limits<float>::infinity(), 0};
            for (int k = 1; k < places; ++k)
                best = std::min(best, {left.cost[k - 1] + right.cost[places - k - 1], static_cast<std::uint8_t>(k)});
            return best;
        };
        std::tie(plan.cost[0], plan.left[0]) = split(kWidth);
        plan.cost[0] += static_cast<float>(half_area(box_of(nodes_[i])));
        for (int places = 2; places <= kWidth; ++places) {
            std::tie(plan.cost[places - 1], plan.left[places - 1]) = split(places);
            if (plan.cost[places - 1] < plan.cost[places - 2]) continue;
            plan.cost[places - 1] = plan.cost[places - 2];
            plan.left[places - 1] = 0;
        }
    }

    /// Adds the children into which the subtree of a binary node hangs, at most `places`.
    void add_children(std::vector<std::uint32_t>& children, std::uint32_t node, int places) const {
        const auto& left = plans_[node].left;
        while (places > 1 && left[places - 1] == 0) --places;
        if (places == 1) return children.push_back(node);
        add_both(children, node, left[places - 1], places);
    }

    void add_both(std::vector<std::uint32_t>& children, std::uint32_t node, int left, int places) const {
        add_children(children, nodes_[node].first, left);
        add_children(children, nodes_[node].first + 1, places - left);
    }

    /// Writes the wide node that stands for the binary one, and all below it. Returns its number.
    std::uint32_t write(std::uint32_t node) {
        const auto number = static_cast<std::uint32_t>(wide_.size());
        wide_.push_back(empty_wide_node());
        std::vector<std::uint32_t> children;
        if (nodes_[node].is_leaf)  // the only one
            children = {node};
        else
            add_both(children, node, plans_[node].left[0], kWidth);
        for (std::size_t place = 0; place < children.size(); ++place) {
            const shared::InstanceNode& child = nodes_[children[place]];
            const std::uint32_t code = child.is_leaf ? CASTOR_WIDE_LEAF | child.first : write(children[place]);
            set_child(wide_[number], place, code, box_of(child));
        }
        return number;
    }

    const Column<shared::InstanceNode>& nodes_;
    std::vector<Plan> plans_;
    Column<shared::WideNode> wide_;
};

}  // namespace

BoxCover cover_of(const Bvh& bvh, std::size_t most) {
    if (bvh.nodes.empty()) return {};
    const auto is_smaller = [](const std::pair<double, std::uint32_t>& a, const std::pair<double, std::uint32_t>& b) {
        return a < b;
    };
    std::vector<std::pair<double, std::uint32_t>> inner;  // a heap by surface, and the node
    BoxCover cover;
    const auto add = [&](std::uint32_t i) {
        const BvhNode& node = bvh.nodes[i];
        if (node.count > 0) return cover.push_back(box_of(node));
        inner.emplace_back(half_area(box_of(node)), i);
        std::push_heap(inner.begin(), inner.end(), is_smaller);
    };
    add(0);
    while (!inner.empty() && cover.size() + inner.size() < most) {
        std::pop_heap(inner.begin(), inner.end(), is_smaller);
        const std::uint32_t first = bvh.nodes[inner.back().second].first;
        inner.pop_back();
        add(first);
        add(first + 1);
    }
    for (const auto& [area, node] : inner) cover.push_back(box_of(bvh.nodes[node]));
    return cover;
}

Column<shared::WideNode> widen_instance_tree(const Column<shared::InstanceNode>& nodes) {
    return InstanceTreeWidener(nodes).widen();
}

Column<shared::InstanceNode> build_instance_tree(const Column<shared::Instance>& instances,
                                                 const Column<shared::Geometry>& geometries,
                                                 const std::vector<BoxCover>& covers) {
    return InstanceTreeBuilder(instances, geometries, covers).build();
}

}  // namespace castor
