// One work-item a ray. Lets rays that passed a surface begin beyond it, and ends all others: what stopped them
// occludes.
#include "castor/shared/wave_columns.h"

kernel void go_on_beyond(const uint path_count, CASTOR_READ(hits), CASTOR_READ(passed), CASTOR_WRITE(ray_origin_tmin),
                         CASTOR_WRITE(ray_direction_tmax), CASTOR_WRITE(occluded))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    if (passed[place] == CASTOR_STOPPED) occluded[place] = 1;
    if (passed[place] == CASTOR_PASSED) {
        ray_origin_tmin[place].w = as_float(as_uint(hits[place].t) + 1u);  // the next float: t is not negative
    } else {
        ray_origin_tmin[place].w = 1.0f;
        ray_direction_tmax[place].w = 0.0f;
    }
}
