#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "castor/progress.h"

namespace castor {

/// How far a part of something long is, told to whoever waits for all of it. A copy is the same part.
class Progress {
public:
    /// Nobody waits.
    Progress() = default;
    explicit Progress(const ProgressHook& hook);

    /// What lies between two shares of this part.
    Progress part(double begin, double end) const;

    /// This share of the part is done. Shares may come in any order; only one that is larger than all before by a
    /// thousandth is told. Cheap, but not for every element. From any thread. Throws Interrupted where one is not to
    /// go on.
    void reach(double share) const {
        if (listener_) tell(share);
    }

private:
    struct Listener;
    void tell(double share) const;

    std::shared_ptr<Listener> listener_;
    double begin_ = 0.0;
    double end_ = 1.0;
};

/// A part that is done in many steps by several threads.
class ProgressCount {
public:
    ProgressCount(Progress progress, std::uint64_t total) : progress_(std::move(progress)), total_(total) {}

    /// So many more of all steps are done. Throws Interrupted where one is not to go on.
    void add(std::uint64_t steps) {
        const std::uint64_t done = done_.fetch_add(steps, std::memory_order_relaxed) + steps;
        progress_.reach(static_cast<double>(done) / static_cast<double>(total_));
    }

private:
    Progress progress_;
    std::uint64_t total_;
    std::atomic<std::uint64_t> done_ = 0;
};

}  // namespace castor
