#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "castor/device.h"
#include "castor/tracer.h"
#include "schedule/pace.h"

namespace castor {

/// An item of a batch has so many rays, and an item of a picture so many pixels.
constexpr std::size_t kRaysPerItem = 64;

/// Returns the pace of a device before anything is measured. A slice keeps all of the device busy: a compute unit of a
/// CPU works on one work-group at a time, one of a GPU has some two thousand rays on their way at once.
inline Pace first_pace(Strategy strategy, const Device& device) {
    const std::uint64_t least =
        std::max<std::uint64_t>(1, device.compute_units) * (device.type == DeviceType::gpu ? 32 : 1);
    return {least, strategy == Strategy::brute ? least : std::max<std::uint64_t>(16, least)};
}

}  // namespace castor
