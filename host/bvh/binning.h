#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/box.h"
#include "bvh/primitive_ref.h"

namespace castor {

inline constexpr int kMaxBins = 16;
/// Up to so many primitives each has a bin of its own on each axis, in the order of the centres.
inline constexpr std::size_t kMaxSorted = 8;

/// Slices the box of the centres evenly on each axis. An axis on which the centres do not differ, or differ by so
/// little that its scale would overflow, has scale 0: everything is in its bin 0.
struct Binning {
    int bin_count;
    Float4 base;
    Float4 scale;

    /// Few primitives need few bins.
    Binning(const Box& centers2, std::size_t primitive_count);

    /// On each axis.
    Int4 bins(Float4 center2) const {
        const Int4 slice = __builtin_convertvector((center2 - base) * scale, Int4);
        const Int4 last = Int4{} + (bin_count - 1);
        return slice < last ? slice : last;
    }

    /// On one axis, the same.
    int bin(const PrimitiveRef& ref, int axis) const {
        const float center2 = ref.box.lower[axis] + ref.box.upper[axis];
        const int slice = static_cast<int>((center2 - base[axis]) * scale[axis]);
        return slice < bin_count ? slice : bin_count - 1;
    }
};

/// What lies in each bin, by axis. Bins from bin_count on are not initialised.
struct Bins {
    int bin_count;
    Box boxes[kMaxBins][3];
    Int4 counts[kMaxBins];

    explicit Bins(int count) : bin_count(count) {
        for (int bin = 0; bin < bin_count; ++bin) {
            for (Box& box : boxes[bin]) box = Box{};
            counts[bin] = Int4{};
        }
    }
};

/// Primitives whose bin on `axis` is below `bin` go left.
struct Split {
    int axis = -1;  // -1: there is none
    int bin = 0;
    float cost = 0.0f;  // sum over the two sides of area times number of tests, where the area of the node is 1
};

Bins fill_bins(std::span<const PrimitiveRef> refs, const Binning& binning);

/// Where each of at most kMaxSorted primitives stands on each axis in the order of the centres, equal ones in their own
/// order.
struct Ranks {
    Int4 of[kMaxSorted];

    explicit Ranks(std::span<const PrimitiveRef> refs);
};

Bins fill_bins(std::span<const PrimitiveRef> refs, const Ranks& ranks);

/// The cheapest split by the surface area heuristic, and of equally cheap ones the most even; none if all
/// centres share their bins. `box` is that of all; one test takes `1 << block_bits` primitives.
Split best_split(const Bins& bins, const Box& box, int block_bits);

/// The boxes of the two sides' primitives.
struct Sides {
    Box left, right;
};
Sides sides_of(const Bins& bins, const Split& split);

/// Tests that a device makes for so many primitives if it tests 1 << block_bits at once.
inline std::size_t test_count(std::size_t primitives, int block_bits) {
    return (primitives + (std::size_t{1} << block_bits) - 1) >> block_bits;
}

}  // namespace castor
