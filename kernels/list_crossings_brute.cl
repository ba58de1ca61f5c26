// One work-item a ray, every primitive. Writes the first `limit` crossings of each ray, in the order of (t, instance,
// primitive), then misses; and how many crossings there are in all.
#include "device/cross_brute.cl"

kernel void list_crossings_brute(const uint limit, CASTOR_SCENE_PARAMETERS,
                                 const global float4 *restrict ray_origin_tmin,
                                 const global float4 *restrict ray_direction_tmax, global Hit *restrict crossings,
                                 global uint *restrict crossing_counts)
{
    const uint i = get_global_id(0);
    if (i >= params.ray_count) return;
    const uint ray = params.first_ray + i;
    const SceneColumns scene = make_scene(CASTOR_SCENE_ARGUMENTS);
    const TraceRay trace_ray = load_ray(params, ray, ray_origin_tmin, ray_direction_tmax);
    Crossings found = begin_crossings(scene, trace_ray, limit, crossings + (size_t)ray * limit, crossing_counts + ray);
    cross_brute(&found, scene, trace_ray);
    finish_list(&found, scene);
    crossing_counts[ray] = found.count;
}
