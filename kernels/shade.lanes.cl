// CASTOR_LANES paths a work-item (see lanes.cl). Adds to the film what the surfaces that their rays met (material
// CASTOR_INVALID_INDEX: none) send without a light ray: the ambient term, or at `depth` 0 the background.
#include "castor/shared/wave_columns.h"
#include "device/film.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/shading.lanes.cl"

kernel CASTOR_IN_LANES void LANES(shade)(const RenderParams params, const uint depth,
                                         const global Material *restrict materials, CASTOR_READ(path_slot),
                                         CASTOR_READ(ray_direction_tmax), CASTOR_READ(surface_material),
                                         CASTOR_READ(path_throughput), CASTOR_WRITE(path_terms), CASTOR_WRITE(film_sum),
                                         CASTOR_WRITE(film_terms), CASTOR_WRITE(surface_wo))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Mask counts = depth > 0 ? is_met : is_path;
    LANES(Vectors) sent = LANES(same_vectors)(params.background);
    if (LANES(mask_of)(is_met)) {
        const LANES(Materials) material = LANES(load_materials)(materials, is_met ? material_number : (Whole)(0));
        const LANES(Vectors) ambient = LANES(product_of_vectors)(material.ambient, LANES(same_vectors)(params.ambient));
        sent = LANES(choose_vectors)(
            is_met, LANES(product_of_vectors)(LANES(throughputs)(params, path_throughput, slot), ambient), sent);
        const LANES(Vectors) direction = LANES(normalized_vectors)(LANES(load_vectors)(ray_direction_tmax + place));
        LANES(store_vectors)(LANES(scaled_vectors)(direction, (Real)(-1.0f)), surface_wo + place);
    }
    const uint terms_of_bounce = 1 + params.light_count;
    if (params.sample_shift > 0) {
        const Whole terms = (Whole)(depth * terms_of_bounce) + (is_met ? (Whole)(terms_of_bounce) : (Whole)(1));
        if (params.flags & CASTOR_RENDER_FIRST_BOUNCE)
            LANES(store_whole_column)(terms, path_terms + place);
        else
            LANES(scatter_wholes)(terms, slot, counts, path_terms);
    }
    LANES(add_terms)(params, place, slot, counts, depth * terms_of_bounce, sent, film_sum, film_terms);
}
