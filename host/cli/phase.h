#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "castor/progress.h"

namespace castor::cli {

/// A display of long work on standard error: a bar that redraws itself on a terminal, a plain line every few seconds
/// elsewhere, nothing if `quiet` or for short work. Shows the elapsed time until the hook is first called. Nothing else
/// may be written to standard error while the object lives.
class Phase {
public:
    /// `label` names the work, such as "reading bunny.ply".
    Phase(std::string label, bool quiet);

    /// Returns a hook that takes the fraction of the work that is done. The hook returns false after a signal (see
    /// catch_interrupts). It may be called as long as this object lives.
    ProgressHook hook();

private:
    std::atomic<double> fraction_ = 0.0;  // 0: not known
    std::jthread thread_;
};

}  // namespace castor::cli
