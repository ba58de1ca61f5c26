#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "bvh/binning.h"
#include "bvh/bvh.h"
#include "bvh/partition.h"
#include "bvh/primitive_ref.h"
#include "bvh/subtree.h"

namespace castor {

namespace {

constexpr std::size_t kMaxLeafSize = 8;
constexpr int kMaxDepth = CASTOR_MAX_STACK - 1;
// Subtrees of at most so many primitives are built by one task.
constexpr std::size_t kBlockSize = 4096;

// A node to be made of these references.
struct Work {
    std::span<PrimitiveRef> refs;
    Bounds bounds;
    int depth = 0;
};

struct Children {
    Work left, right;
};

// Levels below a node of so many primitives if each is split in the middle.
int median_levels(std::size_t count) {
    return std::bit_width(count - 1);
}

Children split_by_heuristic(const Work& work, const Binning& binning, const Split& split) {
    const Partition sides = partition(work.refs, binning, split);
    return {{work.refs.first(sides.left_count), sides.left, work.depth + 1},
            {work.refs.subspan(sides.left_count), sides.right, work.depth + 1}};
}

// In the middle of the axis on which the centres differ most. Equal centres fall to either side by their numbers.
Children split_by_median(const Work& work) {
    const Box& centers2 = work.bounds.centers2;
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (centers2.upper[i] - centers2.lower[i] > centers2.upper[axis] - centers2.lower[axis]) axis = i;
    }
    const std::size_t middle = work.refs.size() / 2;
    std::nth_element(work.refs.begin(), work.refs.begin() + static_cast<std::ptrdiff_t>(middle), work.refs.end(),
                     [axis](const PrimitiveRef& a, const PrimitiveRef& b) {
                         const float x = a.center2(axis), y = b.center2(axis);
                         return x < y || (x == y && a.primitive() < b.primitive());
                     });
    const std::span<PrimitiveRef> left = work.refs.first(middle), right = work.refs.subspan(middle);
    return {{left, bounds_of(left), work.depth + 1}, {right, bounds_of(right), work.depth + 1}};
}

// The two children that the node shall have; none: it shall be a leaf.
std::optional<Children> split(const Work& work, const BvhOptions& options) {
    const std::size_t count = work.refs.size();
    if (count == 1) return std::nullopt;
    // A split by the heuristic may leave all primitives but one together; then there must still be levels enough.
    const bool has_levels = work.depth + 1 + median_levels(count) <= kMaxDepth;
    const Binning binning(work.bounds.centers2, count);
    const Split best = has_levels ? best_split(fill_bins(work.refs, binning), binning, options.primitives_per_test) : Split{};
    if (count <= kMaxLeafSize) {
        const double area = half_area(work.bounds.box);
        const double leaf_cost = area * static_cast<double>(test_count(count, options.primitives_per_test));
        if (best.axis < 0 || leaf_cost <= options.traversal_cost * area + best.cost) return std::nullopt;
    }
    return best.axis < 0 ? split_by_median(work) : split_by_heuristic(work, binning, best);
}

shared::BvhNode make_node(const Box& box, std::size_t first, std::size_t count) {
    return {{box.lower[0], box.lower[1], box.lower[2]},
            static_cast<std::uint32_t>(first),
            {box.upper[0], box.upper[1], box.upper[2]},
            static_cast<std::uint32_t>(count)};
}

class Builder {
public:
    Builder(std::span<PrimitiveRef> refs, const BvhOptions& options) : refs_(refs), options_(options) {}

    std::unique_ptr<Subtree> build() const { return build(Work{refs_, bounds_of(refs_), 0}); }

private:
    std::unique_ptr<Subtree> build(const Work& work) const {
        auto tree = std::make_unique<Subtree>();
        if (work.refs.size() <= kBlockSize) {
            tree->root = build_block(work, *tree);
            return tree;
        }
        const Children children = *split(work, options_);  // too many for a leaf
        tree->root = make_node(work.bounds.box, 0, 0);
        tbb::parallel_invoke([&] { tree->left = build(children.left); }, [&] { tree->right = build(children.right); });
        tree->depth = std::max(tree->left->depth, tree->right->depth);
        return tree;
    }

    // Appends the node's descendants to the block and returns the node itself.
    shared::BvhNode build_block(const Work& work, Subtree& block) const {
        block.depth = std::max(block.depth, static_cast<std::uint32_t>(work.depth));
        const std::optional<Children> children = split(work, options_);
        if (!children) {
            const auto first = static_cast<std::size_t>(work.refs.data() - refs_.data());
            return make_node(work.bounds.box, first, work.refs.size());
        }
        const std::size_t first = block.nodes.size();
        block.nodes.resize(first + 2);
        const shared::BvhNode left = build_block(children->left, block);
        const shared::BvhNode right = build_block(children->right, block);
        block.nodes[first] = left;
        block.nodes[first + 1] = right;
        return make_node(work.bounds.box, first, 0);
    }

    std::span<PrimitiveRef> refs_;
    const BvhOptions& options_;
};

Column<std::uint32_t> primitive_numbers(std::span<const PrimitiveRef> refs) {
    Column<std::uint32_t> numbers(refs.size());
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, refs.size()), [&](const Range& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) numbers[i] = refs[i].primitive();
    });
    return numbers;
}

}  // namespace

Bvh build_bvh(const SceneArrays& arrays, const BvhOptions& options) {
    Bvh bvh;
    std::unique_ptr<Subtree> tree;
    {
        PrimitiveRefs refs(arrays);
        if (refs.span().empty()) return bvh;
        tree = Builder(refs.span(), options).build();
        bvh.primitives = primitive_numbers(refs.span());
    }
    bvh.nodes = lay_out(*tree);
    bvh.depth = tree->depth;
    return bvh;
}

}  // namespace castor
