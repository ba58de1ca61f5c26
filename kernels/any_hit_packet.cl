// One work-item a batch of CASTOR_WIDE_BATCH rays, the wide tree, in bundles of coherent rays. Writes 1 where a ray
// hits anything, else 0.
#include "device/traverse_packet.cl"

kernel CASTOR_IN_VECTORS void any_hit_packet(CASTOR_SCENE_PARAMETERS, const global float4 *restrict ray_origin_tmin,
                                             const global float4 *restrict ray_direction_tmax,
                                             global uchar *restrict occluded)
{
    const uint first = get_global_id(0) * CASTOR_WIDE_BATCH;
    if (first >= params.ray_count) return;
    const uint count = min(CASTOR_WIDE_BATCH, params.ray_count - first);
    const uint begin = params.first_ray + first;
    trace_bundles(make_scene(CASTOR_SCENE_ARGUMENTS), begin, begin + count, 1, ray_origin_tmin, ray_direction_tmax, 0,
                  occluded);
}
