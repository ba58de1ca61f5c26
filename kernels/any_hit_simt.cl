// One work-item a ray, the compressed tree. Writes 1 where the ray hits anything, else 0.
#include "device/traverse_simt.cl"

kernel void any_hit_simt(CASTOR_SCENE_PARAMETERS, const global float4 *restrict ray_origin_tmin,
                         const global float4 *restrict ray_direction_tmax, global uchar *restrict occluded)
{
    const uint i = get_global_id(0);
    if (i >= params.ray_count) return;
    const uint ray = params.first_ray + i;
    const SceneColumns scene = make_scene(CASTOR_SCENE_ARGUMENTS);
    occluded[ray] =
        (uchar)any_simt(scene, load_timed_ray(scene, ray, ray_origin_tmin, ray_direction_tmax), occluded + ray);
}
