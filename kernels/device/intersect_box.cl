// The slab test of one ray and one box.
#include "castor/shared/layout.h"
#include "device/intersect_box.x1.cl"
#include "device/ray.cl"

CASTOR_INLINE BoxPlanes planes_of_box(const TraceRay ray, const float3 lower, const float3 upper)
{
    return box_planes(slabs_of(ray), lower.x, lower.y, lower.z, upper.x, upper.y, upper.z);
}

// Returns (entry, exit) of the ray's line through the slightly enlarged box; entry > exit: passes by.
CASTOR_INLINE float2 box_interval(const TraceRay ray, const float3 lower, const float3 upper)
{
    const Interval interval = slab_test(slabs_of(ray), planes_of_box(ray, lower, upper), -INFINITY, INFINITY);
    return (float2)(interval.entry, interval.exit);
}
