// One work-item a slot. Writes its pixel's mean over the samples, three floats a slot.
#include "castor/shared/types.h"
#include "device/exact.cl"

kernel void resolve(const RenderParams params, const uint sample_count, const global float4 *restrict film_sum,
                    global float *restrict pixel_means)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    const float count = (float)sample_count;
    const float3 sum = film_sum[slot].xyz;
    const float3 mean = (float3)(divide(sum.x, count), divide(sum.y, count), divide(sum.z, count));
    vstore3(mean, slot, pixel_means);
}
