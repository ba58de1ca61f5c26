#include "doctor/check.h"

#include <algorithm>

namespace castor::doctor {

std::size_t Rounds::next() {
    constexpr std::size_t kFirst = 16, kMost = 1 << 14, kGrowth = 4;
    ++number_;
    if (number_ == 1) return size_ = kFirst;
    if (seconds_ <= 0) return size_ = 0;
    if (number_ == 2) watch_ = Stopwatch();
    const double now = watch_.seconds(), last = now - round_began_;
    round_began_ = now;
    if (number_ == 2 || now + kGrowth * last < seconds_)
        size_ = std::min(kGrowth * size_, kMost);
    else if (now + last > seconds_)
        size_ = 0;
    return size_;
}

std::vector<Part> make_parts() {
    return {
        {"driver", {}, 0.1, driver_checks()},
        {"functions", {}, 0.2, function_checks()},
        {"brute", {}, 0.1, strategy_checks(Strategy::brute)},
        {"simt", Strategy::simt, 0.2, strategy_checks(Strategy::simt)},
        {"wide", Strategy::wide, 0.2, strategy_checks(Strategy::wide)},
        {"packet", Strategy::packet, 0.2, strategy_checks(Strategy::packet)},
        // Last: NVIDIA's compiler takes warnings for errors ever after in a process that has once asked for it.
        {"compiler", {}, 0.0, compiler_checks()},
    };
}

}  // namespace castor::doctor
