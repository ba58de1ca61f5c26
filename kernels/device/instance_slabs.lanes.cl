// The slabs of a group's rays for the wide tree over instances, CASTOR_LANES rays at a time (see lanes.cl): 8 or 16.
#include "device/ray_group.cl"
#include "device/simd.lanes.cl"

#if CASTOR_HAS_INSTANCES
// Replaces the slabs of rays [place, place + CASTOR_LANES). `slope`: the greatest of any instance, see InstanceNode.
CASTOR_INLINE void LANES(store_instance_slabs)(RayGroup *group, const uint place, const float slope)
{
    const Real ox = LANES(vload)(0, group->world_origin_x + place);
    const Real oy = LANES(vload)(0, group->world_origin_y + place);
    const Real oz = LANES(vload)(0, group->world_origin_z + place);
    const Real ix = LANES(vload)(0, group->inverse_x + place);
    const Real iy = LANES(vload)(0, group->inverse_y + place);
    const Real iz = LANES(vload)(0, group->inverse_z + place);
    const Real farthest = LANES(larger)(fabs(ox), LANES(larger)(fabs(oy), fabs(oz)));
    const Real pad_x = slope * (farthest * fabs(ix));
    const Real pad_y = slope * (farthest * fabs(iy));
    const Real pad_z = slope * (farthest * fabs(iz));
    LANES(store_reals)(-(ox * ix) - pad_x, group->entry_x + place);
    LANES(store_reals)(-(oy * iy) - pad_y, group->entry_y + place);
    LANES(store_reals)(-(oz * iz) - pad_z, group->entry_z + place);
    LANES(store_reals)(-(ox * ix) + pad_x, group->exit_x + place);
    LANES(store_reals)(-(oy * iy) + pad_y, group->exit_y + place);
    LANES(store_reals)(-(oz * iz) + pad_z, group->exit_z + place);
}
#endif
