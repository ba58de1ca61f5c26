// One work-item a slot. Adds to the film what a light contributes, unless its shadow ray was stopped.
#include "castor/shared/types.h"

kernel void accumulate(const RenderParams params, const global float4 *restrict shadow_contribution,
                       const global uchar *restrict occluded, global float4 *restrict film_sum)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    if (!occluded[slot]) film_sum[slot] += shadow_contribution[slot];
}
