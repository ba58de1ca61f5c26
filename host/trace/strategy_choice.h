#pragma once

#include "base/name_table.h"
#include "castor/tracer.h"

namespace castor {

/// Whether the strategy's kernels read WideBvh.
bool walks_wide_tree(Strategy strategy);

/// The strategies of one device by kind of ray; none `automatic`.
struct StrategyChoice {
    Strategy closest_incoherent;
    Strategy closest_coherent;
    Strategy any_incoherent;
    Strategy any_coherent;

    static StrategyChoice all(Strategy strategy) { return {strategy, strategy, strategy, strategy}; }
    Strategy of(Query query, Coherence hint) const;
    bool uses(Strategy strategy) const;
    bool operator==(const StrategyChoice&) const = default;
};

/// The kinds of rays, each with its name in files and reports.
inline constexpr Named<Strategy StrategyChoice::*> kRayKindsOfChoice[] = {
    {&StrategyChoice::closest_coherent, "closest_coherent"},
    {&StrategyChoice::closest_incoherent, "closest_incoherent"},
    {&StrategyChoice::any_coherent, "any_coherent"},
    {&StrategyChoice::any_incoherent, "any_incoherent"},
};

}  // namespace castor
