// Rays made ready for traversal, for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/types.h"
#include "device/simd.lanes.cl"
#ifndef CASTOR_HAS_MOTION
#define CASTOR_HAS_MOTION 0
#endif

// The magnitude that replaces a smaller one of a direction's component, zero included: its slabs' inverse stays finite.
#define CASTOR_SMALLEST_DIRECTION 1e-18f

// The enlargement of boxes relative to the largest coordinates of scene and origin: 64 * 2^-24. The rounding of the
// slab arithmetic takes at most 4 * 2^-24 of it (inverse, product, offset and fma: half an ulp each), that of
// intersect_triangle at most 32 * 2^-24 (see there); the rest is margin.
#define CASTOR_BOX_PADDING 0x1p-18f

typedef struct LANES(TraceRay) {
    Real origin_x, origin_y, origin_z;
    // The caller's direction, scaled by a power of two so that its largest component is in [1, 2) (or [2, 4)).
    Real direction_x, direction_y, direction_z;
    Real t_min, t_max;  // in units of this direction
    Real t_scale;       // the caller's t is t * t_scale, exactly
    Mask valid;         // a ray that is not valid hits nothing

    // The slabs: a ray meets the plane x = p where t is fma(p, inverse_x, offset), with the offset for planes at which
    // it enters a box or for those at which it leaves one. Both enlarge the box a little.
    Real inverse_x, inverse_y, inverse_z;
    Real entry_x, entry_y, entry_z;
    Real exit_x, exit_y, exit_z;

    // The shear of Woop, Benthin, Wald 2013: axes kx, ky and kz of the world become x, y and z. kz is the axis of the
    // direction's largest component; kx and ky change places where the ray runs against it, so that the winding stays.
    Whole kx, ky, kz;
    Mask mirrored;
    Real shear_x, shear_y, shear_z;
#if CASTOR_HAS_MOTION
    Real time;  // in [0, 1]: see Instance
#endif
} LANES(TraceRay);

// Returns 1 / d, with components that are nearly zero replaced.
CASTOR_INLINE Real LANES(slab_inverse)(const Real d)
{
    const Real smallest = d < 0.0f ? (Real)(-CASTOR_SMALLEST_DIRECTION) : (Real)(CASTOR_SMALLEST_DIRECTION);
    return LANES(divide)((Real)(1.0f), fabs(d) < CASTOR_SMALLEST_DIRECTION ? smallest : d);
}

// Returns the component of a vector along `axis`.
CASTOR_INLINE Real LANES(choose_axis)(const Whole axis, const Real x, const Real y, const Real z)
{
    return axis == 2u ? z : axis == 1u ? y : x;
}

// Tells whether rays can hit anything. Comparisons are false for NaN. There are no branches, since rays differ.
CASTOR_INLINE Mask LANES(is_traceable)(const LANES(TraceRay) ray)
{
    const Real ax = fabs(ray.direction_x);
    const Real ay = fabs(ray.direction_y);
    const Real az = fabs(ray.direction_z);
    const Mask origin_is_near = (fabs(ray.origin_x) <= CASTOR_MAX_COORDINATE) &
                                (fabs(ray.origin_y) <= CASTOR_MAX_COORDINATE) &
                                (fabs(ray.origin_z) <= CASTOR_MAX_COORDINATE);
    const Mask direction_is_finite = (ax <= FLT_MAX) & (ay <= FLT_MAX) & (az <= FLT_MAX);
    const Mask direction_is_normal = (ax >= FLT_MIN) | (ay >= FLT_MIN) | (az >= FLT_MIN);
    return origin_is_near & direction_is_finite & direction_is_normal & (ray.t_min <= ray.t_max);
}

// Returns the rays with what follows from origin and direction: slabs and shear.
CASTOR_INLINE LANES(TraceRay) LANES(with_slabs_and_shear)(LANES(TraceRay) ray, const float largest_coordinate)
{
    const Real ox = ray.origin_x, oy = ray.origin_y, oz = ray.origin_z;
    const Real dx = ray.direction_x, dy = ray.direction_y, dz = ray.direction_z;
    const Real ix = LANES(slab_inverse)(dx);
    const Real iy = LANES(slab_inverse)(dy);
    const Real iz = LANES(slab_inverse)(dz);
    const Real farthest = LANES(larger)(fabs(ox), LANES(larger)(fabs(oy), fabs(oz)));
    const Real padding = CASTOR_BOX_PADDING * (largest_coordinate + farthest);
    ray.inverse_x = ix;
    ray.inverse_y = iy;
    ray.inverse_z = iz;
    ray.entry_x = -(ox * ix) - padding * fabs(ix);
    ray.entry_y = -(oy * iy) - padding * fabs(iy);
    ray.entry_z = -(oz * iz) - padding * fabs(iz);
    ray.exit_x = -(ox * ix) + padding * fabs(ix);
    ray.exit_y = -(oy * iy) + padding * fabs(iy);
    ray.exit_z = -(oz * iz) + padding * fabs(iz);

    const Whole axis = fabs(dz) > LANES(larger)(fabs(dx), fabs(dy)) ? (Whole)(2)
                       : fabs(dy) > fabs(dx)                        ? (Whole)(1)
                                                                    : (Whole)(0);
    const Whole next = axis == 2u ? (Whole)(0) : axis + 1u;
    const Whole last = next == 2u ? (Whole)(0) : next + 1u;
    ray.mirrored = LANES(choose_axis)(axis, dx, dy, dz) < 0.0f;
    ray.kx = ray.mirrored ? last : next;
    ray.ky = ray.mirrored ? next : last;
    ray.kz = axis;
    ray.shear_z = LANES(choose_axis)(axis, ix, iy, iz);
    ray.shear_x = LANES(choose_axis)(ray.kx, dx, dy, dz) * ray.shear_z;
    ray.shear_y = LANES(choose_axis)(ray.ky, dx, dy, dz) * ray.shear_z;
    return ray;
}

// Makes rays ready of which origin, direction, t_min and t_max are the caller's. Those where `counts` is false are not
// valid. What is not valid becomes some ray that can be traversed.
CASTOR_INLINE LANES(TraceRay) LANES(prepare_ray)(LANES(TraceRay) ray, const Mask counts, const float largest_coordinate)
{
    ray.valid = LANES(is_traceable)(ray) & counts;
    ray.origin_x = ray.valid ? ray.origin_x : (Real)(0.0f);
    ray.origin_y = ray.valid ? ray.origin_y : (Real)(0.0f);
    ray.origin_z = ray.valid ? ray.origin_z : (Real)(0.0f);
    const Real dx = ray.valid ? ray.direction_x : (Real)(1.0f);
    const Real dy = ray.valid ? ray.direction_y : (Real)(1.0f);
    const Real dz = ray.valid ? ray.direction_z : (Real)(1.0f);
    const Real t_min = ray.valid ? ray.t_min : (Real)(0.0f);
    // The t of a hit is finite.
    const Real t_max = LANES(smaller)(ray.valid ? ray.t_max : (Real)(0.0f), (Real)(FLT_MAX));

    // Scaling by a power of two is exact: d and 2d have the same hits.
    const Real largest = LANES(larger)(fabs(dx), LANES(larger)(fabs(dy), fabs(dz)));
    const Whole exponent = LANES(as_uint)(largest) >> 23u;
    const Whole scale_exponent = exponent > 253u ? (Whole)(1) : 254u - exponent;
    const Real scale = LANES(as_float)(scale_exponent << 23u);
    const Real inverse_scale = LANES(as_float)((254u - scale_exponent) << 23u);
    ray.direction_x = dx * scale;
    ray.direction_y = dy * scale;
    ray.direction_z = dz * scale;
    ray.t_scale = scale;
    // Limits of t that become denormal are rounded: they move inwards.
    const Real scaled_min = t_min * inverse_scale;
    const Real scaled_max = t_max * inverse_scale;
    ray.t_min = scaled_min * scale < t_min ? scaled_min + 0x1p-149f : scaled_min;
    ray.t_max = scaled_max * scale > t_max ? scaled_max - 0x1p-149f : scaled_max;
    return LANES(with_slabs_and_shear)(ray, largest_coordinate);
}
