#pragma once

#include <cstddef>
#include <span>

#include "bvh/binning.h"
#include "bvh/primitive_ref.h"

namespace castor {

struct Partition {
    std::size_t left_count = 0;
    Bounds left;
    Bounds right;
};

/// Moves the references that go left to the front, in place and in parallel. The order within the sides depends on the
/// references alone, never on the threads.
Partition partition(std::span<PrimitiveRef> refs, const Binning& binning, const Split& split);

}  // namespace castor
