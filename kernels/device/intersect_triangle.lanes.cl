// The watertight test of Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1), with exact signs:
// rays and triangles paired lane by lane, for CASTOR_LANES lanes (see lanes.cl).
//
// How near a hit is to its triangle: let e = 2^-24 and R be the sum of the largest coordinates of scene and origin, and
// look at one axis at a time. Let Y be the point of the triangle with the weights u, v, w as computed, divided by their
// exact sum: none is negative, so Y lies in the triangle, exactly.
// - A vertex is sheared to within 6eR: translation eR, twice, the shear 2eR, the last rounding 2eR. With exact edge
//   functions of these vertices u a + v b + w c = 0 across the ray; computed ones are within 2e of them, so that Y lies
//   within 4eR + 6eR of the ray in the plane across its longest axis, at Y's own place along this axis. Determinants
//   below FLT_MIN are no hits, so that errors of 2^-149 make this at most 12eR.
// - t is a sum of the vertices' places along this axis (3e each) with weights to within 4e, rounded three times: within
//   10eR of Y's own.
// So the ray's point at t is within 32eR of Y on each axis, and CASTOR_BOX_PADDING lets it enter every box that holds Y
// no later than at t, and leave it no earlier. Any tree whose leaves hold the triangle wherever it is finds the hit:
// also one that keeps pieces of the triangle in several leaves, each in a box of its own.
#include "device/intersect_primitive.lanes.cl"

// The shear of rays: see TraceRay.
typedef struct LANES(Shear) {
    Real x, y, z;
} LANES(Shear);

// The vertices a, b and c of triangles, relative to the rays' origins, along the rays' axes kx, ky and kz.
typedef struct LANES(RelativeTriangle) {
    Real ax, ay, az;
    Real bx, by, bz;
    Real cx, cy, cz;
} LANES(RelativeTriangle);

// The weights of the vertices a, b and c where the rays' lines meet the triangles, times their sum, the determinant.
typedef struct LANES(TriangleWeights) {
    Mask inside;
    Real u, v, w;
    Real determinant;
} LANES(TriangleWeights);

// Returns ax * by - ay * bx to within 2 * 2^-24 of its exact value, and so with its sign: Kahan's algorithm (Jeannerod,
// Louvet, Muller 2013, "Further Analysis of Kahan's Algorithm for the Accurate Computation of 2x2 Determinants"). No
// double precision is needed. Below 2^-102, where the product's error may be denormal, it is to within 2^-149.
CASTOR_INLINE Real LANES(edge_function)(const Real ax, const Real ay, const Real bx, const Real by)
{
    const Real right = ay * bx;
    const Real error = fma(-ay, bx, right);
    return fma(ax, by, -right) + error;
}

CASTOR_INLINE Mask LANES(signs_agree)(const Real u, const Real v, const Real w)
{
    return (LANES(smaller)(u, LANES(smaller)(v, w)) >= 0.0f) | (LANES(larger)(u, LANES(larger)(v, w)) <= 0.0f);
}

// Shears triangles so that their rays become the z axis; z stays as it is. Triangles that share a vertex get the same
// values for it.
CASTOR_INLINE LANES(RelativeTriangle)
    LANES(shear_triangle)(const LANES(Shear) shear, const LANES(RelativeTriangle) triangle)
{
    LANES(RelativeTriangle) sheared = triangle;
    sheared.ax = fma(-shear.x, triangle.az, triangle.ax);
    sheared.ay = fma(-shear.y, triangle.az, triangle.ay);
    sheared.bx = fma(-shear.x, triangle.bz, triangle.bx);
    sheared.by = fma(-shear.y, triangle.bz, triangle.by);
    sheared.cx = fma(-shear.x, triangle.cz, triangle.cx);
    sheared.cy = fma(-shear.y, triangle.cz, triangle.cy);
    return sheared;
}

// Returns which sheared triangles may be hit, before triangle_weights decides exactly. Rounding is monotone, so the
// signs of these edge functions are right, or they are zero, which counts as inside on both sides. NaN (an unused lane)
// is outside.
CASTOR_INLINE Mask LANES(may_hit_triangle)(const LANES(RelativeTriangle) sheared)
{
    return LANES(signs_agree)(sheared.cx * sheared.by - sheared.cy * sheared.bx,
                              sheared.ax * sheared.cy - sheared.ay * sheared.cx,
                              sheared.bx * sheared.ay - sheared.by * sheared.ax);
}

// Finds where the rays' lines meet the sheared triangles. Points on edges and vertices are inside; a triangle seen
// edge-on, or without area, is missed.
CASTOR_INLINE LANES(TriangleWeights) LANES(triangle_weights)(const LANES(RelativeTriangle) sheared)
{
    LANES(TriangleWeights) weights;
    weights.u = LANES(edge_function)(sheared.cx, sheared.cy, sheared.bx, sheared.by);
    weights.v = LANES(edge_function)(sheared.ax, sheared.ay, sheared.cx, sheared.cy);
    weights.w = LANES(edge_function)(sheared.bx, sheared.by, sheared.ax, sheared.ay);
    weights.determinant = weights.u + weights.v + weights.w;
    // A denormal determinant: seen edge-on, or smaller than some 1e-19, where products underflow and weights would be
    // noise.
    weights.inside = LANES(signs_agree)(weights.u, weights.v, weights.w) & (fabs(weights.determinant) >= FLT_MIN);
    return weights;
}

// Returns the hits of the rays' lines, with t in any range; u and v are the weights of b and c.
CASTOR_INLINE LANES(PrimitiveHits) LANES(triangle_hits)(const LANES(Shear) shear, const LANES(RelativeTriangle) sheared,
                                                        const LANES(TriangleWeights) weights)
{
    const Real r = LANES(divide)((Real)(1.0f), weights.determinant);
    LANES(PrimitiveHits) hits;
    hits.accepted = weights.inside;
    hits.u = weights.v * r;
    hits.v = weights.w * r;
    hits.t =
        fma(weights.u * r, shear.z * sheared.az, fma(hits.u, shear.z * sheared.bz, hits.v * (shear.z * sheared.cz)));
    hits.determinant = weights.determinant;
    return hits;
}

CASTOR_INLINE Real LANES(least_of_three)(const Real a, const Real b, const Real c)
{
    return LANES(smaller)(a, LANES(smaller)(b, c));
}

CASTOR_INLINE Real LANES(greatest_of_three)(const Real a, const Real b, const Real c)
{
    return LANES(larger)(a, LANES(larger)(b, c));
}
