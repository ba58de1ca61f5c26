// A ray made ready for traversal.
#include "castor/shared/types.h"
#include "device/exact.cl"

// In magnitude, what stands for a direction component that is zero or nearly so: its slabs' inverse stays finite.
#define CASTOR_SMALLEST_DIRECTION 1e-18f

// The enlargement of boxes relative to the largest coordinates of scene and origin: 64 * 2^-24. The rounding of the
// slab arithmetic takes at most 4 * 2^-24 of it (inverse, product, offset and fma: half an ulp each), that of
// intersect_triangle at most 32 * 2^-24 (see there); the rest is margin.
#define CASTOR_BOX_PADDING 0x1p-18f

typedef struct TraceRay {
    float3 origin;
    float3 direction;  // the caller's, scaled by a power of two so that its largest component is in [1, 2) (or [2, 4))
    float t_min;       // in units of this direction
    float t_max;
    float t_scale;  // the caller's t = t * t_scale, exactly
    int valid;      // 0: hits nothing

    // Slabs: distance of plane x along an axis is fma(x, inverse, offset).
    float3 inverse;
    float3 entry_offset;
    float3 exit_offset;

    // Shear of Woop, Benthin, Wald 2013: the axis of the largest component becomes z.
    int axis;
    int mirrored;  // x and y change places, so that the winding stays
    float3 shear;  // (S_x, S_y, S_z)
} TraceRay;

CASTOR_INLINE float larger(const float a, const float b) { return a > b ? a : b; }
CASTOR_INLINE float smaller(const float a, const float b) { return a < b ? a : b; }

// The components of v from the one after `axis` on: axis becomes z; x and y change places where the ray runs against
// the axis.
CASTOR_INLINE float3 permute(const float3 v, const int axis, const int mirrored)
{
    const float3 p = axis == 0 ? v.yzx : axis == 1 ? v.zxy : v;
    return mirrored ? p.yxz : p;
}

// 1 / d of each component. One vector division where the device has it.
CASTOR_INLINE float3 slab_inverse(const float3 d)
{
    const float3 smallest = d < 0.0f ? (float3)(-CASTOR_SMALLEST_DIRECTION) : (float3)(CASTOR_SMALLEST_DIRECTION);
    const float3 safe = fabs(d) < CASTOR_SMALLEST_DIRECTION ? smallest : d;
#if CASTOR_CORRECTLY_ROUNDED
    return 1.0f / safe;
#else
    return (float3)(divide(1.0f, safe.x), divide(1.0f, safe.y), divide(1.0f, safe.z));
#endif
}

// Comparisons are false for NaN. No branches: rays differ.
CASTOR_INLINE int is_traceable(const float3 o, const float3 d, const float t_min, const float t_max)
{
    const float3 a = fabs(d);
    const int origin_is_near = (fabs(o.x) <= CASTOR_MAX_COORDINATE) & (fabs(o.y) <= CASTOR_MAX_COORDINATE) &
                               (fabs(o.z) <= CASTOR_MAX_COORDINATE);
    const int direction_is_finite = (a.x <= FLT_MAX) & (a.y <= FLT_MAX) & (a.z <= FLT_MAX);
    const int direction_is_normal = (a.x >= FLT_MIN) | (a.y >= FLT_MIN) | (a.z >= FLT_MIN);
    return origin_is_near & direction_is_finite & direction_is_normal & (t_min <= t_max);
}

// Limits of t in units of the scaled direction: exact, but for those that become denormal. These move inwards.
CASTOR_INLINE float scaled_t_min(const float t_min, const float scale, const float inverse_scale)
{
    const float t = t_min * inverse_scale;
    return t * scale < t_min ? t + 0x1p-149f : t;
}

CASTOR_INLINE float scaled_t_max(const float t_max, const float scale, const float inverse_scale)
{
    const float t = t_max * inverse_scale;
    return t * scale > t_max ? t - 0x1p-149f : t;
}

// The ray with what follows from its origin and direction.
CASTOR_INLINE TraceRay with_slabs_and_shear(TraceRay ray, const float largest_coordinate)
{
    const float3 o = ray.origin;
    ray.inverse = slab_inverse(ray.direction);
    const float farthest = larger(fabs(o.x), larger(fabs(o.y), fabs(o.z)));
    const float padding = CASTOR_BOX_PADDING * (largest_coordinate + farthest);
    const float3 base = -(o * ray.inverse);
    const float3 pad = padding * fabs(ray.inverse);
    ray.entry_offset = base - pad;
    ray.exit_offset = base + pad;

    const float3 a = fabs(ray.direction);
    ray.axis = a.z > larger(a.x, a.y) ? 2 : a.y > a.x ? 1 : 0;
    const float3 turned = permute(ray.direction, ray.axis, 0);
    ray.mirrored = turned.z < 0.0f;
    const float3 along = ray.mirrored ? turned.yxz : turned;
    const float inverse_z = permute(ray.inverse, ray.axis, 0).z;
    ray.shear = (float3)(along.x * inverse_z, along.y * inverse_z, inverse_z);
    return ray;
}

CASTOR_INLINE TraceRay make_trace_ray(const float4 origin_tmin, const float4 direction_tmax,
                                      const float largest_coordinate)
{
    TraceRay ray;
    const float3 o = origin_tmin.xyz;
    const float3 d = direction_tmax.xyz;
    ray.valid = is_traceable(o, d, origin_tmin.w, direction_tmax.w);

    // Powers of two are exact: t and hits are the same for d and 2d but for the scale.
    const float largest = larger(fabs(d.x), larger(fabs(d.y), fabs(d.z)));
    const int exponent = (int)(as_uint(largest) >> 23);
    const int scale_exponent = exponent > 253 ? 1 : 254 - exponent;
    const float scale = as_float((uint)scale_exponent << 23);
    const float inverse_scale = as_float((uint)(254 - scale_exponent) << 23);

    ray.origin = o;
    ray.direction = d * scale;
    ray.t_scale = scale;
    ray.t_min = scaled_t_min(origin_tmin.w, scale, inverse_scale);
    ray.t_max = scaled_t_max(smaller(direction_tmax.w, FLT_MAX), scale, inverse_scale);  // a hit's t is finite
    return with_slabs_and_shear(ray, largest_coordinate);
}

// Ray i of two columns, or of one buffer of Ray records that is given twice.
CASTOR_INLINE TraceRay load_ray(const TraceParams params, const uint i, const global float4 *restrict ray_origin_tmin,
                                const global float4 *restrict ray_direction_tmax)
{
    const size_t row = (size_t)i * params.ray_stride;
    return make_trace_ray(ray_origin_tmin[row], ray_direction_tmax[row + params.direction_offset],
                          params.largest_coordinate);
}
