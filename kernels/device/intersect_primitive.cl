// What the tests of all primitives return, and the rule that makes every tree agree with brute force.
#include "castor/shared/layout.h"
#include "device/intersect_box.cl"

// A ray's meeting with one primitive. t = NaN: none.
typedef struct Candidate {
    float t;
    float u;
    float v;
    int from_behind;  // of a triangle: the ray runs along its geometric normal
} Candidate;

CASTOR_INLINE Candidate no_candidate(void)
{
    Candidate none;
    none.t = NAN;
    none.u = 0.0f;
    none.v = 0.0f;
    none.from_behind = 0;
    return none;
}

// A hit of a bounded primitive is one that the primitive's own test accepts at a t in [t_min, t_max] while the ray
// passes the primitive's own box by the same slab arithmetic as nodes'; t is then limited to the box's interval. Then
// no node that is entered later than the best t can hold a better hit.
CASTOR_INLINE Candidate within_own_box(const TraceRay ray, const float3 lower, const float3 upper, Candidate candidate)
{
    if (!(candidate.t >= ray.t_min && candidate.t <= ray.t_max)) return no_candidate();
    const float2 interval = box_interval(ray, lower, upper);
    const float entry = larger(interval.x, ray.t_min);
    const float exit = smaller(interval.y, ray.t_max);
    if (!(entry <= exit)) return no_candidate();
    candidate.t = smaller(larger(candidate.t, entry), exit);
    return candidate;
}
