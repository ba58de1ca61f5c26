// Which hits are crossings, rays and primitives paired lane by lane, for CASTOR_LANES lanes (see lanes.cl).
//
// A point on an edge is inside both of its triangles (intersect_triangle.lanes.cl), and a line through it crosses one
// of them. So a line counts as moved by (e, e^2) across its direction, in the plane of the sheared coordinates, with an
// e smaller than every positive number. Then it passes every edge on one side or the other. kernels/README.md proves
// that a closed surface is crossed evenly.
#include "device/intersect_sphere.lanes.cl"
#include "device/intersect_triangle.lanes.cl"

// Returns where the moved line passes on the left of the edge from a to b: where a x b + e (ay - by) + e^2 (bx - ax) is
// positive. From b to a gives the opposite, but where a equals b, which has no sides. The sign of a x b is exact: where
// two products are rounded to the same number, what was rounded off decides. (Where that is denormal, the sign may
// become zero, for both directions of the edge.)
CASTOR_INLINE Mask LANES(passes_left)(const Real ax, const Real ay, const Real bx, const Real by)
{
    const Real left = ax * by;
    const Real right = ay * bx;
    const Real left_rest = fma(ax, by, -left);
    const Real right_rest = fma(ay, bx, -right);
    const Mask moves_left = (ay > by) | ((ay == by) & (bx > ax));
    return (left > right) | ((left == right) & ((left_rest > right_rest) | ((left_rest == right_rest) & moves_left)));
}

// Returns which sheared triangles the moved lines cross: those all of whose edges they pass on one side.
CASTOR_INLINE Mask LANES(crosses_triangle)(const LANES(RelativeTriangle) sheared)
{
    const Real ax = sheared.ax, ay = sheared.ay;
    const Real bx = sheared.bx, by = sheared.by;
    const Real cx = sheared.cx, cy = sheared.cy;
    return (LANES(passes_left)(ax, ay, bx, by) & LANES(passes_left)(bx, by, cx, cy) &
            LANES(passes_left)(cx, cy, ax, ay)) |
           (LANES(passes_left)(bx, by, ax, ay) & LANES(passes_left)(cx, cy, bx, by) &
            LANES(passes_left)(ax, ay, cx, cy));
}

// Returns where the rays' lines enter spheres, or leave them, with t in any range. A line that touches a sphere does
// neither.
CASTOR_INLINE LANES(PrimitiveHits) LANES(sphere_crossings)(const LANES(SphereRoots) roots, const int leaves)
{
    LANES(PrimitiveHits) hits;
    hits.accepted = roots.root > 0.0f;
    hits.t = leaves ? roots.far_t : roots.near_t;
    hits.u = (Real)(0.0f);
    hits.v = (Real)(0.0f);
    hits.determinant = (Real)(1.0f);  // spheres are never culled
    return hits;
}
