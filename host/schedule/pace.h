#pragma once

#include <algorithm>
#include <cstdint>

namespace castor {

/// Measures how fast a worker is, and derives from it how much the worker gets at a time. What a worker does between
/// two signs of life is a slice of about kSliceSeconds, so that no watchdog strikes and a stop takes effect soon. Where
/// a slice has costs that do not depend on its items, such as very many launches, it is longer, so that these are about
/// a twentieth of it, but not longer than kLongestSliceSeconds.
class Pace {
public:
    static constexpr double kSliceSeconds = 0.04, kLongestSliceSeconds = 0.5;

    /// A slice has at least `least_items`, since fewer would take as long, and `first_items` while the speed is
    /// unknown.
    Pace(std::uint64_t least_items, std::uint64_t first_items)
        : least_items_(std::max<std::uint64_t>(1, least_items)), first_items_(std::max(least_items_, first_items)) {}

    /// Takes the time of a slice into account. The first slice is ignored, because drivers compile kernels in it.
    void add(std::uint64_t items, double seconds) {
        if (slices_++ == 0) return;
        const double now = seconds / static_cast<double>(items);
        item_seconds_ = slices_ < 4 ? now : 0.5 * (item_seconds_ + now);
        if (slices_ % kRemembered == 0) knows_fixed_ = false;
        if (last_items_ > 0 && (2 * items >= 3 * last_items_ || 2 * last_items_ >= 3 * items)) {
            // The line through both.
            const double more = static_cast<double>(items) - static_cast<double>(last_items_);
            const double slope = std::max((seconds - last_seconds_) / more, 0.0);
            fixed_seconds_ = std::clamp(seconds - slope * static_cast<double>(items), 0.0, seconds);
            knows_fixed_ = true;
        }
        last_items_ = items;
        last_seconds_ = seconds;
    }
    bool is_known() const { return item_seconds_ > 0.0; }
    double items_per_second() const { return is_known() ? 1.0 / item_seconds_ : 0.0; }  // 0: not known yet
    double expected_seconds(std::uint64_t items) const {
        return is_known() ? fixed_seconds_ + seconds_of_item() * static_cast<double>(items) : 0.0;
    }

    /// Returns the number of items in a slice, at most `most`; few while the speed is unknown.
    std::uint64_t items_in_slice(std::uint64_t most) const {
        if (!is_known()) return std::min(first_items_, most);
        const double items = std::max(kSliceSeconds / item_seconds_, items_beside_fixed());
        return items >= static_cast<double>(most)
                   ? most
                   : std::clamp<std::uint64_t>(static_cast<std::uint64_t>(items), std::min(least_items_, most), most);
    }

private:
    // The fixed costs are measured again after so many slices.
    static constexpr std::uint64_t kRemembered = 16;
    // Slices that are longer than kSliceSeconds grow by so much at most, since their times are estimates.
    static constexpr double kLargestGrowth = 4.0;

    /// Returns the seconds of an item beside the fixed ones.
    double seconds_of_item() const {
        if (fixed_seconds_ == 0.0) return item_seconds_;
        return std::max(0.0, last_seconds_ - fixed_seconds_) / static_cast<double>(last_items_);
    }

    /// Returns how many items make the fixed costs a twentieth of a slice; 0 where a slice of kSliceSeconds will do.
    /// While these costs are unknown, twice as many as in the last slice, which shows them.
    double items_beside_fixed() const {
        const auto last = static_cast<double>(last_items_);
        if (!knows_fixed_) return 2.0 * last_seconds_ <= kLongestSliceSeconds ? 2.0 * last : 0.0;
        const double seconds = std::min(20.0 * fixed_seconds_, kLongestSliceSeconds);
        if (seconds <= kSliceSeconds) return 0.0;
        const double largest = kLargestGrowth * last, of_item = seconds_of_item();
        return of_item * largest > seconds - fixed_seconds_ ? (seconds - fixed_seconds_) / of_item : largest;
    }

    std::uint64_t least_items_, first_items_;
    double item_seconds_ = 0.0;   // of the last slices, fixed costs included
    double fixed_seconds_ = 0.0;  // of a slice
    bool knows_fixed_ = false;
    std::uint64_t slices_ = 0;
    std::uint64_t last_items_ = 0;
    double last_seconds_ = 0.0;
};

}  // namespace castor
