#pragma once

#include <algorithm>
#include <cstdint>

namespace castor {

/// How long a device takes, and so how much it gets at a time: what is enqueued before the host looks again is a slice of at most about kSliceSeconds, so
/// that no watchdog strikes, and a render stops soon.
class Pace {
public:
    static constexpr double kSliceSeconds = 0.04;

    /// The first slice is not representative: drivers compile kernels then.
    void add(std::uint64_t units, double seconds) {
        if (slices_++ == 0) return;
        const double now = seconds / static_cast<double>(units);
        unit_seconds_ = slices_ < 4 ? now : 0.5 * (unit_seconds_ + now);
    }
    double units_per_second() const { return unit_seconds_ > 0.0 ? 1.0 / unit_seconds_ : 0.0; }  // 0: not known yet
    double expected_seconds(std::uint64_t units) const { return unit_seconds_ * static_cast<double>(units); }

    /// As many units as make a slice, from 1 to `most`; as long as nothing is known, at most `first`.
    std::uint64_t units_in_slice(std::uint64_t most, std::uint64_t first) const {
        if (unit_seconds_ <= 0.0) return std::min(first, most);
        const double units = kSliceSeconds / unit_seconds_;
        return units >= static_cast<double>(most) ? most : std::max<std::uint64_t>(1, static_cast<std::uint64_t>(units));
    }

private:
    double unit_seconds_ = 0.0;
    std::uint64_t slices_ = 0;
};

}  // namespace castor
