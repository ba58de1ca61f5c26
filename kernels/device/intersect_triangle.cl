// The watertight test of Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1), with exact signs.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"

// a.x * b.y - a.y * b.x to within 2 * 2^-24 of its exact value, and so with its sign: Kahan's algorithm (Jeannerod,
// Louvet, Muller 2013, "Further Analysis of Kahan's Algorithm for the Accurate Computation of 2x2 Determinants"). No
// double precision is needed. Below 2^-102, where the product's error may be denormal, it is to within 2^-149.
CASTOR_INLINE float edge_function(const float3 a, const float3 b)
{
    const float right = a.y * b.x;
    const float error = fma(-a.y, b.x, right);
    return fma(a.x, b.y, -right) + error;
}

// A vertex relative to the ray: translated to its origin and sheared so that the ray becomes the z axis. The same for
// every triangle that has the vertex. z is the vertex's t along the axis.
CASTOR_INLINE float3 shear_vertex(const TraceRay ray, const float3 p)
{
    const float3 r = permute(p - ray.origin, ray.axis, ray.mirrored);
    return (float3)(fma(-ray.shear.x, r.z, r.x), fma(-ray.shear.y, r.z, r.y), ray.shear.z * r.z);
}

// How near the hit is to the triangle. Let e = 2^-24 and R be the sum of the largest coordinates of scene and origin,
// and look at one axis at a time. Let Y be the point of the triangle with the weights u, v, w as computed, divided by
// their exact sum: none is negative, so Y lies in the triangle, exactly.
// - A vertex is sheared to within 6eR: translation eR, twice, the shear 2eR, the last rounding 2eR. With exact edge
// functions of these vertices u a + v b + w c = 0 across
//   the ray; computed ones are within 2e of them, so that Y lies within 4eR + 6eR of the ray in the plane across its
//   longest axis, at Y's own place along this axis. Determinants below FLT_MIN are no hits, so that errors of 2^-149
//   make no more than 12eR of it, even so.
// - t is a sum of the vertices' places along this axis (3e each) with weights to within 4e, rounded three times: within
// 10eR of Y's own. So the ray's point at t is within 32eR of Y on each axis, and CASTOR_BOX_PADDING lets it enter every
// box that holds Y no later than at t, and leave it no earlier. Any tree whose leaves hold the triangle wherever it is
// finds the hit: also one that keeps pieces of it in several leaves, each in a box of its own.

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
    const float3 upper =
        (float3)(larger(p0.x, larger(p1.x, p2.x)), larger(p0.y, larger(p1.y, p2.y)), larger(p0.z, larger(p1.z, p2.z)));
    return within_own_box(ray, lower, upper, candidate);
}
