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
constexpr int kTaskDepth = 3;

// The share of the time in which the tree is planned. Then it is written.
constexpr double kPlanning = 0.4;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
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
/// Some children of a wide node, as bits.
using ChildMask = std::uint32_t;
constexpr ChildMask kAllChildren = 0xff;

class WideBuilder {
public:
    WideBuilder(const SceneArrays& arrays, const Bvh& bvh, std::uint64_t max_column_bytes, const Progress& progress)
        : arrays_(arrays),
          bvh_(bvh),
          collapse_(arrays, bvh, kBlocksOfFour, progress.part(0.0, kPlanning)),
          max_column_bytes_(max_column_bytes),
          progress_(progress) {}

    WideBvh build() {
        if (bvh_.nodes.empty()) return {};
        cut(0, plan(0, kAllChildren));
        Numbers total;
        for (const Chunk& chunk : chunks_) total += chunk.size;
        wide_.nodes.resize(total.nodes);
        wide_.triangle_blocks.resize(total.triangle_blocks);
        wide_.sphere_blocks.resize(total.sphere_blocks);
        wide_.root = 0;
        ProgressCount nodes_done(progress_.part(kPlanning, 1.0), total.nodes);
        for (Chunk& chunk : chunks_) write(chunk, nodes_done);
        return std::move(wide_);
    }

private:
    /// Some children of a wide node, which become a tree by themselves below a copy of it. The top of that is one piece, and each subtree below it another.
    struct Chunk {
        std::uint32_t node;  // of the binary tree
        ChildMask children;
        Numbers size;
        std::vector<std::uint32_t> subtrees;  // binary nodes
        std::vector<Numbers> first;           // the first numbers of each subtree
    };

    Chunk plan(std::uint32_t node, ChildMask children) const {
        Chunk chunk{node, children, {}, {}, {}};
        count(node, 0, children, chunk.size, chunk.subtrees);
        chunk.first.resize(chunk.subtrees.size());
        tbb::parallel_for(std::size_t{0}, chunk.subtrees.size(), [&](std::size_t i) {
            std::vector<std::uint32_t> none;
            count(chunk.subtrees[i], kTaskDepth + 1, kAllChildren, chunk.first[i], none);
        });
        for (Numbers& each : chunk.first) {
            const Numbers first = chunk.size;
            chunk.size += each;
            each = first;
        }
        return chunk;
    }

    bool fits(const Numbers& size) const {
        // A child code has no room for more blocks.
        return std::max(size.triangle_blocks, size.sphere_blocks) <= CASTOR_WIDE_FIRST_MASK &&
               size.nodes * sizeof(shared::WideNode) <= max_column_bytes_ &&
               size.triangle_blocks * sizeof(shared::TriangleBlock) <= max_column_bytes_ &&
               size.sphere_blocks * sizeof(shared::SphereBlock) <= max_column_bytes_;
    }

    // Lists the chunks of the wide subtree `whole`: as many of a node's children together as fit. A child that is too large is cut in turn.
    void cut(std::uint32_t node, Chunk whole) {
        if (fits(whole.size)) {
            chunks_.push_back(std::move(whole));
            return;
        }
        const WideChildren children = collapse_.children_of(node);
        ChildMask together = 0;
        for (std::size_t place = 0; place < children.size(); ++place) {
            if (!children[place].is_leaf) {
                Chunk alone = plan(children[place].node, kAllChildren);
                if (!fits(alone.size)) {
                    cut(children[place].node, std::move(alone));
                    continue;
                }
            }
            const ChildMask more = together | 1u << place;
            if (together != 0 && !fits(plan(node, more).size)) {
                chunks_.push_back(plan(node, together));
                together = 1u << place;
            } else {
                together = more;
            }
        }
        if (together != 0) chunks_.push_back(plan(node, together));
    }

    // Adds what is in the wide subtree; where the top ends, the subtrees are listed instead.
    void count(std::uint32_t node, int depth, ChildMask mask, Numbers& numbers, std::vector<std::uint32_t>& subtrees) const {
        ++numbers.nodes;
        const WideChildren children = collapse_.children_of(node);
        for (std::size_t place = 0; place < children.size(); ++place) {
            if (!(mask >> place & 1)) continue;
            const WideChild& child = children[place];
            if (child.is_leaf)
                numbers.blocks(child.range) += collapse_.block_count(child.range);
            else if (depth == kTaskDepth)
                subtrees.push_back(child.node);
            else
                count(child.node, depth + 1, kAllChildren, numbers, subtrees);
        }
    }

    void write(Chunk& chunk, ProgressCount& nodes_done) {
        const WideChunk& start = wide_.chunks.emplace_back(
            WideChunk{start_.nodes, chunk.size.nodes, start_.triangle_blocks, chunk.size.triangle_blocks, start_.sphere_blocks, chunk.size.sphere_blocks});
        auto subtree = chunk.first.begin();
        std::vector<Numbers> next = chunk.first;
        Numbers top_next;
        write(chunk.node, 0, chunk.children, start, top_next, [&] { return static_cast<std::uint32_t>((subtree++)->nodes); });
        tbb::parallel_for(std::size_t{0}, chunk.subtrees.size(), [&](std::size_t i) {
            write(chunk.subtrees[i], kTaskDepth + 1, kAllChildren, start, next[i], [] { return CASTOR_INVALID_INDEX; });
            nodes_done.add(next[i].nodes - chunk.first[i].nodes);
        });
        start_ += chunk.size;
    }

    // Writes the wide subtree and returns its number in the chunk; `next_subtree` gives those of the subtrees below the top, as
    // `count` lists them.
    template <class NextSubtree>
    std::uint32_t write(std::uint32_t node, int depth, ChildMask mask, const WideChunk& chunk, Numbers& next, const NextSubtree& next_subtree) {
        const auto index = static_cast<std::uint32_t>(next.nodes++);
        shared::WideNode& wide = wide_.nodes[chunk.first_node + index];
        wide = empty_node();
        const WideChildren children = collapse_.children_of(node);
        for (std::size_t place = 0; place < children.size(); ++place) {
            if (!(mask >> place & 1)) continue;
            const WideChild& child = children[place];
            if (child.is_leaf)
                wide.child[place] = write_leaf(child.range, chunk, next);
            else if (depth == kTaskDepth)
                wide.child[place] = next_subtree();
            else
                wide.child[place] = write(child.node, depth + 1, kAllChildren, chunk, next, next_subtree);
            const BvhNode& binary = bvh_.nodes[child.node];
            for (int axis = 0; axis < 3; ++axis) {
                wide.planes[axis][0][place] = binary.lower[axis];
                wide.planes[axis][1][place] = binary.upper[axis];
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

    std::uint32_t write_leaf(const PrimitiveRange& range, const WideChunk& chunk, Numbers& next) {
        const bool spheres = range.spheres > 0;
        std::uint64_t& next_block = next.blocks(range);
        const auto first_block = static_cast<std::uint32_t>(next_block);
        const std::uint32_t blocks = collapse_.block_count(range);
        next_block += blocks;

        std::uint32_t numbers[kMaxBlocks * kBlockSize];
        std::uint32_t count = 0;
        for (std::uint32_t i = range.first; count < range.count(); ++i)
            if ((bvh_.primitives[i] >= arrays_.triangle_count()) == spheres) numbers[count++] = bvh_.primitives[i];
        for (std::uint32_t i = 0; i < blocks; ++i) {
            const std::uint32_t* const first = numbers + i * kBlockSize;
            const std::uint32_t used = std::min(kBlockSize, count - i * kBlockSize);
            if (spheres)
                fill_spheres(wide_.sphere_blocks[chunk.first_sphere_block + first_block + i], first, used);
            else
                fill_triangles(wide_.triangle_blocks[chunk.first_triangle_block + first_block + i], first, used);
        }
        return CASTOR_WIDE_LEAF | (spheres ? CASTOR_WIDE_SPHERES : 0u) | (blocks - 1) << CASTOR_WIDE_COUNT_SHIFT |
               first_block;
    }

    void fill_triangles(shared::TriangleBlock& block, const std::uint32_t* numbers, std::uint32_t count) const {
        for (std::uint32_t lane = 0; lane < kBlockSize; ++lane) {
            block.primitive[lane] = lane < count ? numbers[lane] : CASTOR_INVALID_INDEX;
            const glm::uvec3 triangle = lane < count ? arrays_.triangle_vertices[numbers[lane]] : glm::uvec3(0);
            for (int vertex = 0; vertex < 3; ++vertex) {
                const glm::vec3 position = lane < count ? arrays_.vertex_position[triangle[vertex]] : glm::vec3(kNaN);
                for (int axis = 0; axis < 3; ++axis) block.vertex[vertex][axis][lane] = position[axis];
            }
        }
    }

    void fill_spheres(shared::SphereBlock& block, const std::uint32_t* numbers, std::uint32_t count) const {
        for (std::uint32_t lane = 0; lane < kBlockSize; ++lane) {
            block.primitive[lane] = lane < count ? numbers[lane] : CASTOR_INVALID_INDEX;
            for (int i = 0; i < 4; ++i)
                block.center_radius[i][lane] =
                    lane < count ? arrays_.sphere_center_radius[numbers[lane] - arrays_.triangle_count()][i] : kNaN;
        }
    }

    const SceneArrays& arrays_;
    const Bvh& bvh_;
    Collapse collapse_;
    std::uint64_t max_column_bytes_;
    Progress progress_;
    std::vector<Chunk> chunks_;
    Numbers start_;  // of the next chunk
    WideBvh wide_;
};

}  // namespace

WideBvh collapse_bvh(const SceneArrays& arrays, const Bvh& bvh, std::uint64_t max_column_bytes,
                     const Progress& progress) {
    return WideBuilder(arrays, bvh, max_column_bytes, progress).build();
}

void append(WideBvh& trees, WideBvh&& tree) {
    if (trees.roots.empty()) trees.chunks = tree.chunks;
    const bool is_empty = tree.root == CASTOR_INVALID_INDEX;
    trees.roots.push_back(is_empty ? CASTOR_INVALID_INDEX : static_cast<std::uint32_t>(trees.nodes.size()) + tree.root);
    trees.root = trees.roots.front();
    if (is_empty) return;
    if (trees.nodes.empty()) {
        trees.nodes = std::move(tree.nodes);
        trees.triangle_blocks = std::move(tree.triangle_blocks);
        trees.sphere_blocks = std::move(tree.sphere_blocks);
        trees.chunks = std::move(tree.chunks);
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
    trees.chunks.assign(1, {0, trees.nodes.size(), 0, trees.triangle_blocks.size(), 0, trees.sphere_blocks.size()});
}

}  // namespace castor
