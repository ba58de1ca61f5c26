// Rays in the space of an instance, for CASTOR_LANES lanes (see lanes.cl).
#include "device/ray.lanes.cl"

CASTOR_INLINE Real LANES(affine_row)(const global float *row, const Real x, const Real y, const Real z)
{
    return fma((Real)(row[0]), x, fma((Real)(row[1]), y, fma((Real)(row[2]), z, (Real)(row[3]))));
}

CASTOR_INLINE Real LANES(linear_row)(const global float *row, const Real x, const Real y, const Real z)
{
    return fma((Real)(row[0]), x, fma((Real)(row[1]), y, row[2] * z));
}

// Returns the rays, which must be valid, in the instance's space: with the same t.
CASTOR_INLINE LANES(TraceRay)
    LANES(make_object_ray)(const LANES(TraceRay) ray, const global Instance *instance, const float largest_coordinate)
{
    Real ox = ray.origin_x, oy = ray.origin_y, oz = ray.origin_z;
#if CASTOR_HAS_MOTION  // as if the instance rested: see moved_point
    ox = fma(-ray.time, (Real)(instance->motion[0]), ox);
    oy = fma(-ray.time, (Real)(instance->motion[1]), oy);
    oz = fma(-ray.time, (Real)(instance->motion[2]), oz);
#endif
    const Real dx = ray.direction_x, dy = ray.direction_y, dz = ray.direction_z;
    const global float(*m)[4] = instance->to_object;
    LANES(TraceRay) object = ray;
    object.origin_x = LANES(affine_row)(m[0], ox, oy, oz);
    object.origin_y = LANES(affine_row)(m[1], ox, oy, oz);
    object.origin_z = LANES(affine_row)(m[2], ox, oy, oz);
    object.direction_x = LANES(linear_row)(m[0], dx, dy, dz);
    object.direction_y = LANES(linear_row)(m[1], dx, dy, dz);
    object.direction_z = LANES(linear_row)(m[2], dx, dy, dz);
    object.valid = LANES(is_traceable)(object);
    return LANES(with_slabs_and_shear)(object, largest_coordinate);
}
