// The watertight test of Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1), with exact signs.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"

// a.x * b.y - a.y * b.x with the sign of the exact value. Rounding is monotone, so unequal rounded products have the right
// order; of equal ones the rounding errors decide, which fma gives exactly. No double precision is needed.
CASTOR_INLINE float edge_function(const float3 a, const float3 b)
{
    const float left = a.x * b.y;
    const float right = a.y * b.x;
    const float difference = left - right;
    if (difference != 0.0f) return difference;
    return fma(a.x, b.y, -left) - fma(a.y, b.x, -right);
}

// A vertex relative to the ray: translated to its origin and sheared so that the ray becomes the z axis. The same for every triangle
// that has the vertex. z is the vertex's t along the axis.
CASTOR_INLINE float3 shear_vertex(const TraceRay ray, const float3 p)
{
    const float3 r = permute(p - ray.origin, ray.axis, ray.mirrored);
    return (float3)(fma(-ray.shear.x, r.z, r.x), fma(-ray.shear.y, r.z, r.y), ray.shear.z * r.z);
}

// The ray's line against a triangle: t in any range, u and v the weights of p1 and p2. Points on edges and vertices are
// inside; a triangle seen edge-on, or without area, is missed.
CASTOR_INLINE Candidate intersect_triangle_line(const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    const float3 a = shear_vertex(ray, p0);
    const float3 b = shear_vertex(ray, p1);
    const float3 c = shear_vertex(ray, p2);
    const float u = edge_function(c, b);
    const float v = edge_function(a, c);
    const float w = edge_function(b, a);

    const int any_negative = u < 0.0f || v < 0.0f || w < 0.0f;
    const int any_positive = u > 0.0f || v > 0.0f || w > 0.0f;
    if (any_negative && any_positive) return no_candidate();
    const float determinant = u + v + w;
    // Denormal: seen edge-on, or smaller than some 1e-19, where products underflow and weights would be noise.
    if (fabs(determinant) < FLT_MIN) return no_candidate();

    const float r = divide(1.0f, determinant);
    Candidate candidate;
    candidate.u = v * r;
    candidate.v = w * r;
    candidate.t = fma(u * r, a.z, fma(candidate.u, b.z, candidate.v * c.z));
    candidate.from_behind = determinant < 0.0f;
    return candidate;
}

CASTOR_INLINE Candidate intersect_triangle(const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    const Candidate candidate = intersect_triangle_line(ray, p0, p1, p2);
    if (!(candidate.t == candidate.t)) return candidate;
    const float3 lower = (float3)(smaller(p0.x, smaller(p1.x, p2.x)), smaller(p0.y, smaller(p1.y, p2.y)),
                                  smaller(p0.z, smaller(p1.z, p2.z)));
    const float3 upper = (float3)(larger(p0.x, larger(p1.x, p2.x)), larger(p0.y, larger(p1.y, p2.y)),
                                  larger(p0.z, larger(p1.z, p2.z)));
    return within_own_box(ray, lower, upper, candidate);
}
