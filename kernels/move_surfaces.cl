// One work-item a path. Moves the points that were found with the rays of move_rays to where they are at their rays'
// times.
#include "castor/shared/wave_columns.h"
#include "device/motion.cl"

kernel void move_surfaces(const RenderParams params, const global Instance *restrict instances, CASTOR_READ(ray_time),
                          CASTOR_READ(hits), CASTOR_WRITE(surface_position))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) return;
    const float4 position = surface_position[place];
    surface_position[place] =
        (float4)(moved_point(position.xyz, ray_time[place], instances + hit.instance), position.w);
}
