// One work-item a path. Writes the surface that its ray met, if the chunk has it; material CASTOR_INVALID_INDEX: the
// ray met nothing.
#include "castor/shared/wave_columns.h"
#include "device/surface.cl"

kernel void find_surface(const uint path_count, CASTOR_SURFACE_PARAMETERS, CASTOR_READ(ray_origin_tmin),
                         CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_WRITE(surface_position),
                         CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) {
        surface_material[place] = CASTOR_INVALID_INDEX;
        return;
    }
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const Surface surface =
        surface_of_hit(columns, primitive, hit, ray_origin_tmin[place].xyz, ray_direction_tmax[place].xyz);
    surface_position[place] = (float4)(surface.position, 0.0f);
    surface_normal[place] = (float4)(surface.normal, 0.0f);
    surface_material[place] = surface.material;
}
