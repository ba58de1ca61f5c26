// The rays of a group as the tests of triangles and spheres take them, for CASTOR_LANES lanes: see ray_group.lanes.cl.
#include "device/intersect_sphere.lanes.cl"
#include "device/intersect_triangle.lanes.cl"
#include "device/ray_group.lanes.cl"

CASTOR_INLINE LANES(Shear) LANES(shear_of_group)(const RayGroup *group, const uint place)
{
    LANES(Shear) shear;
    shear.x = LANES(rays_of)(group->shear_x, place);
    shear.y = LANES(rays_of)(group->shear_y, place);
    shear.z = LANES(rays_of)(group->shear_z, place);
    return shear;
}

#if CASTOR_HAS_SPHERES
CASTOR_INLINE LANES(SphereRay) LANES(sphere_ray_of_group)(const RayGroup *group, const uint place)
{
    LANES(SphereRay) ray;
    ray.ox = LANES(rays_of)(group->world_origin_x, place);
    ray.oy = LANES(rays_of)(group->world_origin_y, place);
    ray.oz = LANES(rays_of)(group->world_origin_z, place);
    ray.dx = LANES(rays_of)(group->direction_x, place);
    ray.dy = LANES(rays_of)(group->direction_y, place);
    ray.dz = LANES(rays_of)(group->direction_z, place);
    ray.a.high = LANES(rays_of)(group->direction_squared_high, place);
    ray.a.low = LANES(rays_of)(group->direction_squared_low, place);
    return ray;
}
#endif
