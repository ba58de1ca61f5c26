// Position, material and normal of the surface that a ray met.
#include "castor/shared/types.h"
#include "device/surface.cl"

kernel void surface_test(const uint count, const global TraceParams *restrict params, CASTOR_SURFACE_PARAMETERS,
                         const global float4 *restrict rays, const global Hit *restrict hits,
                         global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const uint primitive = primitive_of_hit(params[0], hits[i], CASTOR_SURFACE_ARGUMENTS);
    const Surface surface =
        surface_of_hit(params[0], primitive, hits[i], rays[2 * i].xyz, rays[2 * i + 1].xyz, CASTOR_SURFACE_ARGUMENTS);
    vstore3(surface.position, 0, results + 8 * i);
    results[8 * i + 3] = convert_float(surface.material);
    vstore3(surface.normal, 0, results + 8 * i + 4);
}
