#pragma once

#include <string>
#include <thread>

namespace castor::cli {

/// Shows on standard error that long work goes on of which nobody knows how far it is, and since when: a line that
/// redraws itself on a terminal, a plain line every few seconds elsewhere, nothing if `quiet` or for short work.
/// Nothing else may be written there meanwhile.
class Phase {
public:
    /// `label` is what is done, such as "reading bunny.ply".
    Phase(std::string label, bool quiet);

private:
    std::jthread thread_;
};

}  // namespace castor::cli
