// One work-item a path. Writes the texture coordinates of what its ray met, if the chunk has it.
#define CASTOR_SURFACES_HAVE_UVS 1
#include "castor/shared/wave_columns.h"
#include "device/sphere_coordinates.x1.cl"
#include "device/surface_of_hit.cl"

kernel void find_uvs(const uint path_count, CASTOR_SURFACE_PARAMETERS, const global float *restrict vertex_uv,
                     CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits),
                     CASTOR_WRITE(surface_uv))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) return;
    SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    columns.vertex_uv = vertex_uv;
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    Surfaces surface =
        surface_in_object(columns, primitive, hit, ray_origin_tmin[place].xyz, ray_direction_tmax[place].xyz);
    add_coordinates_of_spheres(&surface, columns, 1, primitive);
    surface_uv[place] = (float2)(surface.uv.x, surface.uv.y);
}
