// One work-item a path, for one light. Writes the ray from the surface to the light, and what the light adds to the
// film unless that ray is stopped. Where it adds nothing: a ray that hits nothing, and zero.
#include "castor/shared/wave_columns.h"
#include "device/dead_ray.cl"
#include "device/shading.cl"

// The far end counts: a light that lies on a surface is hidden. The millionth is for the rounding of t.
#define CASTOR_SHADOW_TMAX 1.000001f

kernel void generate_shadow_rays(const RenderParams params, const uint light_index, const global Light *restrict lights,
                                 const global Material *restrict materials, CASTOR_READ(path_slot),
                                 CASTOR_READ(surface_position), CASTOR_READ(surface_normal), CASTOR_READ(surface_wo),
                                 CASTOR_READ(surface_material), CASTOR_READ(path_throughput),
                                 CASTOR_WRITE(shadow_origin_tmin), CASTOR_WRITE(shadow_direction_tmax),
                                 CASTOR_WRITE(shadow_contribution), CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    float4 origin_tmin = dead_origin_tmin();
    float4 direction_tmax = dead_direction_tmax();
    float3 contribution = (float3)(0.0f);
    const uint material = surface_material[place];
    if (material != CASTOR_INVALID_INDEX) {
        const uint slot = path_slot[place];
        const Light light = lights[light_index];
        const float3 position = surface_position[place].xyz;
        const float3 normal = surface_normal[place].xyz;
        const LightSample sample = sample_light(light, position);
        contribution = path_throughput[slot].xyz *
                       blinn_phong(materials[material], params.flags, normal, surface_wo[place].xyz, sample);
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
    shadow_origin_tmin[place] = origin_tmin;
    shadow_direction_tmax[place] = direction_tmax;
    shadow_contribution[place] = (float4)(contribution, 0.0f);
}
