// One work-item a ray, the compressed tree. Writes how many crossings each ray has.
#include "device/cross_simt.cl"

kernel void count_crossings_simt(CASTOR_SCENE_PARAMETERS, const global float4 *restrict ray_origin_tmin,
                                 const global float4 *restrict ray_direction_tmax,
                                 global uint *restrict crossing_counts)
{
    const uint i = get_global_id(0);
    if (i >= params.ray_count) return;
    const uint ray = params.first_ray + i;
    const SceneColumns scene = make_scene(CASTOR_SCENE_ARGUMENTS);
    const TraceRay trace_ray = load_ray(params, ray, ray_origin_tmin, ray_direction_tmax);
    Crossings found = begin_crossings(scene, trace_ray, 0, 0, crossing_counts + ray);
    cross_simt(&found, scene, trace_ray);
    crossing_counts[ray] = found.count;
}
