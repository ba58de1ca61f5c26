#include "bvh/wide.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "bvh/collapse.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr std::uint32_t kBlockSize = 4;
constexpr std::uint32_t kMaxBlocks = CASTOR_WIDE_COUNT_MASK + 1;

// Prices of a visit of a wide node and of a test of a block, measured on diffuse rays.
constexpr CollapseOptions kBlocksOfFour = {kBlockSize, kMaxBlocks, true, 1.0f, 0.8f};

// Levels of the wide tree below which a subtree is written by one task.
constexpr int kTaskDepth = 2;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Numbers of wide nodes and blocks: how many, or the next ones to be given.
struct Numbers {
    std::uint64_t nodes = 0;
    std::uint64_t triangle_blocks = 0;
    std::uint64_t sphere_blocks = 0;

    std::uint64_t& blocks(const PrimitiveRange& leaf) { return leaf.spheres > 0 ? sphere_blocks : triangle_blocks; }
    Numbers& operator+=(const Numbers& other) {
        nodes += other.nodes;
        triangle_blocks += other.triangle_blocks;
        sphere_blocks += other.sphere_blocks;
        return *this;
    }
};

// A child code has no room for more blocks.
void check_block_count(std::uint64_t count) {
    if (count > CASTOR_WIDE_FIRST_MASK)
        throw Error(fmt::format(
            "the scene needs more than {} blocks of four primitives, the most that the wide tree can number; "
            "use the strategy simt",
            CASTOR_WIDE_FIRST_MASK));
}

class WideBuilder {
public:
    WideBuilder(const Primitives& primitives, const Bvh& bvh, const Progress& progress)
        : primitives_(primitives),
          bvh_(bvh),
          collapse_(primitives, bvh, kBlocksOfFour, progress.part(0.0, Collapse::kPlanning)),
          progress_(progress) {}

    WideBvh build() {
        if (bvh_.nodes.empty()) return {};

        // The top of the tree is one piece, and each subtree below it another.
        Numbers top;
        count(0, 0, top);
        std::vector<Numbers> numbers(subtrees_.size());
        tbb::parallel_for(std::size_t{0}, subtrees_.size(),
                          [&](std::size_t i) { count(subtrees_[i], kTaskDepth + 1, numbers[i]); });
        Numbers next = top;
        for (Numbers& each : numbers) {
            const Numbers first = next;
            next += each;
            each = first;
        }
        check_block_count(std::max(next.triangle_blocks, next.sphere_blocks));
        wide_.nodes.resize(next.nodes);
        wide_.triangle_blocks.resize(next.triangle_blocks);
        wide_.sphere_blocks.resize(next.sphere_blocks);
        wide_.root = 0;

        ProgressCount nodes_done(progress_.part(Collapse::kPlanning, 1.0), next.nodes);
        auto subtree = numbers.begin();
        Numbers top_next;
        write(0, 0, top_next, [&] { return static_cast<std::uint32_t>((subtree++)->nodes); });
        tbb::parallel_for(std::size_t{0}, subtrees_.size(), [&](std::size_t i) {
            const std::uint64_t first = numbers[i].nodes;
            write(subtrees_[i], kTaskDepth + 1, numbers[i], [] { return CASTOR_INVALID_INDEX; });
            nodes_done.add(numbers[i].nodes - first);
        });
        return std::move(wide_);
    }

private:
    // Adds what is in the wide subtree; where the top ends, the subtrees are listed instead.
    void count(std::uint32_t node, int depth, Numbers& numbers) {
        ++numbers.nodes;
        for (const WideChild& child : collapse_.children_of(node)) {
            if (child.is_leaf)
                numbers.blocks(child.range) += collapse_.block_count(child.range);
            else if (depth == kTaskDepth)
                subtrees_.push_back(child.node);
            else
                count(child.node, depth + 1, numbers);
        }
    }

    // Writes the wide subtree and returns its number; `next_subtree` gives those of the subtrees below the top, as
    // `count` lists them.
    template <class NextSubtree>
    std::uint32_t write(std::uint32_t node, int depth, Numbers& next, const NextSubtree& next_subtree) {
        const auto index = static_cast<std::uint32_t>(next.nodes++);
        shared::WideNode& wide = wide_.nodes[index];
        wide = empty_wide_node();
        const WideChildren children = collapse_.children_of(node);
        for (std::size_t place = 0; place < children.size(); ++place) {
            const WideChild& child = children[place];
            const std::uint32_t code = child.is_leaf         ? write_leaf(child.range, next)
                                       : depth == kTaskDepth ? next_subtree()
                                                             : write(child.node, depth + 1, next, next_subtree);
            set_child(wide, place, code, box_of(bvh_.nodes[child.node]));
        }
        return index;
    }

    std::uint32_t write_leaf(const PrimitiveRange& range, Numbers& next) {
        const bool spheres = range.spheres > 0;
        std::uint64_t& next_block = next.blocks(range);
        const auto first_block = static_cast<std::uint32_t>(next_block);
        const std::uint32_t blocks = collapse_.block_count(range);
        next_block += blocks;

        std::uint32_t numbers[kMaxBlocks * kBlockSize];
        std::uint32_t count = 0;
        for (std::uint32_t i = range.first; count < range.count(); ++i)
            if ((bvh_.primitives[i] >= primitives_.triangle_count()) == spheres) numbers[count++] = bvh_.primitives[i];
        for (std::uint32_t i = 0; i < blocks; ++i) {
            const std::uint32_t* const first = numbers + i * kBlockSize;
            const std::uint32_t used = std::min(kBlockSize, count - i * kBlockSize);
            if (spheres)
                fill_spheres(wide_.sphere_blocks[first_block + i], first, used);
            else
                fill_triangles(wide_.triangle_blocks[first_block + i], first, used);
        }
        return CASTOR_WIDE_LEAF | (spheres ? CASTOR_WIDE_SPHERES : 0u) | (blocks - 1) << CASTOR_WIDE_COUNT_SHIFT |
               first_block;
    }

    void fill_triangles(shared::TriangleBlock& block, const std::uint32_t* numbers, std::uint32_t count) const {
        for (std::uint32_t lane = 0; lane < kBlockSize; ++lane) {
            block.primitive[lane] = lane < count ? numbers[lane] : CASTOR_INVALID_INDEX;
            const glm::uvec3 triangle = lane < count ? primitives_.triangle_vertices[numbers[lane]] : glm::uvec3(0);
            for (int vertex = 0; vertex < 3; ++vertex) {
                const glm::vec3 position =
                    lane < count ? primitives_.vertex_position[triangle[vertex]] : glm::vec3(kNaN);
                for (int axis = 0; axis < 3; ++axis) block.vertex[vertex][axis][lane] = position[axis];
            }
        }
    }

    void fill_spheres(shared::SphereBlock& block, const std::uint32_t* numbers, std::uint32_t count) const {
        for (std::uint32_t lane = 0; lane < kBlockSize; ++lane) {
            block.primitive[lane] = lane < count ? numbers[lane] : CASTOR_INVALID_INDEX;
            for (int i = 0; i < 4; ++i)
                block.center_radius[i][lane] =
                    lane < count ? primitives_.sphere_center_radius[numbers[lane] - primitives_.triangle_count()][i]
                                 : kNaN;
        }
    }

    Primitives primitives_;
    const Bvh& bvh_;
    Collapse collapse_;
    Progress progress_;
    std::vector<std::uint32_t> subtrees_;  // binary nodes
    WideBvh wide_;
};

}  // namespace

shared::WideNode empty_wide_node() {
    shared::WideNode node{};
    for (auto& axis : node.planes) {
        std::fill(std::begin(axis[0]), std::end(axis[0]), Box::kInfinity);
        std::fill(std::begin(axis[1]), std::end(axis[1]), -Box::kInfinity);
    }
    std::fill(std::begin(node.child), std::end(node.child), CASTOR_INVALID_INDEX);
    return node;
}

void set_child(shared::WideNode& node, std::size_t place, std::uint32_t child, const Box& box) {
    node.child[place] = child;
    for (int axis = 0; axis < 3; ++axis) {
        node.planes[axis][0][place] = box.lower[axis];
        node.planes[axis][1][place] = box.upper[axis];
    }
}

WideBvh collapse_bvh(const Primitives& primitives, const Bvh& bvh, const Progress& progress) {
    return WideBuilder(primitives, bvh, progress).build();
}

void append(WideBvh& trees, WideBvh&& tree) {
    const bool is_empty = tree.root == CASTOR_INVALID_INDEX;
    trees.roots.push_back(is_empty ? CASTOR_INVALID_INDEX : static_cast<std::uint32_t>(trees.nodes.size()) + tree.root);
    trees.root = trees.roots.front();
    if (is_empty) return;
    if (trees.nodes.empty()) {
        trees.nodes = std::move(tree.nodes);
        trees.triangle_blocks = std::move(tree.triangle_blocks);
        trees.sphere_blocks = std::move(tree.sphere_blocks);
        return;
    }
    const auto first_node = static_cast<std::uint32_t>(trees.nodes.size());
    const auto first_triangles = static_cast<std::uint32_t>(trees.triangle_blocks.size());
    const auto first_spheres = static_cast<std::uint32_t>(trees.sphere_blocks.size());
    check_block_count(std::max(trees.triangle_blocks.size() + tree.triangle_blocks.size(),
                               trees.sphere_blocks.size() + tree.sphere_blocks.size()));
    for (shared::WideNode node : tree.nodes) {
        for (std::uint32_t& child : node.child) {
            if (child == CASTOR_INVALID_INDEX) continue;
            if (!(child & CASTOR_WIDE_LEAF))
                child += first_node;
            else
                child += child & CASTOR_WIDE_SPHERES ? first_spheres : first_triangles;
        }
        trees.nodes.push_back(node);
    }
    trees.triangle_blocks.insert(trees.triangle_blocks.end(), tree.triangle_blocks.begin(), tree.triangle_blocks.end());
    trees.sphere_blocks.insert(trees.sphere_blocks.end(), tree.sphere_blocks.begin(), tree.sphere_blocks.end());
}

}  // namespace castor
