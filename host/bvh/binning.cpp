#include "bvh/binning.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

#include "base/avx2_clone.h"

namespace castor {

namespace {

constexpr std::size_t kGrain = 8192;
constexpr std::size_t kMany = 128;

void add(Bins& bins, const PrimitiveRef& ref, Int4 places) {
    for (int axis = 0; axis < 3; ++axis) {
        const int bin = places[axis];
        bins.boxes[bin][axis].extend(ref.box);
        ++bins.counts[bin][axis];
    }
}

void merge(Bins& a, const Bins& b) {
    for (int bin = 0; bin < a.bin_count; ++bin) {
        for (int axis = 0; axis < 3; ++axis) a.boxes[bin][axis].extend(b.boxes[bin][axis]);
        a.counts[bin] += b.counts[bin];
    }
}

// Neighbours often share a bin, and would wait for each other: so every other one has bins of its own.
void add_many(Bins& bins, std::span<const PrimitiveRef> refs, const Binning& binning) {
    Bins others(bins.bin_count);
    std::size_t i = 0;
    for (; i + 2 <= refs.size(); i += 2) {
        add(bins, refs[i], binning.bins(refs[i].center2()));
        add(others, refs[i + 1], binning.bins(refs[i + 1].center2()));
    }
    if (i < refs.size()) add(bins, refs[i], binning.bins(refs[i].center2()));
    merge(bins, others);
}

CASTOR_AVX2_CLONE void add(Bins& bins, std::span<const PrimitiveRef> refs, const Binning& binning) {
    if (refs.size() >= kMany) return add_many(bins, refs, binning);
    for (const PrimitiveRef& ref : refs) add(bins, ref, binning.bins(ref.center2()));
}

// Lengths are taken in units of a box's largest extent: then areas neither overflow nor vanish.
float length_unit(const Box& box) {
    const float unit = 1.0f / longest_side(box);
    return std::isfinite(unit) ? unit : 1.0f;
}

// Half of the surfaces of three boxes, one a lane. Fourth lanes may hold denormal numbers, whose products are slow.
Float4 half_areas(const Box (&boxes)[3], float unit) {
    const Float4 a = boxes[0].upper - boxes[0].lower, b = boxes[1].upper - boxes[1].lower,
                 c = boxes[2].upper - boxes[2].lower;
    const Float4 ab_xy = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab_z = __builtin_shufflevector(a, b, 2, 6, 2, 6);
    const Float4 x = __builtin_shufflevector(ab_xy, c, 0, 1, 4, 4) * unit,
                 y = __builtin_shufflevector(ab_xy, c, 2, 3, 5, 5) * unit,
                 z = __builtin_shufflevector(ab_z, c, 0, 1, 6, 6) * unit;
    return x * y + y * z + z * x;
}

// One side of a split of each axis.
struct Side {
    Box boxes[3];
    Int4 counts{};

    void extend(const Bins& bins, int bin) {
        for (int axis = 0; axis < 3; ++axis) boxes[axis].extend(bins.boxes[bin][axis]);
        counts += bins.counts[bin];
    }
    Float4 costs(float unit, int block_bits) const {
        const Int4 tests = (counts + ((1 << block_bits) - 1)) >> block_bits;
        return half_areas(boxes, unit) * __builtin_convertvector(tests, Float4);
    }
};

CASTOR_AVX2_CLONE void rank(std::span<const PrimitiveRef> refs, Int4* of) {
    Float4 centers2[kMaxSorted];
    for (std::size_t i = 0; i < refs.size(); ++i) {
        centers2[i] = refs[i].center2();
        of[i] = Int4{};
        // Comparisons are -1 where true.
        for (std::size_t j = 0; j < i; ++j) {
            const Int4 is_before = centers2[i] < centers2[j];
            of[j] -= is_before;
            of[i] += is_before + 1;
        }
    }
}

CASTOR_AVX2_CLONE Split find_best_split(const Bins& bins, const Box& box, int block_bits) {
    const float unit = length_unit(box);
    Float4 right_costs[kMaxBins];
    Side right;
    for (int bin = bins.bin_count - 1; bin > 0; --bin) {
        right.extend(bins, bin);
        right_costs[bin] = right.costs(unit, block_bits);
    }
    // Of each axis; imbalance is the difference of the two sides' counts.
    const Int4 totals = right.counts + bins.counts[0];
    Float4 best_costs = Float4{} + Box::kInfinity;
    Int4 best_bins{}, best_imbalances{};
    Side left;
    for (int bin = 1; bin < bins.bin_count; ++bin) {
        left.extend(bins, bin - 1);
        const Float4 costs = left.costs(unit, block_bits) + right_costs[bin];
        const Int4 difference = left.counts + left.counts - totals;
        const Int4 imbalances = difference < 0 ? -difference : difference;
        // Where a side is empty its cost has no meaning.
        const Int4 is_better = (left.counts > 0) & (left.counts < totals) &
                               ((costs < best_costs) | ((costs == best_costs) & (imbalances < best_imbalances)));
        best_costs = is_better ? costs : best_costs;
        best_bins = is_better ? Int4{} + bin : best_bins;
        best_imbalances = is_better ? imbalances : best_imbalances;
    }
    int best = -1;
    for (int axis = 0; axis < 3; ++axis) {
        if (best_bins[axis] == 0) continue;
        if (best < 0 || best_costs[axis] < best_costs[best] ||
            (best_costs[axis] == best_costs[best] && best_imbalances[axis] < best_imbalances[best]))
            best = axis;
    }
    Split split;
    if (best < 0) return split;
    split.axis = best;
    split.bin = best_bins[best];
    const Box whole[3] = {box, box, box};
    const float area = half_areas(whole, unit)[0];
    split.cost = area > 0.0f ? best_costs[best] / area : Box::kInfinity;
    return split;
}

}  // namespace

Binning::Binning(const Box& centers2, std::size_t primitive_count)
    : bin_count(static_cast<int>(std::min<std::size_t>(kMaxBins, 4 + primitive_count / 4))), base{}, scale{} {
    for (int axis = 0; axis < 3; ++axis) {
        base[axis] = centers2.lower[axis];
        const float inverse = static_cast<float>(bin_count) / (centers2.upper[axis] - centers2.lower[axis]);
        scale[axis] = std::isfinite(inverse) ? inverse : 0.0f;
    }
}

Bins fill_bins(std::span<const PrimitiveRef> refs, const Binning& binning) {
    if (refs.size() <= kGrain) {
        Bins bins(binning.bin_count);
        add(bins, refs, binning);
        return bins;
    }
    using Blocks = tbb::blocked_range<std::size_t>;
    const auto fill = [&](const Blocks& range, Bins bins) {
        add(bins, refs.subspan(range.begin(), range.size()), binning);
        return bins;
    };
    const auto join = [](Bins a, const Bins& b) {
        merge(a, b);
        return a;
    };
    return tbb::parallel_deterministic_reduce(Blocks(0, refs.size(), kGrain), Bins(binning.bin_count), fill, join);
}

Ranks::Ranks(std::span<const PrimitiveRef> refs) {
    rank(refs, of);
}

Bins fill_bins(std::span<const PrimitiveRef> refs, const Ranks& ranks) {
    Bins bins(0);
    bins.bin_count = static_cast<int>(refs.size());
    for (std::size_t i = 0; i < refs.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) bins.boxes[ranks.of[i][axis]][axis] = refs[i].box;
        bins.counts[i] = Int4{1, 1, 1, 1};
    }
    return bins;
}

Split best_split(const Bins& bins, const Box& box, int block_bits) {
    return find_best_split(bins, box, block_bits);
}

Sides sides_of(const Bins& bins, const Split& split) {
    Sides sides;
    for (int bin = 0; bin < split.bin; ++bin) sides.left.extend(bins.boxes[bin][split.axis]);
    for (int bin = split.bin; bin < bins.bin_count; ++bin) sides.right.extend(bins.boxes[bin][split.axis]);
    return sides;
}

}  // namespace castor
