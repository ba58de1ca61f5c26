// Traces a batch of incoherent rays through the 8-wide tree: see traverse_wide.cl and traverse_divergent.cl.
#include "castor/shared/layout.h"
#include "device/traverse_divergent.cl"

// Traces rays [begin, end) of the columns, at most CASTOR_WIDE_BATCH. `wants_any` (a constant): the first hit found
// ends a ray's search, and `occluded` is written; else the nearest hit is found, and `hits` is written.
CASTOR_NOINLINE void trace_batch(const SceneColumns scene, const uint begin, const uint end, const int wants_any,
                                 const global float4 *restrict ray_origin_tmin,
                                 const global float4 *restrict ray_direction_tmax, global Hit *hits,
                                 global uchar *occluded)
{
    RayGroup groups[(CASTOR_WIDE_BATCH + CASTOR_GROUP_RAYS - 1) / CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
    const Bounds bounds = bounds_of_scene(scene);
    WaitingStack waiting[CASTOR_WIDE_LANES];
    DeferredChildren *have_deferred = 0;
#if CASTOR_REGISTERS_OF_16
    const float spread = greatest_spread(scene);
    DeferredChildren deferred[(CASTOR_WIDE_BATCH + CASTOR_GROUP_RAYS - 1) / CASTOR_GROUP_RAYS];
#endif
    ushort places[CASTOR_WIDE_BATCH];
    uint place_count = 0;
    for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS) {
        RayGroup *group = &groups[first / CASTOR_GROUP_RAYS];
        make_ray_group(group, scene, bounds, begin + first, end, wants_any, ray_origin_tmin, ray_direction_tmax, hits,
                       occluded);
        uint mask = undecided_rays(group, wants_any);
#if CASTOR_REGISTERS_OF_16
        DeferredChildren *deferred_here = &deferred[first / CASTOR_GROUP_RAYS];
        const uint group_end = min(end, begin + first + CASTOR_GROUP_RAYS);
        if (mask && spread_of_rays(scene.params, begin + first, group_end, ray_origin_tmin) <= spread) {
            mask = trace_together(group, &scene, mask, 0, scene.params.wide_root, wants_any, deferred_here, waiting);
            have_deferred = deferred;
        } else {
            defer_root(deferred_here, scene.params.wide_root);
        }
#endif
        for (; mask; mask &= mask - 1) places[place_count++] = (ushort)(first + lowest_bit(mask));
    }
    if (scene.params.wide_root != CASTOR_INVALID_INDEX)
        trace_lanes(&scene, groups, places, place_count, 0, scene.params.wide_root, wants_any, have_deferred, waiting);
#if CASTOR_HAS_INSTANCES
    if (scene.params.instance_node_count > 0) {
        place_count = 0;
        have_deferred = 0;
#if CASTOR_REGISTERS_OF_16
        const float instance_spread = greatest_spread_of_instances(scene);
#endif
        for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS) {
            RayGroup *group = &groups[first / CASTOR_GROUP_RAYS];
            if (!group->valid) continue;
            turn_to_instances(group, scene, begin + first);
            uint mask = unended_rays(group, wants_any);
#if CASTOR_REGISTERS_OF_16
            DeferredChildren *deferred_here = &deferred[first / CASTOR_GROUP_RAYS];
            const uint group_end = min(end, begin + first + CASTOR_GROUP_RAYS);
            if (mask && spread_of_rays(scene.params, begin + first, group_end, ray_origin_tmin) <= instance_spread) {
                mask = trace_together(group, &scene, mask, 1, 0, wants_any, deferred_here, waiting);
                have_deferred = deferred;
            } else {
                defer_root(deferred_here, 0);
            }
#endif
            for (; mask; mask &= mask - 1) places[place_count++] = (ushort)(first + lowest_bit(mask));
        }
        trace_lanes(&scene, groups, places, place_count, 1, 0, wants_any, have_deferred, waiting);
    }
#endif
    for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS)
        write_answers(&groups[first / CASTOR_GROUP_RAYS], scene, begin + first,
                      min(end, begin + first + CASTOR_GROUP_RAYS), wants_any, hits, occluded);
}
