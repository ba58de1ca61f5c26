// One work-item a path. Writes the texture coordinates of what its ray met, if the chunk has it.
#include "castor/shared/wave_columns.h"
#include "device/textured_point.cl"

kernel void find_uvs(const uint path_count, CASTOR_SURFACE_PARAMETERS, const global float *restrict vertex_uv,
                     CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits),
                     CASTOR_WRITE(surface_uv))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const TexturedPoint point = textured_point(columns, vertex_uv, primitive, hit, ray_origin_tmin[place].xyz,
                                               ray_direction_tmax[place].xyz, 0);
    surface_uv[place] = point.uv;
}
