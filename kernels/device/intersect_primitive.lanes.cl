// The hits of rays and bounded primitives, paired lane by lane, for CASTOR_LANES lanes (see lanes.cl), and the rule
// that makes every tree agree with brute force.
#include "device/intersect_box.lanes.cl"

typedef struct LANES(PrimitiveHits) {
    Mask accepted;
    Real t, u, v;
    Real determinant;  // negative: the ray runs along the triangle's geometric normal
} LANES(PrimitiveHits);

// Applies the own-box rule. A hit of a bounded primitive is one that the primitive's own test accepts at a t in [t_min,
// t_max] while the ray passes the primitive's own box by the same slab test as nodes'; t is then limited to the box's
// interval. So no node that is entered later than the best t can hold a better hit.
CASTOR_INLINE LANES(PrimitiveHits) LANES(within_own_box)(const LANES(Slabs) slabs, const LANES(BoxPlanes) planes,
                                                         const Real t_min, const Real t_max, LANES(PrimitiveHits) hits)
{
    const LANES(Interval) interval = LANES(slab_test)(slabs, planes, t_min, t_max);
    hits.accepted &= (hits.t >= t_min) & (hits.t <= t_max) & (interval.entry <= interval.exit);
    hits.t = LANES(smaller)(LANES(larger)(hits.t, interval.entry), interval.exit);
    return hits;
}
