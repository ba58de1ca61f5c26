#include "bvh/subtree.h"

#include <oneapi/tbb/parallel_for.h>

#include <cstddef>
#include <utility>

namespace castor {

namespace {

struct PlacedBlock {
    const Subtree* block;
    std::uint32_t offset;
};

std::size_t count_descendants(const Subtree& tree) {
    if (!tree.left) return tree.nodes.size();
    return 2 + count_descendants(*tree.left) + count_descendants(*tree.right);
}

class Layout {
public:
    explicit Layout(const Subtree& tree) : nodes_(2 + count_descendants(tree)) {
        nodes_[1] = BvhNode{};
        place(tree, 0);
    }

    Column<BvhNode> finish() {
        tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t i) { copy(blocks_[i]); });
        return std::move(nodes_);
    }

private:
    void place(const Subtree& tree, std::uint32_t index) {
        const std::uint32_t first = next_;
        nodes_[index] = tree.root;
        if (tree.root.count == 0) nodes_[index].first = first;
        if (tree.left) {
            next_ += 2;
            place(*tree.left, first);
            place(*tree.right, first + 1);
        } else {
            next_ += static_cast<std::uint32_t>(tree.nodes.size());
            blocks_.push_back({&tree, first});
        }
    }

    void copy(const PlacedBlock& placed) {
        BvhNode* destination = nodes_.data() + placed.offset;
        for (BvhNode node : placed.block->nodes) {
            if (node.count == 0) node.first += placed.offset;
            *destination++ = node;
        }
    }

    Column<BvhNode> nodes_;
    std::uint32_t next_ = 2;
    std::vector<PlacedBlock> blocks_;
};

}  // namespace

Column<BvhNode> lay_out(const Subtree& tree) {
    return Layout(tree).finish();
}

}  // namespace castor
