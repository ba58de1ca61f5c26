#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "castor/renderer.h"

namespace castor {

/// Returns whether a block of a picture belongs to a part. Parts have runs of neighbouring blocks in turn: runs so long
/// that a device has enough to do at a time, and so short that each part has sixteen of them at least where the picture
/// has as many blocks, so that all have about as much work.
inline bool is_of_part(std::uint32_t block, std::uint32_t block_count, const PicturePart& part) {
    constexpr std::uint64_t kRunsOfPart = 16, kLongestRun = 256;
    const std::uint64_t run =
        std::bit_floor(std::clamp<std::uint64_t>(block_count / (kRunsOfPart * part.count), 1, kLongestRun));
    return block / run % part.count == part.number - 1;
}

}  // namespace castor
