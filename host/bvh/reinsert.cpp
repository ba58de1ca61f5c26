#include "bvh/reinsert.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "base/box.h"

namespace castor {

namespace {

constexpr std::uint32_t kMaxDepth = CASTOR_MAX_STACK - 1;
constexpr std::uint32_t kUnused = 1, kFirstPair = 2;  // nodes
constexpr int kMostPasses = 4;                        // over the same nodes
constexpr int kMostRounds = 8;                        // of a pass
constexpr std::uint32_t kSampleSize = 4096;
constexpr std::size_t kBlockSize = 1024;  // nodes that one task searches places for
// The largest nodes are one in so many, and at most so many. A pass over them takes little time: so it need not gain as
// much.
constexpr std::size_t kLargestShare = 16, kMostLargest = 4096;
constexpr double kLargestGain = 0.25;
// Where all nodes are asked, those that are a larger share of their parent's surface are not: two of three, which gain
// little and take most of the time.
constexpr float kMostShare = 0.5f;
// Nodes that one search looks at below the siblings of its ancestors. They are five on average, but where everything
// overlaps everything there is no other end.
constexpr std::uint32_t kMostVisits = 256;

// A node that would become the sibling of another one, and how much less surface all nodes would have.
struct Move {
    float gain = 0.0f;
    std::uint32_t node = 0;
    std::uint32_t target = 0;
};

bool gains_more(const Move& a, const Move& b) {
    return a.gain > b.gain || (a.gain == b.gain && a.node < b.node);
}

// See half_area; in single precision, in which sums of surfaces are finite up to CASTOR_MAX_COORDINATE, and boxes of
// tiny scenes may have none: these trees stay as they are. The fourth lane may hold a denormal number, whose products
// are slow.
float half_area_of(const Box& box) {
    const Float4 extent = box.upper - box.lower;
    const Float4 products =
        __builtin_shufflevector(extent, extent, 0, 1, 2, 0) * __builtin_shufflevector(extent, extent, 1, 2, 0, 1);
    return products[0] + products[1] + products[2];
}

Box load_box(const BvhNode& node) {
    Box box;
    static_assert(sizeof(Box) == sizeof(BvhNode));
    std::memcpy(static_cast<void*>(&box), &node, sizeof box);  // the fourth lanes have no meaning
    return box;
}

Box joined(Box a, const Box& b) {
    a.extend(b);
    return a;
}

class Reinsertion {
public:
    explicit Reinsertion(Bvh& bvh) : bvh_(bvh), nodes_(bvh.nodes), pairs_(nodes_.size() / 2) {
        using Blocks = tbb::blocked_range<std::uint32_t>;
        tbb::parallel_for(Blocks(0, static_cast<std::uint32_t>(nodes_.size())), [&](const Blocks& range) {
            for (std::uint32_t node = range.begin(); node != range.end(); ++node)
                if (node != kUnused && !is_leaf(node)) pairs_[nodes_[node].first / 2].parent = node;
        });
    }

    // Returns whether a pass was worth its time.
    bool run(float least_gain, const Progress& progress) {
        const std::uint32_t step = static_cast<std::uint32_t>(nodes_.size()) / kSampleSize | 1u;
        double surface = 0.0;  // of all nodes, about
        for (const std::uint32_t node : every(step)) surface += static_cast<double>(step) * area_of(node);
        const double least = least_gain * surface;

        bool has_moved = false;
        for (int pass = 0; pass < kMostPasses; ++pass) {
            const std::vector<Move> moves = best_moves(largest_nodes(), 1.0f);
            if (gain_of(moves) <= kLargestGain * least) break;
            make_pass(moves, 1.0f, progress.part(0.0, 0.2));
            has_moved = true;
        }
        for (int pass = 0; pass < kMostPasses; ++pass) {
            if (step * gain_of(best_moves(every(step), kMostShare)) <= least) break;
            const Progress part = progress.part(0.2 * (pass + 1), 0.2 * (pass + 2));
            make_pass(best_moves(every(1), kMostShare), kMostShare, part);
            has_moved = true;
        }
        return has_moved;
    }

    // Puts nodes and primitives in depth-first order.
    void finish() {
        Column<BvhNode> nodes(nodes_.size());
        Column<std::uint32_t> primitives(bvh_.primitives.size());
        nodes[kUnused] = BvhNode{};
        std::uint32_t next_pair = kFirstPair, next_primitive = 0;
        const auto place = [&](const auto& place_children, std::uint32_t from, std::uint32_t to) -> void {
            nodes[to] = nodes_[from];
            if (is_leaf(from)) {
                nodes[to].first = next_primitive;
                std::copy_n(bvh_.primitives.begin() + nodes_[from].first, nodes_[from].count,
                            primitives.begin() + next_primitive);
                next_primitive += nodes_[from].count;
                return;
            }
            const std::uint32_t first = next_pair;
            next_pair += 2;
            nodes[to].first = first;
            place_children(place_children, nodes_[from].first, first);
            place_children(place_children, nodes_[from].first + 1, first + 1);
        };
        place(place, 0, 0);
        bvh_.depth = height_of(0);
        bvh_.nodes = std::move(nodes);
        bvh_.primitives = std::move(primitives);
    }

private:
    // What is not in the two nodes themselves.
    struct Pair {
        std::uint32_t parent = 0;
        std::uint32_t height = 0;  // edges from the parent to the deepest leaf below
    };

    struct Candidate {
        float saved;  // above the pair: less what the nodes there grow by
        std::uint32_t pair;
    };

    // The search for the best place of one node: branch and bound.
    struct Search {
        Box box;
        float area;
        Move best;
        std::array<Candidate, kMaxDepth + 1> stack;
        std::uint32_t size = 0;
        std::uint32_t visits = 0;

        // What is saved at best by a place below a node, where so much is saved above.
        bool can_gain(float saved) const { return saved - area > best.gain; }
    };

    static std::uint32_t sibling_of(std::uint32_t node) { return node ^ 1u; }
    bool is_leaf(std::uint32_t node) const { return nodes_[node].count > 0; }
    std::uint32_t parent_of(std::uint32_t node) const { return pairs_[node / 2].parent; }
    std::uint32_t height_of(std::uint32_t node) const {
        return is_leaf(node) ? 0 : pairs_[nodes_[node].first / 2].height;
    }
    float area_of(std::uint32_t node) const { return half_area_of(load_box(nodes_[node])); }

    // Fills in the heights below a node. Returns its own.
    std::uint32_t measure(std::uint32_t node) {
        if (is_leaf(node)) return 0;
        const std::uint32_t first = nodes_[node].first;
        return pairs_[first / 2].height = 1 + std::max(measure(first), measure(first + 1));
    }

    // One in so many nodes.
    std::vector<std::uint32_t> every(std::uint32_t step) const {
        std::vector<std::uint32_t> nodes;
        nodes.reserve(nodes_.size() / step);
        for (std::uint64_t node = kFirstPair; node < nodes_.size(); node += step)
            nodes.push_back(static_cast<std::uint32_t>(node));
        return nodes;
    }

    std::vector<std::uint32_t> largest_nodes() const {
        const std::size_t most = std::min<std::size_t>(kMostLargest, nodes_.size() / kLargestShare);
        std::priority_queue<std::pair<float, std::uint32_t>> inner({}, {{area_of(0), 0}});
        std::vector<std::uint32_t> nodes;
        while (!inner.empty() && nodes.size() < most) {
            const std::uint32_t first = nodes_[inner.top().second].first;
            inner.pop();
            for (const std::uint32_t node : {first, first + 1}) {
                nodes.push_back(node);
                if (!is_leaf(node)) inner.emplace(area_of(node), node);
            }
        }
        return nodes;
    }

    // The surface that these moves would save, each by itself.
    static double gain_of(const std::vector<Move>& moves) {
        double gain = 0.0;
        for (const Move& move : moves) gain += move.gain;
        return gain;
    }

    // Makes moves, and others of the nodes that were in the way of each other.
    void make_pass(std::vector<Move> moves, float most_share, const Progress& progress) {
        if (height_of(0) == 0) measure(0);
        for (int round = 0; round < kMostRounds && !moves.empty(); ++round) {
            progress.reach(static_cast<double>(round) / kMostRounds);
            moves = best_moves(make_moves(std::move(moves)), most_share);
        }
    }

    // Those that gain something, in the order of the nodes.
    std::vector<Move> best_moves(std::span<const std::uint32_t> nodes, float most_share) const {
        std::vector<std::vector<Move>> blocks((nodes.size() + kBlockSize - 1) / kBlockSize);
        tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
            for (const std::uint32_t node :
                 nodes.subspan(i * kBlockSize, std::min(kBlockSize, nodes.size() - i * kBlockSize))) {
                const Move move = best_move(node, most_share);
                if (move.gain > 0.0f) blocks[i].push_back(move);
            }
        });
        std::vector<Move> moves;
        for (const std::vector<Move>& block : blocks) moves.insert(moves.end(), block.begin(), block.end());
        return moves;
    }

    // Without a gain where the node stands well, is a larger share of its parent, or is below the root.
    Move best_move(std::uint32_t node, float most_share) const {
        const std::uint32_t parent = parent_of(node);
        Search search;
        search.best.node = node;
        if (parent == 0) return search.best;
        search.box = load_box(nodes_[node]);
        search.area = half_area_of(search.box);

        // Without the node, its parent is not needed any more, and the nodes above may be smaller.
        float saved = area_of(parent);
        if (search.area > most_share * saved) return search.best;
        Box rest = load_box(nodes_[sibling_of(node)]);
        bool shrinks = true;
        for (std::uint32_t at = node; at != 0 && (shrinks || search.can_gain(saved)); at = parent_of(at)) {
            const std::uint32_t side = sibling_of(at);
            if (at != node) {
                visit(side, saved, search);
                search_below(search);
                if (shrinks) {
                    rest.extend(load_box(nodes_[side]));
                    const float shrunk = area_of(parent_of(at)) - half_area_of(rest);
                    saved += shrunk;
                    shrinks = shrunk > 0.0f;
                }
            } else if (!is_leaf(side)) {
                push(nodes_[side].first, saved - (half_area_of(joined(rest, search.box)) - half_area_of(rest)), search);
                search_below(search);
            }
        }
        return search.best;
    }

    // Considers the place beside a node, and keeps its children for later.
    void visit(std::uint32_t node, float saved, Search& search) const {
        const Box box = load_box(nodes_[node]);
        const float gain = saved - half_area_of(joined(box, search.box));
        if (gain > search.best.gain) {
            search.best.gain = gain;
            search.best.target = node;
        }
        if (!is_leaf(node)) push(nodes_[node].first, gain + half_area_of(box), search);
    }

    static void push(std::uint32_t pair, float saved, Search& search) {
        if (search.can_gain(saved)) search.stack[search.size++] = {saved, pair};
    }

    void search_below(Search& search) const {
        while (search.size > 0) {
            const Candidate candidate = search.stack[--search.size];
            if (!search.can_gain(candidate.saved) || search.visits >= kMostVisits) continue;
            search.visits += 2;
            const std::uint32_t size = search.size;
            visit(candidate.pair, candidate.saved, search);
            visit(candidate.pair + 1, candidate.saved, search);
            // The one that promises more comes next.
            if (search.size == size + 2 && search.stack[size].saved > search.stack[size + 1].saved)
                std::swap(search.stack[size], search.stack[size + 1]);
        }
    }

    // Makes the moves that do not meet one that gains more. Returns the nodes of the others.
    std::vector<std::uint32_t> make_moves(std::vector<Move> moves) {
        std::sort(moves.begin(), moves.end(), gains_more);
        std::vector<bool> is_touched(nodes_.size());
        std::vector<std::uint32_t> left;
        for (const Move& move : moves) {
            const std::array touched = {move.node, sibling_of(move.node), parent_of(move.node), move.target,
                                        parent_of(move.target)};
            if (std::any_of(touched.begin(), touched.end(), [&](std::uint32_t node) { return is_touched[node]; })) {
                left.push_back(move.node);
                continue;
            }
            if (!is_possible(move)) continue;
            for (const std::uint32_t node : touched) is_touched[node] = true;
            make(move);
        }
        std::sort(left.begin(), left.end());
        return left;
    }

    // Moves before may have made the tree deep, or have brought the target below the node.
    bool is_possible(const Move& move) const {
        std::uint32_t depth = 1;  // of the two nodes, which will be one level below the target's place
        for (std::uint32_t node = move.target; node != 0; node = parent_of(node)) {
            if (node == move.node) return false;
            ++depth;
        }
        return depth + std::max(height_of(move.node), height_of(move.target)) <= kMaxDepth;
    }

    void make(const Move& move) {
        const std::uint32_t sibling = sibling_of(move.node), parent = parent_of(move.node);
        const BvhNode kept = nodes_[sibling];
        nodes_[sibling] = nodes_[move.target];
        nodes_[move.target].first = move.node & ~1u;
        nodes_[move.target].count = 0;
        nodes_[parent] = kept;
        for (const std::uint32_t node : {sibling, move.target, parent})
            if (!is_leaf(node)) pairs_[nodes_[node].first / 2].parent = node;
        fit(move.target);
        fit_above(move.target);
        fit_above(parent);
    }

    // Gives the nodes above this one the boxes and heights that follow from their children's.
    void fit_above(std::uint32_t node) {
        while (node != 0) {
            node = parent_of(node);
            if (!fit(node)) return;
        }
    }

    // Gives an inner node the box and height that follow from its children's. Returns whether it had others.
    bool fit(std::uint32_t node) {
        BvhNode& fitted = nodes_[node];
        Pair& children = pairs_[fitted.first / 2];
        const Box box = joined(load_box(nodes_[fitted.first]), load_box(nodes_[fitted.first + 1]));
        const std::uint32_t height = 1 + std::max(height_of(fitted.first), height_of(fitted.first + 1));
        bool is_changed = height != children.height;
        children.height = height;
        for (int axis = 0; axis < 3; ++axis) {
            is_changed |= fitted.lower[axis] != box.lower[axis] || fitted.upper[axis] != box.upper[axis];
            fitted.lower[axis] = box.lower[axis];
            fitted.upper[axis] = box.upper[axis];
        }
        return is_changed;
    }

    Bvh& bvh_;
    Column<BvhNode>& nodes_;
    std::vector<Pair> pairs_;  // by half of the first node's number
};

}  // namespace

void reinsert_nodes(Bvh& bvh, float least_gain, const Progress& progress) {
    if (bvh.nodes.size() > kFirstPair + 2) {
        Reinsertion reinsertion(bvh);
        if (reinsertion.run(least_gain, progress)) reinsertion.finish();
    }
    progress.reach(1.0);
}

}  // namespace castor
