#include "base/progress.h"

#include <algorithm>
#include <mutex>

#include "castor/error.h"

namespace castor {

namespace {

constexpr double kStep = 0x1p-10;

}  // namespace

struct Progress::Listener {
    ProgressHook hook;
    std::mutex mutex;  // held while the hook is called
    std::atomic<double> told = 0.0;
    std::atomic<bool> is_stopped = false;

    void tell(double fraction) {
        if (is_stopped.load(std::memory_order_relaxed)) throw Interrupted();
        const auto is_news = [&] {
            const double before = told.load(std::memory_order_relaxed);
            return fraction >= before + kStep || (fraction >= 1.0 && before < 1.0);
        };
        if (!is_news()) return;
        std::lock_guard lock(mutex);
        if (is_stopped) throw Interrupted();
        if (!is_news()) return;
        told = fraction;
        if (hook(fraction)) return;
        is_stopped = true;
        throw Interrupted();
    }
};

Progress::Progress(const ProgressHook& hook) {
    if (!hook) return;
    listener_ = std::make_shared<Listener>();
    listener_->hook = hook;
}

Progress Progress::part(double begin, double end) const {
    Progress result;
    result.listener_ = listener_;
    result.begin_ = begin_ + begin * (end_ - begin_);
    result.end_ = begin_ + end * (end_ - begin_);
    return result;
}

void Progress::tell(double share) const {
    listener_->tell(share >= 1.0 ? end_ : begin_ + std::max(share, 0.0) * (end_ - begin_));
}

}  // namespace castor
