#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "castor/progress.h"

namespace castor::cli {

/// Shows on standard error how far long work is, or, as long as nobody tells it, that it goes on and since when: a bar
/// that redraws itself on a terminal, a plain line every few seconds elsewhere, nothing if `quiet` or for short work.
/// Nothing else may be written there meanwhile.
class Phase {
public:
    /// `label` is what is done, such as "reading bunny.ply".
    Phase(std::string label, bool quiet);

    /// To be told the share that is done. Says that the work is not to go on after a signal (see catch_interrupts).
    /// For as long as this object lives.
    ProgressHook hook();

private:
    std::atomic<double> fraction_ = 0.0;  // 0: not known
    std::jthread thread_;
};

}  // namespace castor::cli
