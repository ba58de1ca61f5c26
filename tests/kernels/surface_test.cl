// Position, material and normal of the surface that a ray met.
#include "castor/shared/types.h"
#include "device/surface.cl"

kernel void surface_test(const uint count, CASTOR_SURFACE_PARAMETERS, const global float4 *restrict rays,
                         const global Hit *restrict hits, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hits[i]);
    const Surface surface = surface_of_hit(columns, primitive, hits[i], rays[2 * i].xyz, rays[2 * i + 1].xyz);
    vstore3(surface.position, 0, results + 8 * i);
    results[8 * i + 3] = convert_float(surface.material);
    vstore3(surface.normal, 0, results + 8 * i + 4);
}
