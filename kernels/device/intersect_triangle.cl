// The watertight test of one ray and one triangle: see intersect_triangle.lanes.cl.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"
#include "device/intersect_triangle.x1.cl"

// Returns the components of v along the ray's axes kx, ky and kz.
CASTOR_INLINE float3 permute(const TraceRay ray, const float3 v)
{
    const float3 p = ray.kz == 0 ? v.yzx : ray.kz == 1 ? v.zxy : v;
    return ray.mirrored ? p.yxz : p;
}

CASTOR_INLINE float3 lower_corner(const float3 p0, const float3 p1, const float3 p2)
{
    return (float3)(least_of_three(p0.x, p1.x, p2.x), least_of_three(p0.y, p1.y, p2.y),
                    least_of_three(p0.z, p1.z, p2.z));
}

CASTOR_INLINE float3 upper_corner(const float3 p0, const float3 p1, const float3 p2)
{
    return (float3)(greatest_of_three(p0.x, p1.x, p2.x), greatest_of_three(p0.y, p1.y, p2.y),
                    greatest_of_three(p0.z, p1.z, p2.z));
}

// Returns the triangle as the ray sees it.
CASTOR_INLINE RelativeTriangle sheared_triangle(const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    const float3 a = permute(ray, p0 - ray_origin(ray));
    const float3 b = permute(ray, p1 - ray_origin(ray));
    const float3 c = permute(ray, p2 - ray_origin(ray));
    const Shear shear = {ray.shear_x, ray.shear_y, ray.shear_z};
    const RelativeTriangle triangle = {a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z};
    return shear_triangle(shear, triangle);
}

// Returns the hit of the ray within its limits; u and v are the weights of p1 and p2.
CASTOR_INLINE Candidate intersect_triangle(const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    const RelativeTriangle sheared = sheared_triangle(ray, p0, p1, p2);
    if (!may_hit_triangle(sheared)) return no_candidate();
    const TriangleWeights weights = triangle_weights(sheared);
    if (!weights.inside) return no_candidate();
    const Shear shear = {ray.shear_x, ray.shear_y, ray.shear_z};
    const BoxPlanes planes = planes_of_box(ray, lower_corner(p0, p1, p2), upper_corner(p0, p1, p2));
    return candidate_of(
        within_own_box(slabs_of(ray), planes, ray.t_min, ray.t_max, triangle_hits(shear, sheared, weights)));
}
