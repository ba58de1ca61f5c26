// The result of testing one ray against one primitive.
#include "castor/shared/layout.h"
#include "device/intersect_box.cl"
#include "device/intersect_primitive.x1.cl"

// A hit of one primitive, which may not be the nearest; t = NaN: none.
typedef struct Candidate {
    float t;
    float u;
    float v;
    int from_behind;  // the ray runs along the triangle's geometric normal
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

CASTOR_INLINE Candidate candidate_of(const PrimitiveHits hit)
{
    if (!hit.accepted) return no_candidate();
    Candidate candidate;
    candidate.t = hit.t;
    candidate.u = hit.u;
    candidate.v = hit.v;
    candidate.from_behind = hit.determinant < 0.0f;
    return candidate;
}
