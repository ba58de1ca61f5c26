#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "castor/device.h"
#include "castor/tracer.h"

namespace castor {

/// How long a device takes, and so how much it gets at a time: what is enqueued before the host looks again is a slice
/// of at most about kSliceSeconds, so that no watchdog strikes, and what was asked for stops soon when it is to. A unit
/// is kRaysPerUnit rays, or the samples of as many pixels.
class Pace {
public:
    static constexpr double kSliceSeconds = 0.04;
    static constexpr std::size_t kRaysPerUnit = 64;

    /// A slice does not get smaller than what makes all of the device work: a compute unit of a CPU is at one
    /// work-group at a time, one of a GPU has some two thousand rays on their way at once. Less would take as long.
    Pace(Strategy strategy, const Device& device)
        : least_units_(std::max<std::uint64_t>(1, device.compute_units) * (device.type == DeviceType::gpu ? 32 : 1)),
          first_units_(strategy == Strategy::brute ? least_units_ : std::max<std::uint64_t>(16, least_units_)) {}

    /// The first slice is not representative: drivers compile kernels then.
    void add(std::uint64_t units, double seconds) {
        if (slices_++ == 0) return;
        const double now = seconds / static_cast<double>(units);
        unit_seconds_ = slices_ < 4 ? now : 0.5 * (unit_seconds_ + now);
    }
    double units_per_second() const { return unit_seconds_ > 0.0 ? 1.0 / unit_seconds_ : 0.0; }  // 0: not known yet
    double expected_seconds(std::uint64_t units) const { return unit_seconds_ * static_cast<double>(units); }

    /// As many units as make a slice, at most `most`; few as long as nothing is known.
    std::uint64_t units_in_slice(std::uint64_t most) const {
        if (unit_seconds_ <= 0.0) return std::min(first_units_, most);
        const double units = kSliceSeconds / unit_seconds_;
        return units >= static_cast<double>(most)
                   ? most
                   : std::clamp<std::uint64_t>(static_cast<std::uint64_t>(units), std::min(least_units_, most), most);
    }

private:
    std::uint64_t least_units_, first_units_;
    double unit_seconds_ = 0.0;
    std::uint64_t slices_ = 0;
};

}  // namespace castor
