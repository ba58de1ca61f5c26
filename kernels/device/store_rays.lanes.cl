// Stores CASTOR_LANES rays (see lanes.cl) at places [place, place + CASTOR_LANES) of a group, without any hit.
#include "device/double_float.lanes.cl"
#include "device/ray.lanes.cl"
#include "device/ray_group.cl"

// Returns the offset of the near planes of an axis in a WideNode, in bytes. The far ones are at it ^
// CASTOR_PLANE_BYTES.
CASTOR_INLINE Whole LANES(near_plane_bytes)(const Real direction, const uint axis)
{
    return (direction < 0.0f ? (Whole)(CASTOR_PLANE_BYTES) : (Whole)(0)) + 2u * CASTOR_PLANE_BYTES * axis;
}

CASTOR_INLINE void LANES(store_rays)(RayGroup *group, const uint place, const LANES(TraceRay) ray)
{
    const Real ox = ray.origin_x, oy = ray.origin_y, oz = ray.origin_z;
    LANES(store_reals)(ray.t_scale, group->t_scale + place);
    LANES(store_reals)(ray.t_min, group->t_min + place);
    LANES(store_reals)(ray.t_max, group->t_max + place);
    LANES(store_reals)(ray.inverse_x, group->inverse_x + place);
    LANES(store_reals)(ray.inverse_y, group->inverse_y + place);
    LANES(store_reals)(ray.inverse_z, group->inverse_z + place);
    LANES(store_reals)(ray.entry_x, group->entry_x + place);
    LANES(store_reals)(ray.entry_y, group->entry_y + place);
    LANES(store_reals)(ray.entry_z, group->entry_z + place);
    LANES(store_reals)(ray.exit_x, group->exit_x + place);
    LANES(store_reals)(ray.exit_y, group->exit_y + place);
    LANES(store_reals)(ray.exit_z, group->exit_z + place);
    LANES(store_wholes)(LANES(near_plane_bytes)(ray.direction_x, 0), group->near_x + place);
    LANES(store_wholes)(LANES(near_plane_bytes)(ray.direction_y, 1), group->near_y + place);
    LANES(store_wholes)(LANES(near_plane_bytes)(ray.direction_z, 2), group->near_z + place);
    LANES(store_wholes)(ray.kx, group->kx + place);
    LANES(store_wholes)(ray.ky, group->ky + place);
    LANES(store_wholes)(ray.kz, group->kz + place);
    LANES(store_reals)(LANES(choose_axis)(ray.kx, ox, oy, oz), group->origin_x + place);
    LANES(store_reals)(LANES(choose_axis)(ray.ky, ox, oy, oz), group->origin_y + place);
    LANES(store_reals)(LANES(choose_axis)(ray.kz, ox, oy, oz), group->origin_z + place);
    LANES(store_reals)(ray.shear_x, group->shear_x + place);
    LANES(store_reals)(ray.shear_y, group->shear_y + place);
    LANES(store_reals)(ray.shear_z, group->shear_z + place);
#if CASTOR_GROUPS_HAVE_ORIGINS
    LANES(store_reals)(ox, group->world_origin_x + place);
    LANES(store_reals)(oy, group->world_origin_y + place);
    LANES(store_reals)(oz, group->world_origin_z + place);
#endif
#if CASTOR_GROUPS_HAVE_DIRECTIONS
    LANES(store_reals)(ray.direction_x, group->direction_x + place);
    LANES(store_reals)(ray.direction_y, group->direction_y + place);
    LANES(store_reals)(ray.direction_z, group->direction_z + place);
#endif
#if CASTOR_HAS_SPHERES
    const LANES(DoubleFloat) squared = LANES(direction_squared)(ray.direction_x, ray.direction_y, ray.direction_z);
    LANES(store_reals)(squared.high, group->direction_squared_high + place);
    LANES(store_reals)(squared.low, group->direction_squared_low + place);
#endif
    LANES(store_reals)(ray.t_max, group->best_t + place);
    LANES(store_wholes)((Whole)(CASTOR_INVALID_INDEX), group->best_primitive + place);
#if CASTOR_HAS_INSTANCES
    LANES(store_wholes)((Whole)(0), group->best_instance + place);
#endif
}
