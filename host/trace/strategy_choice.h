#pragma once

#include "base/name_table.h"
#include "castor/tuner.h"

namespace castor {

/// Whether the strategy's kernels read WideBvh.
bool walks_wide_tree(Strategy strategy);

/// The kinds of rays, each with its name in files and reports.
inline constexpr Named<Strategy StrategyChoice::*> kRayKindsOfChoice[] = {
    {&StrategyChoice::closest_coherent, "closest_coherent"},
    {&StrategyChoice::closest_incoherent, "closest_incoherent"},
    {&StrategyChoice::any_coherent, "any_coherent"},
    {&StrategyChoice::any_incoherent, "any_incoherent"},
};

}  // namespace castor
