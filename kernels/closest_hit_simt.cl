// One work-item a ray, the compressed tree. Writes the nearest hit, or a miss: t = INFINITY and primitive =
// CASTOR_INVALID_INDEX.
#include "device/traverse_simt.cl"

kernel void closest_hit_simt(CASTOR_SCENE_PARAMETERS, const global float4 *restrict ray_origin_tmin,
                             const global float4 *restrict ray_direction_tmax, global Hit *restrict hits)
{
    const uint i = get_global_id(0);
    if (i >= params.ray_count) return;
    const uint ray = params.first_ray + i;
    const SceneColumns scene = make_scene(CASTOR_SCENE_ARGUMENTS);
    hits[ray] = nearest_simt(scene, load_timed_ray(scene, ray, ray_origin_tmin, ray_direction_tmax), hits + ray);
}
