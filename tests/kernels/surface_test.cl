// Position, material and normal of the surface that a ray met.
#include "castor/shared/types.h"
#include "device/surface_of_hit.cl"

kernel void surface_test(const uint count, CASTOR_SURFACE_PARAMETERS, const global float4 *restrict rays,
                         const global Hit *restrict hits, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hits[i]);
    const Surfaces surface = surface_of_hit(columns, primitive, hits[i], rays[2 * i].xyz, rays[2 * i + 1].xyz);
    global float4 *result = (global float4 *)results + 2 * i;
    store_rows(surface.position.x, surface.position.y, surface.position.z, convert_float(surface.material), result);
    store_rows(surface.normal.x, surface.normal.y, surface.normal.z, 0.0f, result + 1);
}
