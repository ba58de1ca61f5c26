#pragma once

#include <cstddef>
#include <span>

#include "bvh/binning.h"
#include "bvh/primitive_ref.h"

namespace castor {

struct Partition {
    std::size_t left_count = 0;
    Box left_centers2;
    Box right_centers2;
};

/// Moves the references that go left to the front, in place and in parallel. The order within the sides depends on the
/// references alone, never on the threads.
Partition partition(std::span<PrimitiveRef> refs, const Binning& binning, const Split& split);

/// The same by ranks. Returns how many go left.
std::size_t partition(std::span<PrimitiveRef> refs, const Ranks& ranks, const Split& split);

}  // namespace castor
