// The slab test of one ray and one box.
#include "castor/shared/layout.h"
#include "device/intersect_box.x1.cl"
#include "device/ray.cl"

CASTOR_INLINE BoxPlanes planes_of_box(const TraceRay ray, const float3 lower, const float3 upper)
{
    return box_planes(slabs_of(ray), lower.x, lower.y, lower.z, upper.x, upper.y, upper.z);
}

// Returns (entry, exit) of the ray's line through the slightly enlarged box; entry > exit: passes by. It is slab_test
// with the three axes in one vector: on a CPU, brute force over spheres is a third slower with slab_test for one lane.
CASTOR_INLINE float2 box_interval(const TraceRay ray, const float3 lower, const float3 upper)
{
    const float3 inverse = (float3)(ray.inverse_x, ray.inverse_y, ray.inverse_z);
    const float3 near_plane = inverse < 0.0f ? upper : lower;
    const float3 far_plane = inverse < 0.0f ? lower : upper;
    const float3 entry = fma(near_plane, inverse, (float3)(ray.entry_x, ray.entry_y, ray.entry_z));
    const float3 exit = fma(far_plane, inverse, (float3)(ray.exit_x, ray.exit_y, ray.exit_z));
    return (float2)(larger(entry.x, larger(entry.y, entry.z)), smaller(exit.x, smaller(exit.y, exit.z)));
}
