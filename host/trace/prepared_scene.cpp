#include "trace/prepared_scene.h"

#include <algorithm>

#include "stopwatch.h"

namespace castor {

PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality) {
    const auto needs = [&](Strategy strategy) {
        return std::any_of(strategies.begin(), strategies.end(), [&](const StrategyChoice& choice) {
            return choice.uses(strategy);
        });
    };
    PreparedScene prepared;
    const Stopwatch flatten_watch;
    prepared.arrays = flatten(scene);
    prepared.flatten_seconds = flatten_watch.seconds();

    const Stopwatch build_watch;
    const bool needs_wide = needs(Strategy::wide) || needs(Strategy::packet);
    const bool needs_compressed = needs(Strategy::simt);
    if (needs_wide || needs_compressed) {
        BvhOptions options = needs_wide ? kForBlocks : BvhOptions{};
        options.quality = quality;
        const Bvh bvh = build_bvh(prepared.arrays, options);
        if (!bvh.nodes.empty()) prepared.bounds = box_of(bvh.nodes.front());
        if (needs_wide) prepared.wide = collapse_bvh(prepared.arrays, bvh);
        if (needs_compressed) prepared.compressed = compress_bvh(prepared.arrays, bvh);
    }
    prepared.build_seconds = build_watch.seconds();
    return prepared;
}

}  // namespace castor
