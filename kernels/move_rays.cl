// One work-item a path. Writes the origins of rays as they are seen from what the rays met, as if that rested where it
// is at time 0.
#include "castor/shared/wave_columns.h"
#include "device/motion.cl"

kernel void move_rays(const RenderParams params, const global Instance *restrict instances, CASTOR_READ(ray_time),
                      CASTOR_READ(hits), CASTOR_READ(ray_origin_tmin), CASTOR_WRITE(rest_origin_tmin))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    const float4 origin_tmin = ray_origin_tmin[place];
    const Hit hit = hits[place];
    const float3 moved = hit.primitive == CASTOR_INVALID_INDEX
                             ? origin_tmin.xyz
                             : moved_point(origin_tmin.xyz, -ray_time[place], instances + hit.instance);
    rest_origin_tmin[place] = (float4)(moved, origin_tmin.w);
}
