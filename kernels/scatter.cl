// One work-item a slot. Replaces its ray by the mirror ray of its surface, or by one that hits nothing, and counts the
// former in `alive_count`.
#include "device/dead_ray.cl"
#include "device/shading.cl"

kernel void scatter(const RenderParams params, const global Material *restrict materials,
                    const global float4 *restrict surface_position, const global float4 *restrict surface_normal,
                    const global float4 *restrict surface_wo, const global uint *restrict surface_material,
                    global float4 *restrict path_throughput, global float4 *restrict ray_origin_tmin,
                    global float4 *restrict ray_direction_tmax, global uint *restrict ray_counts,
                    global uint *restrict alive_count)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    float4 origin_tmin = dead_origin_tmin();
    float4 direction_tmax = dead_direction_tmax();
    const uint material = surface_material[slot];
    if (material != CASTOR_INVALID_INDEX) {
        const float3 normal = surface_normal[slot].xyz;
        const float3 wo = surface_wo[slot].xyz;
        const float cos_wo = dot_product(normal, wo);
        const float3 throughput = path_throughput[slot].xyz * mirror_factor(materials[material], params.flags, cos_wo);
        if (throughput.x != 0.0f || throughput.y != 0.0f || throughput.z != 0.0f) {
            const float3 wi = 2.0f * cos_wo * normal - wo;
            const float3 offset = params.flags & CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY ? wi : normal;
            const float3 origin = point_on_ray(surface_position[slot].xyz, params.shadow_epsilon, offset);
            origin_tmin = (float4)(origin, CASTOR_SMALLEST_T);
            direction_tmax = (float4)(wi, INFINITY);
            path_throughput[slot] = (float4)(throughput, 0.0f);
            ++ray_counts[slot];
            atomic_inc(alive_count);
        }
    }
    ray_origin_tmin[slot] = origin_tmin;
    ray_direction_tmax[slot] = direction_tmax;
}
