// One work-item a ray. Puts the rays at passing_places side by side, with the slots and times of their paths.
#include "castor/shared/wave_columns.h"

kernel void gather_passing_rays(const RenderParams params, const uint count, const uint has_times,
                                CASTOR_READ(passing_places), CASTOR_READ(path_slot), CASTOR_READ(ray_time),
                                CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax),
                                CASTOR_WRITE(passing_slot), CASTOR_WRITE(passing_time),
                                CASTOR_WRITE(passing_origin_tmin), CASTOR_WRITE(passing_direction_tmax))
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const uint place = passing_places[i];
    passing_slot[i] = params.flags & CASTOR_RENDER_FIRST_BOUNCE ? place : path_slot[place];
    if (has_times) passing_time[i] = ray_time[place];
    passing_origin_tmin[i] = ray_origin_tmin[place];
    passing_direction_tmax[i] = ray_direction_tmax[place];
}
