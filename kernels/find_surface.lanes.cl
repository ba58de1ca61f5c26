// CASTOR_LANES paths a work-item (see lanes.cl). Writes the surfaces that their rays met, if the chunk has them;
// material CASTOR_INVALID_INDEX: the ray met nothing.
#include "device/find_surfaces.lanes.cl"

kernel CASTOR_IN_LANES void LANES(find_surface)(const uint path_count, CASTOR_SURFACE_PARAMETERS,
                                                CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax),
                                                CASTOR_READ(hits), CASTOR_WRITE(surface_position),
                                                CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material))
{
    const uint first = get_global_id(0) * CASTOR_LANES;
    if (first >= path_count) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    LANES(find_surfaces)
    (columns, first, path_count, ray_origin_tmin, ray_direction_tmax, hits, surface_position, surface_normal,
     surface_material);
}
