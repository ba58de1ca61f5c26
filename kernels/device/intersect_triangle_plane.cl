// The lecture's first triangle test: where the ray meets the triangle's plane, then whether that point lies on the
// inner side of all three edges. Plain, but rays can slip between neighbours: rendering uses intersect_triangle.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"
#include "device/vector.cl"

// Whether p, in the triangle's plane, lies on the same side of the edge as the opposite vertex. The edge itself counts.
CASTOR_INLINE int is_on_inner_side(const float3 p, const float3 start, const float3 end, const float3 opposite)
{
    const float3 edge = end - start;
    return dot_product(cross_product(edge, p - start), cross_product(edge, opposite - start)) >= 0.0f;
}

// Twice the area.
CASTOR_INLINE float parallelogram_area(const float3 a, const float3 b, const float3 c)
{
    return vector_length(cross_product(b - a, c - a));
}

// t in any range; u and v are the weights of p1 and p2. Edges count as inside; a triangle seen edge-on is missed.
CASTOR_INLINE Candidate intersect_triangle_plane(const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    const float3 normal = cross_product(p1 - p0, p2 - p0);
    const float along = dot_product(normal, ray_direction(ray));
    if (along == 0.0f) return no_candidate();
    const float t = divide(dot_product(normal, p0 - ray_origin(ray)), along);
    const float3 p = point_on_ray(ray_origin(ray), t, ray_direction(ray));
    if (!is_on_inner_side(p, p0, p1, p2) || !is_on_inner_side(p, p1, p2, p0) || !is_on_inner_side(p, p2, p0, p1))
        return no_candidate();

    const float area = vector_length(normal);
    Candidate candidate;
    candidate.t = t;
    candidate.u = divide(parallelogram_area(p, p2, p0), area);
    candidate.v = divide(parallelogram_area(p, p0, p1), area);
    candidate.from_behind = along > 0.0f;
    return candidate;
}
