#include "bvh/binning.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

namespace castor {

namespace {

constexpr std::size_t kGrain = 32768;

void add(Bins& bins, std::span<const PrimitiveRef> refs, const Binning& binning) {
    for (const PrimitiveRef& ref : refs) {
        for (int axis = 0; axis < 3; ++axis) {
            const int bin = binning.bin(ref, axis);
            bins.boxes[axis][bin].extend(ref.box);
            ++bins.counts[axis][bin];
        }
    }
}

Bins merged(Bins a, const Bins& b) {
    for (int axis = 0; axis < 3; ++axis) {
        for (int bin = 0; bin < kMaxBins; ++bin) {
            a.boxes[axis][bin].extend(b.boxes[axis][bin]);
            a.counts[axis][bin] += b.counts[axis][bin];
        }
    }
    return a;
}

// One side of every split of one axis.
struct Side {
    Box box;
    std::uint32_t count = 0;

    void extend(const Box& other, std::uint32_t other_count) {
        box.extend(other);
        count += other_count;
    }
    double cost(std::size_t primitives_per_test) const {
        return count == 0 ? 0.0 : half_area(box) * static_cast<double>(test_count(count, primitives_per_test));
    }
};

struct Candidate {
    Split split;
    std::uint32_t imbalance = 0;

    bool is_better_than(const Candidate& other) const {
        if (other.split.axis < 0) return true;
        return split.cost < other.split.cost || (split.cost == other.split.cost && imbalance < other.imbalance);
    }
};

Candidate best_on_axis(const Bins& bins, int axis, int bin_count, std::size_t primitives_per_test, Candidate best) {
    double right_costs[kMaxBins];
    Side right;
    for (int bin = bin_count - 1; bin > 0; --bin) {
        right.extend(bins.boxes[axis][bin], bins.counts[axis][bin]);
        right_costs[bin] = right.cost(primitives_per_test);
    }
    const std::uint32_t total = right.count + bins.counts[axis][0];
    Side left;
    for (int bin = 1; bin < bin_count; ++bin) {
        left.extend(bins.boxes[axis][bin - 1], bins.counts[axis][bin - 1]);
        if (left.count == 0 || left.count == total) continue;
        const std::uint32_t right_count = total - left.count;
        const Candidate candidate{{axis, bin, left.cost(primitives_per_test) + right_costs[bin]},
                                  std::max(left.count, right_count) - std::min(left.count, right_count)};
        if (candidate.is_better_than(best)) best = candidate;
    }
    return best;
}

}  // namespace

Binning::Binning(const Box& centers2, std::size_t primitive_count)
    : bin_count(static_cast<int>(std::min<std::size_t>(kMaxBins, 4 + primitive_count / 4))) {
    for (int axis = 0; axis < 3; ++axis) {
        base[axis] = centers2.lower[axis];
        const float inverse = static_cast<float>(bin_count) / (centers2.upper[axis] - centers2.lower[axis]);
        scale[axis] = std::isfinite(inverse) ? inverse : 0.0f;
    }
}

Bins fill_bins(std::span<const PrimitiveRef> refs, const Binning& binning) {
    if (refs.size() <= kGrain) {
        Bins bins;
        add(bins, refs, binning);
        return bins;
    }
    using Range = tbb::blocked_range<std::size_t>;
    const auto fill = [&](const Range& range, Bins bins) {
        add(bins, refs.subspan(range.begin(), range.size()), binning);
        return bins;
    };
    return tbb::parallel_deterministic_reduce(Range(0, refs.size(), kGrain), Bins{}, fill, merged);
}

Split best_split(const Bins& bins, const Binning& binning, std::size_t primitives_per_test) {
    Candidate best;
    for (int axis = 0; axis < 3; ++axis) {
        if (binning.scale[axis] > 0.0f) best = best_on_axis(bins, axis, binning.bin_count, primitives_per_test, best);
    }
    return best.split;
}

}  // namespace castor
