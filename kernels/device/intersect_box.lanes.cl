// The slab test of every box, of nodes and of primitives alike, for CASTOR_LANES lanes (see lanes.cl): rays and boxes
// are paired lane by lane. box_interval has the same operations for one ray and one box. The test is monotone: rounding
// is, and the near plane of a box around another lies no later, its far plane no earlier, exactly. So a node's interval
// contains those of all that the node holds.
#include "device/ray.cl"
#include "device/ray.lanes.cl"
#include "device/simd.lanes.cl"

// The slabs of rays: see TraceRay.
typedef struct LANES(Slabs) {
    Real inverse_x, inverse_y, inverse_z;
    Real entry_x, entry_y, entry_z;
    Real exit_x, exit_y, exit_z;
} LANES(Slabs);

// The planes of boxes: those through which a ray enters, and those through which it leaves.
typedef struct LANES(BoxPlanes) {
    Real near_x, near_y, near_z;
    Real far_x, far_y, far_z;
} LANES(BoxPlanes);

// Where rays are within their boxes; entry > exit: nowhere.
typedef struct LANES(Interval) {
    Real entry;
    Real exit;
} LANES(Interval);

// Returns the slabs of one ray, in every lane.
CASTOR_INLINE LANES(Slabs) LANES(slabs_of)(const TraceRay ray)
{
    LANES(Slabs) slabs;
    slabs.inverse_x = (Real)(ray.inverse_x);
    slabs.inverse_y = (Real)(ray.inverse_y);
    slabs.inverse_z = (Real)(ray.inverse_z);
    slabs.entry_x = (Real)(ray.entry_x);
    slabs.entry_y = (Real)(ray.entry_y);
    slabs.entry_z = (Real)(ray.entry_z);
    slabs.exit_x = (Real)(ray.exit_x);
    slabs.exit_y = (Real)(ray.exit_y);
    slabs.exit_z = (Real)(ray.exit_z);
    return slabs;
}

// Returns the slabs of rays, one in each lane.
CASTOR_INLINE LANES(Slabs) LANES(slabs_of_rays)(const LANES(TraceRay) rays)
{
    LANES(Slabs) slabs;
    slabs.inverse_x = rays.inverse_x;
    slabs.inverse_y = rays.inverse_y;
    slabs.inverse_z = rays.inverse_z;
    slabs.entry_x = rays.entry_x;
    slabs.entry_y = rays.entry_y;
    slabs.entry_z = rays.entry_z;
    slabs.exit_x = rays.exit_x;
    slabs.exit_y = rays.exit_y;
    slabs.exit_z = rays.exit_z;
    return slabs;
}

// Chooses near and far planes lane by lane, without branches.
CASTOR_INLINE LANES(BoxPlanes)
    LANES(box_planes)(const LANES(Slabs) slabs, const Real lower_x, const Real lower_y, const Real lower_z,
                      const Real upper_x, const Real upper_y, const Real upper_z)
{
    const Mask down_x = slabs.inverse_x < 0.0f;
    const Mask down_y = slabs.inverse_y < 0.0f;
    const Mask down_z = slabs.inverse_z < 0.0f;
    LANES(BoxPlanes) planes;
    planes.near_x = down_x ? upper_x : lower_x;
    planes.near_y = down_y ? upper_y : lower_y;
    planes.near_z = down_z ? upper_z : lower_z;
    planes.far_x = down_x ? lower_x : upper_x;
    planes.far_y = down_y ? lower_y : upper_y;
    planes.far_z = down_z ? lower_z : upper_z;
    return planes;
}

// Returns the part of [from, to] in which rays are within their slightly enlarged boxes.
CASTOR_INLINE LANES(Interval)
    LANES(slab_test)(const LANES(Slabs) slabs, const LANES(BoxPlanes) planes, const Real from, const Real to)
{
    const Real entry_x = fma(planes.near_x, slabs.inverse_x, slabs.entry_x);
    const Real entry_y = fma(planes.near_y, slabs.inverse_y, slabs.entry_y);
    const Real entry_z = fma(planes.near_z, slabs.inverse_z, slabs.entry_z);
    const Real exit_x = fma(planes.far_x, slabs.inverse_x, slabs.exit_x);
    const Real exit_y = fma(planes.far_y, slabs.inverse_y, slabs.exit_y);
    const Real exit_z = fma(planes.far_z, slabs.inverse_z, slabs.exit_z);
    LANES(Interval) interval;
    interval.entry = LANES(larger)(LANES(larger)(entry_x, entry_y), LANES(larger)(entry_z, from));
    interval.exit = LANES(smaller)(LANES(smaller)(exit_x, exit_y), LANES(smaller)(exit_z, to));
    return interval;
}
