// The slab test of every box, of nodes and of primitives alike. It is monotone: rounding is, and the near plane of a
// box around another lies no later, its far plane no earlier, exactly. So a node's interval contains those of all it
// holds.
#include "castor/shared/layout.h"
#include "device/ray.cl"

// (entry, exit) of the ray's line through the slightly enlarged box; entry > exit: passes by.
CASTOR_INLINE float2 box_interval(const TraceRay ray, const float3 lower, const float3 upper)
{
    const float3 near_plane =
        (float3)(ray.inverse.x < 0.0f ? upper.x : lower.x, ray.inverse.y < 0.0f ? upper.y : lower.y,
                 ray.inverse.z < 0.0f ? upper.z : lower.z);
    const float3 far_plane =
        (float3)(ray.inverse.x < 0.0f ? lower.x : upper.x, ray.inverse.y < 0.0f ? lower.y : upper.y,
                 ray.inverse.z < 0.0f ? lower.z : upper.z);
    const float3 entry = fma(near_plane, ray.inverse, ray.entry_offset);
    const float3 exit = fma(far_plane, ray.inverse, ray.exit_offset);
    return (float2)(larger(entry.x, larger(entry.y, entry.z)), smaller(exit.x, smaller(exit.y, exit.z)));
}
