// One work-item a ray. Lets rays that passed a surface begin beyond it. Of others it tells what becomes of them: what
// stopped a shadow ray occludes; other rays have the hit that they met last.
//
// inside_hits: what the rays met, ray by ray. has_places: the rays are those at passing_places; else all, and what they
// met stands in hits already. is_last: rays can pass no more, so that a surface which they would pass stops them.
#include "castor/shared/wave_columns.h"

kernel void go_on_beyond(const uint count, const uint has_places, const uint are_shadow_rays, const uint is_last,
                         CASTOR_READ(passing_places), CASTOR_READ(inside_hits), CASTOR_READ(passed),
                         CASTOR_WRITE(ray_origin_tmin), CASTOR_WRITE(hits), CASTOR_WRITE(occluded))
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const uint place = has_places ? passing_places[i] : i;
    const uchar state = passed[i];
    if (state == CASTOR_PASSED && !is_last)
        ray_origin_tmin[place].w = as_float(as_uint(inside_hits[i].t) + CASTOR_FLOATS_BEYOND);  // t is not negative
    else if (are_shadow_rays && state != 0)
        occluded[place] = 1;
    if (has_places && !are_shadow_rays) hits[place] = inside_hits[i];
}
