#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "bvh/box.h"
#include "bvh/primitive_ref.h"

namespace castor {

inline constexpr int kMaxBins = 16;

/// Tests that a device makes for so many primitives if it tests `primitives_per_test` at once.
inline std::size_t test_count(std::size_t primitives, std::size_t primitives_per_test) {
    return (primitives + primitives_per_test - 1) / primitives_per_test;
}

/// Slices the box of the centres evenly on each axis. An axis on which the centres do not differ, or differ by so
/// little that its scale would overflow, has scale 0: everything is in its bin 0.
struct Binning {
    int bin_count;
    float base[3];
    float scale[3];

    /// Few primitives need few bins.
    Binning(const Box& centers2, std::size_t primitive_count);

    int bin(const PrimitiveRef& ref, int axis) const {
        const int slice = static_cast<int>((ref.center2(axis) - base[axis]) * scale[axis]);
        return slice < bin_count ? slice : bin_count - 1;
    }
};

/// What lies in each bin of each axis.
struct Bins {
    Box boxes[3][kMaxBins];
    std::uint32_t counts[3][kMaxBins] = {};
};

/// Primitives whose bin on `axis` is below `bin` go left.
struct Split {
    int axis = -1;  // -1: there is none
    int bin = 0;
    double cost = 0.0;  // sum over the two sides of half area times number of tests
};

Bins fill_bins(std::span<const PrimitiveRef> refs, const Binning& binning);

/// The cheapest split by the surface area heuristic, and of equally cheap ones the most even; none if all
/// centres share their bins.
Split best_split(const Bins& bins, const Binning& binning, std::size_t primitives_per_test);

}  // namespace castor
