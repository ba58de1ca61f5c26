// One work-item a ray, the wide tree. Writes 1 where the ray hits anything, else 0.
#include "device/traverse_wide.cl"

kernel void any_hit_wide(const TraceParams params, CASTOR_SCENE_PARAMETERS,
                          const global float4 *restrict ray_origin_tmin,
                          const global float4 *restrict ray_direction_tmax, global uchar *restrict occluded)
{
    const uint i = get_global_id(0);
    if (i >= params.ray_count) return;
    const uint ray = params.first_ray + i;
    occluded[ray] = (uchar)any_wide(make_scene(params, CASTOR_SCENE_ARGUMENTS),
                                  load_ray(params, ray, ray_origin_tmin, ray_direction_tmax));
}
