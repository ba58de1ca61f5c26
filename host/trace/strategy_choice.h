#pragma once

#include <vector>

#include "castor/device.h"
#include "castor/tracer.h"

namespace castor {

/// Whether the strategy's kernels read WideBvh.
bool walks_wide_tree(Strategy strategy);

/// The strategies of one device by kind of ray; none `automatic`.
struct StrategyChoice {
    Strategy incoherent;
    Strategy coherent;

    Strategy of(Coherence hint) const { return hint == Coherence::coherent ? coherent : incoherent; }
};

/// For each device the strategies that `automatic` stands for there; any other stands for itself.
std::vector<StrategyChoice> choose_strategies(Strategy wanted, const std::vector<Device>& devices);

}  // namespace castor
