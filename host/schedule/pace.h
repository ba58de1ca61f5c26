#pragma once

#include <algorithm>
#include <cstdint>

namespace castor {

/// Measures how fast a worker is, and derives from it how much the worker gets at a time. What a worker does between
/// two signs of life is a slice of about kSliceSeconds, so that no watchdog strikes and a stop takes effect soon.
class Pace {
public:
    static constexpr double kSliceSeconds = 0.04;

    /// A slice has at least `least_items`, since fewer would take as long, and `first_items` while the speed is
    /// unknown.
    Pace(std::uint64_t least_items, std::uint64_t first_items)
        : least_items_(std::max<std::uint64_t>(1, least_items)), first_items_(std::max(least_items_, first_items)) {}

    /// Takes the time of a slice into account. The first slice is ignored, because drivers compile kernels in it.
    void add(std::uint64_t items, double seconds) {
        if (slices_++ == 0) return;
        const double now = seconds / static_cast<double>(items);
        item_seconds_ = slices_ < 4 ? now : 0.5 * (item_seconds_ + now);
    }
    bool is_known() const { return item_seconds_ > 0.0; }
    double items_per_second() const { return is_known() ? 1.0 / item_seconds_ : 0.0; }  // 0: not known yet
    double expected_seconds(std::uint64_t items) const { return item_seconds_ * static_cast<double>(items); }

    /// Returns the number of items in a slice, at most `most`; few while the speed is unknown.
    std::uint64_t items_in_slice(std::uint64_t most) const {
        if (!is_known()) return std::min(first_items_, most);
        const double items = kSliceSeconds / item_seconds_;
        return items >= static_cast<double>(most)
                   ? most
                   : std::clamp<std::uint64_t>(static_cast<std::uint64_t>(items), std::min(least_items_, most), most);
    }

private:
    std::uint64_t least_items_, first_items_;
    double item_seconds_ = 0.0;
    std::uint64_t slices_ = 0;
};

}  // namespace castor
