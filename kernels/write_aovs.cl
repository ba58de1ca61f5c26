// One work-item a slot. Writes what the eye ray met. A miss: position and normal 0, depth infinite, indices
// CASTOR_INVALID_INDEX.
#include "castor/shared/types.h"
#include "device/vector.cl"

kernel void write_aovs(const RenderParams params, const global float4 *restrict ray_origin_tmin,
                       const global Hit *restrict hits, const global float4 *restrict surface_position,
                       const global float4 *restrict surface_normal, const global uint *restrict surface_material,
                       global float4 *restrict aov_position_depth, global float4 *restrict aov_normal,
                       global float4 *restrict aov_barycentric_t,
                       global uint4 *restrict aov_primitive_instance_material)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    const Hit hit = hits[slot];
    const int is_hit = hit.primitive != CASTOR_INVALID_INDEX;
    const float3 position = is_hit ? surface_position[slot].xyz : (float3)(0.0f);
    const float depth = is_hit ? vector_length(position - ray_origin_tmin[slot].xyz) : INFINITY;
    aov_position_depth[slot] = (float4)(position, depth);
    aov_normal[slot] = is_hit ? (float4)(surface_normal[slot].xyz, 0.0f) : (float4)(0.0f);
    aov_barycentric_t[slot] = (float4)(hit.u, hit.v, hit.t, 0.0f);
    aov_primitive_instance_material[slot] =
        (uint4)(hit.primitive, hit.instance, is_hit ? surface_material[slot] : CASTOR_INVALID_INDEX, 0u);
}
