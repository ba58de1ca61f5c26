// The lecture's second triangle test: o + t d = p0 + beta (p1 - p0) + gamma (p2 - p0), a linear system in beta, gamma
// and t, by Cramer's rule with shared sub-determinants (Shirley, Marschner 2009, "Fundamentals of Computer Graphics"
// §4.4.2). Fast and plain, but rays can slip between neighbours: rendering uses intersect_triangle.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"

// t in any range; u and v are the weights of p1 and p2. Edges count as inside; a triangle seen edge-on is missed.
CASTOR_INLINE Candidate intersect_triangle_cramer(const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    // Columns p0 - p1, p0 - p2 and d, right-hand side p0 - o, named as in the book.
    const float3 abc = p0 - p1, def = p0 - p2, ghi = ray_direction(ray), jkl = p0 - ray_origin(ray);
    const float ei_hf = def.y * ghi.z - ghi.y * def.z;
    const float gf_di = ghi.x * def.z - def.x * ghi.z;
    const float dh_eg = def.x * ghi.y - def.y * ghi.x;
    const float ak_jb = abc.x * jkl.y - jkl.x * abc.y;
    const float jc_al = jkl.x * abc.z - abc.x * jkl.z;
    const float bl_kc = abc.y * jkl.z - jkl.y * abc.z;

    const float determinant = abc.x * ei_hf + abc.y * gf_di + abc.z * dh_eg;
    if (determinant == 0.0f) return no_candidate();
    const float beta = divide(jkl.x * ei_hf + jkl.y * gf_di + jkl.z * dh_eg, determinant);
    const float gamma = divide(ghi.z * ak_jb + ghi.y * jc_al + ghi.x * bl_kc, determinant);
    // Written so that NaN is outside.
    if (!(beta >= 0.0f && gamma >= 0.0f && beta + gamma <= 1.0f)) return no_candidate();

    Candidate candidate;
    candidate.t = divide(-(def.z * ak_jb + def.y * jc_al + def.x * bl_kc), determinant);
    candidate.u = beta;
    candidate.v = gamma;
    candidate.from_behind = determinant > 0.0f;
    return candidate;
}
