// Vector algebra, written out: dot(), cross(), length() and normalize() may round differently on each device.
#include "castor/shared/layout.h"
#include "device/exact.cl"

CASTOR_INLINE float dot_product(const float3 a, const float3 b) { return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z)); }

CASTOR_INLINE float3 cross_product(const float3 a, const float3 b)
{
    return (float3)(fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x)));
}

CASTOR_INLINE float vector_length(const float3 a) { return square_root(dot_product(a, a)); }

// Returns a with length 1; (0,0,0) stays (0,0,0).
CASTOR_INLINE float3 normalized(const float3 a)
{
    const float length_of_a = vector_length(a);
    if (!(length_of_a > 0.0f)) return (float3)(0.0f);
    return a * divide(1.0f, length_of_a);
}

// Returns origin + t * direction.
CASTOR_INLINE float3 point_on_ray(const float3 origin, const float t, const float3 direction)
{
    return (float3)(fma(t, direction.x, origin.x), fma(t, direction.y, origin.y), fma(t, direction.z, origin.z));
}
