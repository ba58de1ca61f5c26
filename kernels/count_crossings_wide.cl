// One work-item a batch of CASTOR_WIDE_BATCH rays, the wide tree. Writes how many crossings each ray has.
#include "device/cross_wide.cl"

kernel CASTOR_IN_VECTORS void count_crossings_wide(CASTOR_SCENE_PARAMETERS,
                                                   const global float4 *restrict ray_origin_tmin,
                                                   const global float4 *restrict ray_direction_tmax,
                                                   global uint *restrict crossing_counts)
{
    const uint first = get_global_id(0) * CASTOR_WIDE_BATCH;
    if (first >= params.ray_count) return;
    const uint count = min(CASTOR_WIDE_BATCH, params.ray_count - first);
    const uint begin = params.first_ray + first;
    cross_batch(make_scene(CASTOR_SCENE_ARGUMENTS), begin, begin + count, 0, ray_origin_tmin, ray_direction_tmax, 0,
                crossing_counts);
}
