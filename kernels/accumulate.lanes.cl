// CASTOR_LANES paths a work-item (see lanes.cl). Adds to the film what lights contribute, one after another, unless
// their shadow rays were stopped; where terms are kept, generate_shadow_rays has put it there, and it is taken back
// where a ray was stopped. The rows are those of generate_shadow_rays.
#include "castor/shared/wave_columns.h"
#include "device/film.lanes.cl"
#include "device/queue.lanes.cl"

kernel CASTOR_IN_LANES void LANES(accumulate)(const RenderParams params, const uint light_count, const uint row_length,
                                              const uint first_term, CASTOR_READ(path_slot),
                                              CASTOR_READ(shadow_contribution), CASTOR_READ(occluded),
                                              CASTOR_WRITE(film_sum), CASTOR_WRITE(film_terms))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    for (uint row = 0; row < light_count; ++row) {
        const uint at_place = row * row_length + place;
        const Mask is_stopped = LANES(load_bytes)(occluded + at_place) != 0u;
        if (LANES(keeps_terms)(params)) {
            const Real zero = (Real)(0.0f);
            const LANES(Vectors) nothing = LANES(vectors)(zero, zero, zero);
            const Mask counts = is_path & is_stopped;
            LANES(scatter_vectors)(nothing, slot, counts, film_terms + (first_term + row) * slot_count(params));
        } else {
            const LANES(Vectors) contribution = LANES(load_vectors)(shadow_contribution + at_place);
            const Mask counts = is_path & !is_stopped;
#if CASTOR_HAS_LIGHT_GROUPS
            const Whole group = LANES(convert_uint)(LANES(load_rows)(shadow_contribution + at_place).w);
            LANES(add_to_groups)(params, place, slot, counts, group, contribution, film_terms);
#endif
            if (CASTOR_HAS_SLOT_SUMS)
                LANES(add_to_slots)(params, place, slot, counts, contribution, film_terms);
            else
                LANES(add_to_sums)(params, place, slot, counts, contribution, film_sum);
        }
    }
}
