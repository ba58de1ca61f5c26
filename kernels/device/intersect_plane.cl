// Ray and infinite plane: t = n.(p - o) / n.d. A parallel ray misses, also one that lies in the plane.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"
#include "device/vector.cl"

CASTOR_INLINE Candidate intersect_plane(const TraceRay ray, const float3 point, const float3 normal)
{
    Candidate candidate = no_candidate();
    const float along = dot_product(normal, ray_direction(ray));
    if (along == 0.0f) return candidate;
    const float t = divide(dot_product(normal, point - ray_origin(ray)), along);
    if (t >= ray.t_min && t <= ray.t_max) candidate.t = t;
    return candidate;
}
