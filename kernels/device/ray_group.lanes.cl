// Access to the rays of a group for CASTOR_LANES lanes (see lanes.cl): for 16 lanes to all of them, one in each lane
// (`place` is then 0), and for fewer lanes to the one at `place`, the same in every lane.
#include "device/intersect_box.lanes.cl"
#include "device/ray_group.cl"

#if CASTOR_LANES == 16
CASTOR_INLINE float16 rays_of16(const float *column, const uint place) { return vload16(0, column + place); }
#else
CASTOR_INLINE Real LANES(rays_of)(const float *column, const uint place) { return (Real)(column[place]); }
#endif

#if CASTOR_HAS_INSTANCES
// Returns rays of the world, for make_object_ray: without what follows from origin and direction.
CASTOR_INLINE LANES(TraceRay) LANES(world_rays_of_group)(const RayGroup *group, const uint place)
{
    LANES(TraceRay) rays;
    rays.origin_x = LANES(rays_of)(group->world_origin_x, place);
    rays.origin_y = LANES(rays_of)(group->world_origin_y, place);
    rays.origin_z = LANES(rays_of)(group->world_origin_z, place);
    rays.direction_x = LANES(rays_of)(group->direction_x, place);
    rays.direction_y = LANES(rays_of)(group->direction_y, place);
    rays.direction_z = LANES(rays_of)(group->direction_z, place);
    rays.t_min = LANES(rays_of)(group->t_min, place);
    rays.t_max = LANES(rays_of)(group->t_max, place);
    rays.t_scale = LANES(rays_of)(group->t_scale, place);
#if CASTOR_HAS_MOTION
    rays.time = LANES(rays_of)(group->time, place);
#endif
    return rays;
}
#endif

CASTOR_INLINE LANES(Slabs) LANES(slabs_of_group)(const RayGroup *group, const uint place)
{
    LANES(Slabs) slabs;
    slabs.inverse_x = LANES(rays_of)(group->inverse_x, place);
    slabs.inverse_y = LANES(rays_of)(group->inverse_y, place);
    slabs.inverse_z = LANES(rays_of)(group->inverse_z, place);
    slabs.entry_x = LANES(rays_of)(group->entry_x, place);
    slabs.entry_y = LANES(rays_of)(group->entry_y, place);
    slabs.entry_z = LANES(rays_of)(group->entry_z, place);
    slabs.exit_x = LANES(rays_of)(group->exit_x, place);
    slabs.exit_y = LANES(rays_of)(group->exit_y, place);
    slabs.exit_z = LANES(rays_of)(group->exit_z, place);
    return slabs;
}
