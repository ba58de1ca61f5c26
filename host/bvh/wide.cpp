#include "bvh/wide.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "bvh/box.h"
#include "bvh/collapse.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr std::uint32_t kBlockSize = 4;

// Prices of a visit of a wide node and of a test of a block, measured on diffuse rays.
constexpr CollapseOptions kBlocksOfFour = {kBlockSize, CASTOR_WIDE_COUNT_MASK + 1, true, 1.0f, 0.6f};

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class WideBuilder {
public:
    WideBuilder(const SceneArrays& arrays, const Bvh& bvh) : arrays_(arrays), bvh_(bvh), collapse_(arrays, bvh, kBlocksOfFour) {}

    WideBvh build() {
        if (bvh_.nodes.empty()) return {};
        wide_.root = add_node(0);
        fill_blocks();
        return std::move(wide_);
    }

private:
    std::uint32_t add_node(std::uint32_t node) {
        const std::vector<WideChild> children = collapse_.children_of(node);
        const std::uint32_t index = static_cast<std::uint32_t>(wide_.nodes.size());
        wide_.nodes.push_back(empty_node());
        for (std::size_t place = 0; place < children.size(); ++place) {
            const WideChild& child = children[place];
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

    std::uint32_t add_leaf(const WideChild& child) {
        const bool spheres = child.range.spheres > 0;
        std::uint32_t& next = spheres ? sphere_block_count_ : triangle_block_count_;
        const std::uint32_t first = next;
        const std::uint32_t blocks = collapse_.block_count(child.range);
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
        const PrimitiveRange& range = collapse_.range_of(leaf.node);
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
    Collapse collapse_;
    std::vector<Leaf> leaves_;
    std::uint32_t triangle_block_count_ = 0;
    std::uint32_t sphere_block_count_ = 0;
    WideBvh wide_;
};

}  // namespace

WideBvh collapse_bvh(const SceneArrays& arrays, const Bvh& bvh) { return WideBuilder(arrays, bvh).build(); }

}  // namespace castor
