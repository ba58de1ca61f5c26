// One work-item a path. Adds to the film what a light contributes, unless its shadow ray was stopped.
#include "castor/shared/wave_columns.h"
#include "device/film.cl"

kernel void accumulate(const RenderParams params, const uint term, CASTOR_READ(path_slot),
                       CASTOR_READ(shadow_contribution), CASTOR_READ(occluded), CASTOR_WRITE(film_sum),
                       CASTOR_WRITE(film_terms))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    // A term that is kept apart is written in any case.
    if (occluded[place] && !(params.flags & CASTOR_RENDER_KEEPS_TERMS)) return;
    const float4 contribution = occluded[place] ? (float4)(0.0f) : shadow_contribution[place];
    add_term(params, path_slot[place], term, contribution, film_sum, film_terms);
}
