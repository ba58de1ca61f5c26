// One ray and one sphere: see intersect_sphere.lanes.cl.
#include "castor/shared/layout.h"
#include "device/intersect_primitive.cl"
#include "device/intersect_sphere.x1.cl"

CASTOR_INLINE SphereRay sphere_ray_of(const TraceRay ray)
{
    SphereRay sphere_ray;
    sphere_ray.ox = ray.origin_x;
    sphere_ray.oy = ray.origin_y;
    sphere_ray.oz = ray.origin_z;
    sphere_ray.dx = ray.direction_x;
    sphere_ray.dy = ray.direction_y;
    sphere_ray.dz = ray.direction_z;
    sphere_ray.a = direction_squared(ray.direction_x, ray.direction_y, ray.direction_z);
    return sphere_ray;
}

CASTOR_INLINE Candidate intersect_sphere(const TraceRay ray, const float4 center_radius)
{
    const float3 lower = center_radius.xyz - center_radius.w;
    const float3 upper = center_radius.xyz + center_radius.w;
    const float2 interval = box_interval(ray, lower, upper);
    if (!(interval.x <= interval.y)) return no_candidate();
    const Spheres sphere = {center_radius.x, center_radius.y, center_radius.z, center_radius.w};
    return candidate_of(within_own_box(slabs_of(ray), planes_of_box(ray, lower, upper), ray.t_min, ray.t_max,
                                       sphere_hits(sphere_ray_of(ray), ray.t_min, ray.t_max, sphere)));
}
