// One work-item a path. Writes the mirror ray of its surface, and next_rank 0; CASTOR_PATH_ENDED where there is none.
#include "castor/shared/wave_columns.h"
#include "device/dead_ray.cl"
#include "device/shading.cl"

kernel void scatter(const RenderParams params, const global Material *restrict materials, CASTOR_READ(path_slot),
                    CASTOR_READ(surface_position), CASTOR_READ(surface_normal), CASTOR_READ(surface_wo),
                    CASTOR_READ(surface_material), CASTOR_WRITE(path_throughput), CASTOR_WRITE(next_slot),
                    CASTOR_WRITE(next_origin_tmin), CASTOR_WRITE(next_direction_tmax), CASTOR_WRITE(next_rank),
                    CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    next_rank[place] = CASTOR_PATH_ENDED;
    const uint material = surface_material[place];
    if (material == CASTOR_INVALID_INDEX) return;
    const uint slot = path_slot[place];
    const float3 normal = surface_normal[place].xyz;
    const float3 wo = surface_wo[place].xyz;
    const float cos_wo = dot_product(normal, wo);
    const float3 throughput = path_throughput[slot].xyz * mirror_factor(materials[material], params.flags, cos_wo);
    if (throughput.x == 0.0f && throughput.y == 0.0f && throughput.z == 0.0f) return;
    const float3 wi = 2.0f * cos_wo * normal - wo;
    const float3 offset = params.flags & CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY ? wi : normal;
    const float3 origin = point_on_ray(surface_position[place].xyz, params.shadow_epsilon, offset);
    next_rank[place] = 0;
    next_slot[place] = slot;
    next_origin_tmin[place] = (float4)(origin, CASTOR_SMALLEST_T);
    next_direction_tmax[place] = (float4)(wi, INFINITY);
    path_throughput[slot] = (float4)(throughput, 0.0f);
    ++ray_counts[slot];
}
