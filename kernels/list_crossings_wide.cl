// One work-item a batch of CASTOR_WIDE_BATCH rays, the wide tree. Writes the first `limit` crossings of each ray, in
// the order of (t, instance, primitive), then misses; and how many crossings there are in all.
#include "device/cross_wide.cl"

kernel CASTOR_IN_VECTORS void list_crossings_wide(const uint limit, CASTOR_SCENE_PARAMETERS,
                                                  const global float4 *restrict ray_origin_tmin,
                                                  const global float4 *restrict ray_direction_tmax,
                                                  global Hit *restrict crossings, global uint *restrict crossing_counts)
{
    const uint first = get_global_id(0) * CASTOR_WIDE_BATCH;
    if (first >= params.ray_count) return;
    const uint count = min(CASTOR_WIDE_BATCH, params.ray_count - first);
    const uint begin = params.first_ray + first;
    cross_batch(make_scene(CASTOR_SCENE_ARGUMENTS), begin, begin + count, limit, ray_origin_tmin, ray_direction_tmax,
                crossings, crossing_counts);
}
