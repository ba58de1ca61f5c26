// fma by integers, for devices whose drivers compute it in software, wrongly or with so many branches that their
// compilers take gigabytes for a program of Castor's. It rounds as IEEE 754 says, keeps denormals, and has no branch.
// It stands before every program there (DeviceQuirks::prelude), whose `fma` it is.
#include "castor/shared/layout.h"

CASTOR_INLINE int count_leading_zeros(const ulong x)
{
    const uint high = clz((uint)(x >> 32));
    return (int)(high + (high >> 5) * clz((uint)x));
}

// Returns x / 2^n for n >= 0 and x < 2^63; the last bit is set if any bit was lost.
CASTOR_INLINE ulong shift_right_sticky(const ulong x, const int n)
{
    const int shift = min(n, 63);
    return (x >> shift) | (ulong)((x & ((1ul << shift) - 1ul)) != 0ul);
}

// A number >= 0 as mantissa * 2^exponent, with mantissa in [2^61, 2^62). Zero has an exponent below all others.
typedef struct Scaled {
    ulong mantissa;
    int exponent;
} Scaled;

CASTOR_INLINE Scaled scale(const ulong mantissa, const int exponent)
{
    const int zeros = count_leading_zeros(mantissa);
    Scaled result;
    result.mantissa = mantissa << (zeros - 2);
    result.exponent = exponent - (zeros - 2) - (zeros >> 6) * 1000;
    return result;
}

// A finite magnitude is mantissa_of * 2^(exponent_of - 150).
CASTOR_INLINE uint mantissa_of(const uint magnitude)
{
    return (magnitude & 0x007fffffu) | (min(magnitude >> 23, 1u) << 23);
}
CASTOR_INLINE int exponent_of(const uint magnitude) { return (int)max(magnitude >> 23, 1u); }

// Returns `magnitude` with a sign: negative if `sign` is 1, and not if it is 0.
CASTOR_INLINE long with_sign(const ulong magnitude, const uint sign) { return (long)(magnitude ^ -(ulong)sign) + sign; }

// Returns the bits of a * b + c, rounded once, for finite values.
CASTOR_INLINE uint fma_of_finite(const uint a, const uint b, const uint c)
{
    const uint magnitude_a = a & 0x7fffffffu, magnitude_b = b & 0x7fffffffu, magnitude_c = c & 0x7fffffffu;
    const uint product_sign = (a ^ b) >> 31, summand_sign = c >> 31;
    const Scaled product = scale((ulong)mantissa_of(magnitude_a) * mantissa_of(magnitude_b),
                                 exponent_of(magnitude_a) + exponent_of(magnitude_b) - 300);
    const Scaled summand = scale(mantissa_of(magnitude_c), exponent_of(magnitude_c) - 150);

    // A product has 48 bits, so that bits are lost below the last 14 of the larger one: far from those that round.
    const int exponent = max(product.exponent, summand.exponent);
    const long sum = with_sign(shift_right_sticky(product.mantissa, exponent - product.exponent), product_sign) +
                     with_sign(shift_right_sticky(summand.mantissa, exponent - summand.exponent), summand_sign);
    const uint sum_sign = (uint)((ulong)sum >> 63);
    const ulong magnitude = (ulong)with_sign((ulong)sum, sum_sign);

    const int zeros = count_leading_zeros(magnitude), is_zero = zeros >> 6;
    const int field = exponent - zeros + 190 - is_zero * 1000;  // of the exponent, if it is 1 or more
    const ulong mantissa = shift_right_sticky(magnitude << (zeros - 1), max(1 - field, 0));  // below 2^63
    const uint kept = (uint)(mantissa >> 39);
    const ulong rest = mantissa & ((1ul << 39) - 1ul);
    const uint up = (uint)(rest + (kept & 1u) > (1ul << 38));
    // Mantissa and exponent side by side: a carry out of the mantissa moves into the exponent, up to infinity.
    const uint rounded = ((uint)(max(field, 1) - 1) << 23) + kept + up;
    const uint sign = sum_sign | ((uint)is_zero & product_sign & summand_sign);
    return min(rounded, 0x7f800000u) | (sign << 31);
}

CASTOR_INLINE float __attribute__((overloadable)) fma_by_integers(const float x, const float y, const float z)
{
    const uint a = as_uint(x), b = as_uint(y), c = as_uint(z), infinity = 0x7f800000u;
    const uint magnitude_a = a & 0x7fffffffu, magnitude_b = b & 0x7fffffffu, magnitude_c = c & 0x7fffffffu;
    const uint product_sign = (a ^ b) & 0x80000000u;
    const uint factor = max(magnitude_a, magnitude_b);
    const uint is_infinite = (uint)(factor == infinity);
    const uint is_nan = (uint)(max(factor, magnitude_c) > infinity) |
                        (is_infinite & (uint)(min(magnitude_a, magnitude_b) == 0u)) |
                        (is_infinite & (uint)(c == ((product_sign ^ 0x80000000u) | infinity)));
    const uint finite = select(fma_of_finite(a, b, c), c, (uint)(magnitude_c >= infinity));
    return as_float(select(select(finite, product_sign | infinity, is_infinite), 0x7fc00000u, is_nan));
}

CASTOR_INLINE float3 __attribute__((overloadable)) fma_by_integers(const float3 a, const float3 b, const float3 c)
{
    return (float3)(fma_by_integers(a.x, b.x, c.x), fma_by_integers(a.y, b.y, c.y), fma_by_integers(a.z, b.z, c.z));
}

#define CASTOR_DEFINE_FMA(T)                                                                       \
    CASTOR_INLINE T __attribute__((overloadable)) fma_by_integers(const T a, const T b, const T c) \
    {                                                                                              \
        return (T)(fma_by_integers(a.lo, b.lo, c.lo), fma_by_integers(a.hi, b.hi, c.hi));          \
    }
CASTOR_DEFINE_FMA(float2)
CASTOR_DEFINE_FMA(float4)
CASTOR_DEFINE_FMA(float8)
CASTOR_DEFINE_FMA(float16)

#undef fma
#define fma fma_by_integers
