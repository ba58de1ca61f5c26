// One work-item a slot, for one light. Writes the ray from the surface to the light, and what the light adds to the
// film unless that ray is stopped. Where it adds nothing: a ray that hits nothing, and zero.
#include "device/dead_ray.cl"
#include "device/shading.cl"

// The far end counts: a light that lies on a surface is hidden. The millionth is for the rounding of t.
#define CASTOR_SHADOW_TMAX 1.000001f

kernel void generate_shadow_rays(const RenderParams params, const uint light_index, const global Light *restrict lights,
                                 const global Material *restrict materials,
                                 const global float4 *restrict surface_position,
                                 const global float4 *restrict surface_normal, const global float4 *restrict surface_wo,
                                 const global uint *restrict surface_material,
                                 const global float4 *restrict path_throughput,
                                 global float4 *restrict shadow_origin_tmin,
                                 global float4 *restrict shadow_direction_tmax,
                                 global float4 *restrict shadow_contribution, global uint *restrict ray_counts)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    float4 origin_tmin = dead_origin_tmin();
    float4 direction_tmax = dead_direction_tmax();
    float3 contribution = (float3)(0.0f);
    const uint material = surface_material[slot];
    if (material != CASTOR_INVALID_INDEX) {
        const Light light = lights[light_index];
        const float3 position = surface_position[slot].xyz;
        const float3 normal = surface_normal[slot].xyz;
        const LightSample sample = sample_light(light, position);
        contribution = path_throughput[slot].xyz *
                       blinn_phong(materials[material], params.flags, normal, surface_wo[slot].xyz, sample);
        if (contribution.x != 0.0f || contribution.y != 0.0f || contribution.z != 0.0f) {
            const float3 offset = params.flags & CASTOR_RULE_SHADOW_ORIGIN_ALONG_RAY ? sample.wi : normal;
            const float3 origin = point_on_ray(position, params.shadow_epsilon, offset);
            const int is_directional = light.kind == CASTOR_LIGHT_DIRECTIONAL;
            origin_tmin = (float4)(origin, CASTOR_SMALLEST_T);
            direction_tmax = is_directional ? (float4)(sample.wi, INFINITY)
                                            : (float4)(to_float3(light.position) - origin, CASTOR_SHADOW_TMAX);
            ++ray_counts[slot];
        }
    }
    shadow_origin_tmin[slot] = origin_tmin;
    shadow_direction_tmax[slot] = direction_tmax;
    shadow_contribution[slot] = (float4)(contribution, 0.0f);
}
