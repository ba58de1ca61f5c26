// One work-item a ray. Puts the rays that passed a surface side by side, to begin beyond it, with the slots and times
// of their paths; which comes first shows in no result. Of others it tells what becomes of them: what stopped a shadow
// ray occludes; other rays have the hit that they met last.
//
// inside_hits: what the rays met, ray by ray. has_places: the rays are those at passing_places; else all, and what they
// met stands in hits already. are_scattered: those that pass have rays of their own, which begin where they were
// scattered, and the hits of the others are known (scatter_within). is_last: rays can pass no more, so that a surface
// which they would pass stops them. passing_counts: element `turn` counts the rays that passed; it is 0 before, and the
// other one after, for the next turn.
#include "castor/shared/wave_columns.h"

kernel void go_on_beyond(const RenderParams params, const uint count, const uint has_places, const uint are_shadow_rays,
                         const uint are_scattered, const uint is_last, const uint has_times, const uint turn,
                         CASTOR_READ(passing_places), CASTOR_READ(inside_hits), CASTOR_READ(passed),
                         CASTOR_READ(path_slot), CASTOR_READ(ray_time), CASTOR_READ(ray_origin_tmin),
                         CASTOR_READ(ray_direction_tmax), CASTOR_WRITE(hits), CASTOR_WRITE(occluded),
                         CASTOR_WRITE(passing_counts), CASTOR_WRITE(next_passing_places), CASTOR_WRITE(passing_slot),
                         CASTOR_WRITE(passing_time), CASTOR_WRITE(passing_origin_tmin),
                         CASTOR_WRITE(passing_direction_tmax))
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    if (i == 0) passing_counts[1u - turn] = 0;
    const uint place = has_places ? passing_places[i] : i;
    const uchar state = passed[i];
    if (has_places && !are_shadow_rays && !are_scattered) hits[place] = inside_hits[i];
    const int passes = state == CASTOR_PASSED;
    const uint next = passes ? atomic_inc(passing_counts + turn) : 0;
    if (!passes || is_last) {
        if (are_shadow_rays && state != 0) occluded[place] = 1;
        return;
    }
    float4 origin_tmin = ray_origin_tmin[place];
    if (!are_scattered)
        origin_tmin.w = as_float(as_uint(inside_hits[i].t) + CASTOR_FLOATS_BEYOND);  // t is not negative
    next_passing_places[next] = place;
    passing_slot[next] = params.flags & CASTOR_RENDER_FIRST_BOUNCE ? place : path_slot[place];
    if (has_times) passing_time[next] = ray_time[place];
    passing_origin_tmin[next] = origin_tmin;
    passing_direction_tmax[next] = ray_direction_tmax[place];
}
