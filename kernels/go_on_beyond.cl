// One work-item a ray. Lets rays that passed a surface begin beyond it, and ends all others, once: what stopped them
// occludes. `is_last`: rays can pass no more, so that a surface which they would pass stops them.
#include "castor/shared/wave_columns.h"

kernel void go_on_beyond(const uint path_count, const uint is_last, CASTOR_READ(hits), CASTOR_WRITE(passed),
                         CASTOR_WRITE(ray_origin_tmin), CASTOR_WRITE(ray_direction_tmax), CASTOR_WRITE(occluded))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const uchar state = passed[place];
    if (state == CASTOR_ENDED) return;
    if (state == CASTOR_PASSED && !is_last) {
        ray_origin_tmin[place].w = as_float(as_uint(hits[place].t) + 1u);  // the next float: t is not negative
        return;
    }
    if (state != 0) occluded[place] = 1;
    passed[place] = CASTOR_ENDED;
    ray_origin_tmin[place].w = 1.0f;
    ray_direction_tmax[place].w = 0.0f;
}
