#include "bvh/compressed.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "bvh/collapse.h"

namespace castor {

namespace {

constexpr int kWidth = Collapse::kWidth;
constexpr int kLastStep = 255;
constexpr int kExponentBias = 127;
constexpr float kSmallestNormal = std::numeric_limits<float>::min();

// Leaves of up to three primitives, as a node encodes them. Prices of a visit of a node and of a test of a primitive.
constexpr CollapseOptions kSmallLeaves = {1, 3, false, 1.0f, 0.3f};

/// One axis of a node's grid. Neither number is denormal, so that a device that flushes denormals has the same grid,
/// and its planes are those of decompressed_box but for denormal ones, which it flushes as it flushes the planes of
/// primitives' boxes.
struct GridAxis {
    float origin;
    int exponent;  // biased
    float step;

    GridAxis(float lower, float upper) : origin(lower) {
        if (std::abs(lower) < kSmallestNormal) origin = lower < 0.0f ? -kSmallestNormal : 0.0f;
        const double exact_step = (static_cast<double>(upper) - origin) / kLastStep;
        set_exponent(exact_step > 0.0 ? std::max(1, std::ilogb(exact_step) + kExponentBias) : 1);
        while (plane(kLastStep) < upper) set_exponent(exponent + 1);
    }

    float plane(int steps) const { return std::fma(static_cast<float>(steps), step, origin); }

    /// The nearest plane at or below x, which is at or above the axis' origin.
    int below(float x) const {
        int steps = std::min(static_cast<int>(steps_to(x)), kLastStep);
        while (plane(steps) > x) --steps;
        return steps;
    }
    /// The nearest plane at or above x, which is at or below the last one.
    int above(float x) const {
        int steps = static_cast<int>(std::ceil(steps_to(x)));
        while (steps > 0 && plane(steps - 1) >= x) --steps;
        while (plane(steps) < x) ++steps;
        return steps;
    }

private:
    void set_exponent(int biased) {
        exponent = biased;
        step = std::bit_cast<float>(static_cast<std::uint32_t>(biased) << 23);
    }
    double steps_to(float x) const { return (static_cast<double>(x) - origin) / step; }
};

/// The place for each child: bit i of its number is set where it is the upper corner along axis i. The pair of child
/// and place that fit best first.
std::array<int, kWidth> assign_places(const std::vector<Box>& boxes) {
    Box all;
    for (const Box& box : boxes) all.extend(box);
    double from_middle[kWidth][3];  // twice
    for (std::size_t i = 0; i < boxes.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            from_middle[i][axis] = (static_cast<double>(boxes[i].lower[axis]) + boxes[i].upper[axis]) -
                                   (static_cast<double>(all.lower[axis]) + all.upper[axis]);
    double fit[kWidth][kWidth];
    for (std::size_t i = 0; i < boxes.size(); ++i)
        for (int place = 0; place < kWidth; ++place) {
            fit[i][place] = 0.0;
            for (int axis = 0; axis < 3; ++axis)
                fit[i][place] += place >> axis & 1 ? from_middle[i][axis] : -from_middle[i][axis];
        }

    std::array<int, kWidth> places;
    places.fill(-1);
    unsigned taken = 0;
    for (std::size_t assigned = 0; assigned < boxes.size(); ++assigned) {
        double best = -std::numeric_limits<double>::infinity();
        std::size_t best_child = 0;
        int best_place = 0;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            if (places[i] >= 0) continue;
            for (int place = 0; place < kWidth; ++place) {
                if (taken >> place & 1 || !(fit[i][place] > best)) continue;
                best = fit[i][place];
                best_child = i;
                best_place = place;
            }
        }
        places[best_child] = best_place;
        taken |= 1u << best_place;
    }
    return places;
}

class CompressedBuilder {
public:
    CompressedBuilder(const Primitives& primitives, const Bvh& bvh, const Progress& progress)
        : bvh_(bvh),
          collapse_(primitives, bvh, kSmallLeaves, progress.part(0.0, Collapse::kPlanning)),
          progress_(progress.part(Collapse::kPlanning, 1.0)) {}

    CompressedBvh build() {
        if (bvh_.nodes.empty()) return {};
        tree_.nodes.resize(1);
        fill_node(0, 0, 1);
        return std::move(tree_);
    }

private:
    /// Fills node `index`, which stands for a binary node, and appends all below it.
    void fill_node(std::uint32_t index, std::uint32_t binary_node, std::uint32_t level) {
        tree_.levels = std::max(tree_.levels, level);
        const WideChildren children = collapse_.children_of(binary_node);
        std::vector<Box> boxes;
        for (const WideChild& child : children) boxes.push_back(box_of(bvh_.nodes[child.node]));
        const std::array<int, kWidth> places = assign_places(boxes);
        std::array<const WideChild*, kWidth> child_at{};
        std::array<Box, kWidth> box_at;
        for (std::size_t i = 0; i < children.size(); ++i) {
            child_at[places[i]] = &children[i];
            box_at[places[i]] = boxes[i];
        }

        shared::CompressedNode node{};
        compress_boxes(box_at, node);
        node.first_child = static_cast<std::uint32_t>(tree_.nodes.size());
        node.first_primitive = static_cast<std::uint32_t>(tree_.primitives.size());
        for (int place = 0; place < kWidth; ++place) {
            if (!child_at[place]) continue;
            if (child_at[place]->is_leaf) {
                node.meta[place] = add_leaf(child_at[place]->range, node.first_primitive);
            } else {
                node.meta[place] = static_cast<std::uint8_t>(CASTOR_COMPRESSED_INNER + place);
                node.inner_mask |= static_cast<std::uint8_t>(1 << place);
            }
        }
        tree_.nodes[index] = node;
        tree_.nodes.resize(tree_.nodes.size() + std::popcount(node.inner_mask));
        std::uint32_t next = node.first_child;
        for (int place = 0; place < kWidth; ++place)
            if (node.inner_mask >> place & 1) fill_node(next++, child_at[place]->node, level + 1);
        report();
    }

    void report() {
        constexpr std::size_t kOften = 1 << 13;
        if (tree_.primitives.size() < reported_ + kOften) return;
        reported_ = tree_.primitives.size();
        progress_.reach(static_cast<double>(reported_) / static_cast<double>(bvh_.primitives.size()));
    }

    /// The leaf's code: its primitives, in unary, above their place among those of the node.
    std::uint8_t add_leaf(const PrimitiveRange& range, std::uint32_t first_of_node) {
        const std::size_t place = tree_.primitives.size() - first_of_node;
        const auto begin = bvh_.primitives.begin() + range.first;
        tree_.primitives.insert(tree_.primitives.end(), begin, begin + range.count());
        return static_cast<std::uint8_t>(((1u << range.count()) - 1) << CASTOR_COMPRESSED_COUNT_SHIFT | place);
    }

    const Bvh& bvh_;
    Collapse collapse_;
    Progress progress_;
    CompressedBvh tree_;
    std::size_t reported_ = 0;  // primitives
};

}  // namespace

void compress_boxes(const std::array<Box, 8>& boxes, shared::CompressedNode& node) {
    Box all;
    for (const Box& box : boxes) all.extend(box);
    for (int axis = 0; axis < 3; ++axis) {
        const GridAxis grid(all.lower[axis], all.upper[axis]);
        node.origin[axis] = grid.origin;
        node.exponent[axis] = static_cast<std::uint8_t>(grid.exponent);
        for (int place = 0; place < kWidth; ++place) {
            if (boxes[place].is_empty()) continue;
            node.lower[axis][place] = static_cast<std::uint8_t>(grid.below(boxes[place].lower[axis]));
            node.upper[axis][place] = static_cast<std::uint8_t>(grid.above(boxes[place].upper[axis]));
        }
    }
}

Box decompressed_box(const shared::CompressedNode& node, int place) {
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
        const float step = std::bit_cast<float>(static_cast<std::uint32_t>(node.exponent[axis]) << 23);
        box.lower[axis] = std::fma(static_cast<float>(node.lower[axis][place]), step, node.origin[axis]);
        box.upper[axis] = std::fma(static_cast<float>(node.upper[axis][place]), step, node.origin[axis]);
    }
    return box;
}

CompressedBvh compress_bvh(const Primitives& primitives, const Bvh& bvh, const Progress& progress) {
    return CompressedBuilder(primitives, bvh, progress).build();
}

void append(CompressedBvh& trees, CompressedBvh&& tree) {
    trees.roots.push_back(tree.nodes.empty() ? CASTOR_INVALID_INDEX : static_cast<std::uint32_t>(trees.nodes.size()));
    trees.levels = std::max(trees.levels, tree.levels);
    if (trees.nodes.empty()) {
        trees.nodes = std::move(tree.nodes);
        trees.primitives = std::move(tree.primitives);
        return;
    }
    const auto first_node = static_cast<std::uint32_t>(trees.nodes.size());
    const auto first_primitive = static_cast<std::uint32_t>(trees.primitives.size());
    for (shared::CompressedNode node : tree.nodes) {
        node.first_child += first_node;
        node.first_primitive += first_primitive;
        trees.nodes.push_back(node);
    }
    trees.primitives.insert(trees.primitives.end(), tree.primitives.begin(), tree.primitives.end());
}

}  // namespace castor
