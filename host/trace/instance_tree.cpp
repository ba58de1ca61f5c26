#include "trace/instance_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "bvh/bvh.h"
#include "scene/placement.h"

namespace castor {

namespace {

/// Where a ray may hit an instance: in `box`, enlarged by `slope` times the largest coordinate |o| of the ray's origin.
/// All norms are largest coordinates, or row sums of matrices; e = 2^-24.
///
/// Let A and b be to_object as it is, M the inverse of A, a = ||A||, m = ||M||, a m <= 2^20; B the box of what is here
/// of the geometry, L the whole one's largest coordinate, and W that of M(B - b). The device rounds o' = A o + b to
/// within 4e (a |o| + |b|) and d' = A d to within 4e a |d|. If it accepts a hit at t, then t lies between entry and
/// exit of the primitive's own box as computed, so that o' + t d' lies in B but for 72e (L + |o'|): CASTOR_BOX_PADDING
/// is 64e, and the slab arithmetic takes 4e at most. So the exact image of the world's point w = o + t d lies in B but
/// for
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

    InstanceBounds(const shared::Instance& instance, const Box& geometry_box, float largest_coordinate) {
        constexpr double kRounding = 0x1p-24;
        glm::dmat3 to_object;
        glm::dvec3 b;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) to_object[column][row] = instance.to_object[row][column];
            b[row] = instance.to_object[row][3];
        }
        const glm::dmat3 to_world = glm::inverse(to_object);
        const glm::dvec3 lower(geometry_box.lower[0], geometry_box.lower[1], geometry_box.lower[2]);
        const glm::dvec3 upper(geometry_box.upper[0], geometry_box.upper[1], geometry_box.upper[2]);
        const glm::dvec3 middle = to_world * (0.5 * (lower + upper) - b);
        const glm::dmat3 magnitudes(glm::abs(to_world[0]), glm::abs(to_world[1]), glm::abs(to_world[2]));
        const glm::dvec3 half = magnitudes * (0.5 * (upper - lower));
        const auto largest = [](const glm::dvec3& v) {
            return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
        };
        const double world = largest(glm::abs(middle) + half);
        const double a = row_norm(to_object), m = row_norm(to_world);
        const glm::dvec3 motion(instance.motion[0], instance.motion[1], instance.motion[2]);
        const double moved = largest(motion);
        const double exact_slope = kRounding * (m * 128 * a + 32 + (moved > 0.0 ? 2 : 0));
        const double padding = m * (128 * kRounding * (largest_coordinate + largest(b) + a * world) + 0x1p-100) +
                               32 * kRounding * (world + moved) + exact_slope * moved;
        for (int axis = 0; axis < 3; ++axis) {
            const double begin = std::min(0.0, motion[axis]), end = std::max(0.0, motion[axis]);
            box.lower[axis] = rounded_down(middle[axis] - half[axis] + begin - padding);
            box.upper[axis] = -rounded_down(-(middle[axis] + half[axis] + end + padding));
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
                        const std::vector<Box>& geometry_boxes) {
        std::vector<PrimitiveRef> refs;
        for (std::size_t i = 1; i < instances.size(); ++i) {
            const std::uint32_t geometry = instances[i].geometry;
            const Box& box = geometry_boxes[geometry];
            if (box.lower[0] > box.upper[0]) continue;
            bounds_.emplace_back(instances[i], box, geometries[geometry].largest_coordinate);
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

}  // namespace

Column<shared::InstanceNode> build_instance_tree(const Column<shared::Instance>& instances,
                                                 const Column<shared::Geometry>& geometries,
                                                 const std::vector<Box>& geometry_boxes) {
    return InstanceTreeBuilder(instances, geometries, geometry_boxes).build();
}

}  // namespace castor
