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
#include "bvh/reinsert.h"
#include "bvh/subtree.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace castor {

namespace {

constexpr std::size_t kMaxLeafSize = 8;
constexpr int kMaxDepth = CASTOR_MAX_STACK - 1;
// Subtrees of at most so many primitives are built by one task.
constexpr std::size_t kBlockSize = 2048;

// A node to be made of these references.
struct Work {
    std::span<PrimitiveRef> refs;
    Bounds bounds;  // centers2 of no use for at most kMaxSorted references
    int depth = 0;
};

struct Children {
    Work left, right;
};

// Levels below a node of so many primitives if each is split in the middle.
int median_levels(std::size_t count) {
    return std::bit_width(count - 1);
}

// In the middle of the axis on which the centres differ most. Equal centres fall to either side by their numbers.
Children split_by_median(const Work& work) {
    const Box centers2 = bounds_of(work.refs).centers2;
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (centers2.upper[i] - centers2.lower[i] > centers2.upper[axis] - centers2.lower[axis]) axis = i;
    }
    const std::size_t middle = work.refs.size() / 2;
    std::nth_element(work.refs.begin(), work.refs.begin() + static_cast<std::ptrdiff_t>(middle), work.refs.end(),
                     [axis](const PrimitiveRef& a, const PrimitiveRef& b) {
                         const float x = a.center2()[axis], y = b.center2()[axis];
                         return x < y || (x == y && a.primitive() < b.primitive());
                     });
    const std::span<PrimitiveRef> left = work.refs.first(middle), right = work.refs.subspan(middle);
    return {{left, bounds_of(left), work.depth + 1}, {right, bounds_of(right), work.depth + 1}};
}

bool is_leaf(const Work& work, const Split& split, const BvhOptions& options) {
    if (work.refs.size() > kMaxLeafSize) return false;
    if (split.axis < 0) return true;
    return static_cast<float>(test_count(work.refs.size(), options.block_bits)) <= options.traversal_cost + split.cost;
}

Children children_of(const Work& work, std::size_t left_count, const Bounds& left, const Bounds& right) {
    return {{work.refs.first(left_count), left, work.depth + 1},
            {work.refs.subspan(left_count), right, work.depth + 1}};
}

// The two children that the node shall have; none: it shall be a leaf.
std::optional<Children> split(const Work& work, const BvhOptions& options) {
    const std::size_t count = work.refs.size();
    if (count <= std::size_t{1} << options.block_bits)
        return std::nullopt;  // one test: what a split saves is hardly worth its price
    // A split by the heuristic may leave all primitives but one together; then there must still be levels enough.
    if (work.depth + 1 + median_levels(count) > kMaxDepth) {
        if (is_leaf(work, Split{}, options)) return std::nullopt;
        return split_by_median(work);
    }
    if (count <= kMaxSorted) {
        const Ranks ranks(work.refs);
        const Bins bins = fill_bins(work.refs, ranks);
        const Split best = best_split(bins, work.bounds.box, options.block_bits);
        if (is_leaf(work, best, options)) return std::nullopt;
        const Sides sides = sides_of(bins, best);
        return children_of(work, partition(work.refs, ranks, best), {sides.left, {}}, {sides.right, {}});
    }
    const Binning binning(work.bounds.centers2, count);
    const Bins bins = fill_bins(work.refs, binning);
    const Split best = best_split(bins, work.bounds.box, options.block_bits);
    if (is_leaf(work, best, options)) return std::nullopt;
    if (best.axis < 0) return split_by_median(work);
    const Sides sides = sides_of(bins, best);
    const Partition parts = partition(work.refs, binning, best);
    return children_of(work, parts.left_count, {sides.left, parts.left_centers2}, {sides.right, parts.right_centers2});
}

BvhNode make_node(const Box& box, std::size_t first, std::size_t count) {
    return {{box.lower[0], box.lower[1], box.lower[2]},
            static_cast<std::uint32_t>(first),
            {box.upper[0], box.upper[1], box.upper[2]},
            static_cast<std::uint32_t>(count)};
}

/// What building a subtree of so many primitives costs, n log n. More than two parts of it together.
std::uint64_t work_of(std::size_t count) {
    return std::uint64_t{count} * std::bit_width(count);
}

class Builder {
public:
    Builder(std::span<PrimitiveRef> refs, const BvhOptions& options, const Progress& progress)
        : refs_(refs), options_(options), work_done_(progress, work_of(refs.size())) {}

    std::unique_ptr<Subtree> build() { return build(Work{refs_, bounds_of(refs_), 0}); }

private:
    std::unique_ptr<Subtree> build(const Work& work) {
        auto tree = std::make_unique<Subtree>();
        if (work.refs.size() <= kBlockSize) {
            tree->nodes.reserve(work.refs.size());
            tree->root = build_block(work, *tree);
            work_done_.add(work_of(work.refs.size()));
            return tree;
        }
        const Children children = *split(work, options_);  // too many for a leaf
        work_done_.add(work_of(work.refs.size()) - work_of(children.left.refs.size()) -
                       work_of(children.right.refs.size()));
        tree->root = make_node(work.bounds.box, 0, 0);
        tbb::parallel_invoke([&] { tree->left = build(children.left); }, [&] { tree->right = build(children.right); });
        // Where another task threw, these may not have been run, or not to their end; all is thrown away then.
        if (!tree->left || !tree->right) return nullptr;
        tree->depth = std::max(tree->left->depth, tree->right->depth);
        return tree;
    }

    // Appends the node's descendants to the block and returns the node itself.
    BvhNode build_block(const Work& work, Subtree& block) const {
        block.depth = std::max(block.depth, static_cast<std::uint32_t>(work.depth));
        const std::optional<Children> children = split(work, options_);
        if (!children) {
            const auto first = static_cast<std::size_t>(work.refs.data() - refs_.data());
            return make_node(work.bounds.box, first, work.refs.size());
        }
        const std::size_t first = block.nodes.size();
        block.nodes.resize(first + 2);
        const BvhNode left = build_block(children->left, block);
        const BvhNode right = build_block(children->right, block);
        block.nodes[first] = left;
        block.nodes[first + 1] = right;
        return make_node(work.bounds.box, first, 0);
    }

    std::span<PrimitiveRef> refs_;
    const BvhOptions& options_;
    ProgressCount work_done_;
};

Column<std::uint32_t> primitive_numbers(std::span<const PrimitiveRef> refs) {
    Column<std::uint32_t> numbers(refs.size());
    using Blocks = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Blocks(0, refs.size()), [&](const Blocks& range) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) numbers[i] = refs[i].primitive();
    });
    return numbers;
}

/// Subtrees are many small allocations by several threads: freed, they would stay with the C library, while the next
/// step needs most memory of all. Of few primitives they are not worth the time.
void release_freed_memory(std::size_t primitive_count) {
    constexpr std::size_t kMany = std::size_t{1} << 20;
    if (primitive_count < kMany) return;
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

// Which share of all nodes' surfaces a pass of reinsert_nodes must save to be worth its time.
float least_gain(TreeQuality quality) {
    return quality == TreeQuality::high ? 0.005f : 0.04f;
}

// Fills in all of `bvh` but its nodes. Null if there is nothing.
std::unique_ptr<Subtree> build_tree(std::span<PrimitiveRef> refs, const BvhOptions& options, Bvh& bvh,
                                    const Progress& progress = {}) {
    if (refs.empty()) return nullptr;
    std::unique_ptr<Subtree> tree = Builder(refs, options, progress).build();
    bvh.primitives = primitive_numbers(refs);
    bvh.depth = tree->depth;
    return tree;
}

}  // namespace

Bvh build_bvh(const Primitives& primitives, const BvhOptions& options, const Progress& progress) {
    // Shares of the time: up to the references, their tree, and its layout. Then nodes are moved.
    constexpr double kReferences = 0.1, kTree = 0.7, kLayout = 0.8;
    Bvh bvh;
    std::unique_ptr<Subtree> tree;
    {
        PrimitiveRefs refs(primitives, options.quality, progress.part(0.0, kReferences));
        progress.reach(kReferences);
        tree = build_tree(refs.span(), options, bvh, progress.part(kReferences, kTree));
    }
    if (!tree) return bvh;
    bvh.nodes = lay_out(*tree);
    tree.reset();
    reinsert_nodes(bvh, least_gain(options.quality), progress.part(kLayout, 1.0));
    release_freed_memory(bvh.primitives.size());
    return bvh;
}

Bvh build_bvh(std::span<PrimitiveRef> refs, const BvhOptions& options) {
    Bvh bvh;
    const std::unique_ptr<Subtree> tree = build_tree(refs, options, bvh);
    if (tree) bvh.nodes = lay_out(*tree);
    reinsert_nodes(bvh, least_gain(options.quality));
    return bvh;
}

}  // namespace castor
