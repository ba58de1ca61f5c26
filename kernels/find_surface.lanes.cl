// CASTOR_LANES paths a work-item (see lanes.cl). Writes the surfaces that their rays met, if the chunk has them;
// material CASTOR_INVALID_INDEX: the ray met nothing.
#include "castor/shared/wave_columns.h"
#include "device/hits.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/surface.lanes.cl"
#include "device/surface_of_hit.cl"

kernel CASTOR_IN_LANES void LANES(find_surface)(const uint path_count, CASTOR_SURFACE_PARAMETERS,
                                                CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax),
                                                CASTOR_READ(hits), CASTOR_WRITE(surface_position),
                                                CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material))
{
    const uint first = get_global_id(0) * CASTOR_LANES;
    if (first >= path_count) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
#if CASTOR_LANES > 1
    const Mask is_path = LANES(is_place)(first, path_count);
    const LANES(Hits) hit = LANES(load_hits)(hits + first);
    const Mask is_hit = is_path & (hit.primitive != CASTOR_INVALID_INDEX);
    const Geometry in_place = columns.geometries[0];
    if (columns.params.number_count == 0 && !LANES(mask_of)(is_hit & (hit.instance != 0u))) {
        const Whole primitive = LANES(primitives_in_place)(columns, in_place, hit.primitive);
        const LANES(Surfaces) surface = LANES(surfaces_in_place)(columns, is_hit, primitive, hit.t, hit.u, hit.v,
                                                                 LANES(load_vectors)(ray_origin_tmin + first),
                                                                 LANES(load_vectors)(ray_direction_tmax + first));
        LANES(store_vectors)(surface.position, surface_position + first);
        LANES(store_vectors)(surface.normal, surface_normal + first);
        LANES(store_whole_column)(is_hit ? surface.material : (Whole)(CASTOR_INVALID_INDEX), surface_material + first);
        return;
    }
#endif
    // Hits of instances and in chunks differ too much to be found side by side.
    for (uint place = first; place < min(first + CASTOR_LANES, path_count); ++place) {
        const Hit hit = hits[place];
        if (hit.primitive == CASTOR_INVALID_INDEX) {
            surface_material[place] = CASTOR_INVALID_INDEX;
            continue;
        }
        const uint primitive = primitive_of_hit(columns, hit);
        if (primitive == CASTOR_INVALID_INDEX) continue;
        const Surfaces surface =
            surface_of_hit(columns, primitive, hit, ray_origin_tmin[place].xyz, ray_direction_tmax[place].xyz);
        store_vectors(surface.position, surface_position + place);
        store_vectors(surface.normal, surface_normal + place);
        surface_material[place] = surface.material;
    }
}
