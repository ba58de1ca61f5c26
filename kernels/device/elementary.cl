// The elementary functions that camera, shading and lights need, from exact operations only: + - * fma, comparisons,
// conversions, integers and bit casts, and `divide` and `square_root` of exact.cl. So they give the same bits on every
// device, which no built-in promises. The errors stated bound the largest measured, in units in the last place of the
// exact result rounded to float; tests/kernels/elementary_test.cpp holds the functions to them. A device that flushes
// denormals returns zero where the result is one.
#include "castor/shared/layout.h"
#include "device/double_float.x1.cl"
#include "device/exact.cl"

// Adding and subtracting it rounds a float of at most 2^22 in magnitude to the nearest integer.
#define CASTOR_ROUNDING_MAGIC 12582912.0f  // 1.5 * 2^23

// The largest argument of sine and cosine, in magnitude: their reduction is accurate so far.
#define CASTOR_LARGEST_ANGLE 1e5f

// ---- Exponential and logarithm ----

// -log2(j/32) for j = 22 ... 46: a multiple of 2^-15, and the rest.
constant float2 minus_log2_of_32nds[25] = {(float2)(0.54055786f, 1.0520034e-05f),
                                           (float2)(0.47644043f, -2.3857444e-06f),
                                           (float2)(0.41503906f, -1.5632212e-06f),
                                           (float2)(0.35614014f, 3.6735066e-06f),
                                           (float2)(0.29956055f, -2.650161e-07f),
                                           (float2)(0.24511719f, -4.6896635e-06f),
                                           (float2)(0.19265747f, -1.2392761e-05f),
                                           (float2)(0.14202881f, -9.803722e-06f),
                                           (float2)(0.09310913f, 2.735321e-07f),
                                           (float2)(0.045806885f, -3.1951524e-06f),
                                           (float2)(0.0f, 0.0f),
                                           (float2)(-0.044403076f, 8.956814e-06f),
                                           (float2)(-0.08746338f, 5.376559e-07f),
                                           (float2)(-0.12927246f, -1.05560075e-05f),
                                           (float2)(-0.16992188f, -3.1264424e-06f),
                                           (float2)(-0.20944214f, -1.1226957e-05f),
                                           (float2)(-0.2479248f, -2.708756e-06f),
                                           (float2)(-0.2854004f, -1.8282373e-06f),
                                           (float2)(-0.32192993f, 1.8367533e-06f),
                                           (float2)(-0.35754395f, -8.059305e-06f),
                                           (float2)(-0.39230347f, -1.3955982e-05f),
                                           (float2)(-0.42626953f, 4.776548e-06f),
                                           (float2)(-0.45944214f, 1.0520034e-05f),
                                           (float2)(-0.4918518f, -1.2896891e-06f),
                                           (float2)(-0.5235596f, -2.3857444e-06f)};

// log2(x) to about 34 bits, as a sum of two floats, for x positive and finite (denormals as well).
// x = 2^k m with m in [sqrt(1/2), sqrt(2)), and j/32 near 1/m: log2(x) = k - log2(j/32) + log2(1 + f), f = m j/32 - 1.
// f is exact: m j/32 is a multiple of 2^-29 (2^-28 for m >= 1) and |f| < 0.025 holds no more than 24 bits of those.
CASTOR_INLINE DoubleFloat logarithm2_extended(const float x)
{
    uint bits = as_uint(x);
    int k = 0;
    if (bits < 0x00800000u) {  // denormal: its bits are its value in units of 2^-149
        bits = as_uint(convert_float(bits));
        k = -149;
    }
    const int above = ((int)(bits - 0x3f3504f3u)) >> 23;  // 0x3f3504f3: sqrt(1/2)
    k += above;
    const float m = as_float(bits - ((uint)above << 23));

    const float inverse = fma(fma(fma(-30.143465f, m, 126.05984f), m, -193.91116f), m, 129.94101f);  // 32/m to 0.06
    const float j = (inverse + CASTOR_ROUNDING_MAGIC) - CASTOR_ROUNDING_MAGIC;
    const float f = fma(m, j * 0.03125f, -1.0f);
    const float2 offset = minus_log2_of_32nds[convert_int(j) - 22];

    // log2(1 + f) = f/ln 2 - f^2/(2 ln 2) + f^3 P(f): the first two terms in extended precision.
    const float p = fma(fma(fma(-0.24061465f, f, 0.28870314f), f, -0.36067373f), f, 0.48089832f);
    const DoubleFloat linear = two_product(f, 1.442695f);
    const DoubleFloat square = two_product(f, f);
    const DoubleFloat quadratic = two_product(square.high, -0.7213475f);
    const float small = fma(
        square.high * f, p,
        fma(f, 1.925963e-08f, linear.low) + fma(square.low, -0.7213475f, quadratic.low) + square.high * -9.629815e-09f);
    const DoubleFloat series = quick_two_sum(linear.high, quadratic.high);
    const DoubleFloat sum = quick_two_sum(convert_float(k) + offset.x, series.high);
    return quick_two_sum(sum.high, sum.low + (series.low + (small + offset.y)));
}

// 2^(high + low), |low| small beside 1. NaN for NaN.
CASTOR_INLINE float exponential2_extended(const float high, const float low)
{
    const float clamped = high > 200.0f ? 200.0f : high < -200.0f ? -200.0f : high;
    const float rest = clamped == high ? low : 0.0f;
    const float n = (clamped + CASTOR_ROUNDING_MAGIC) - CASTOR_ROUNDING_MAGIC;
    const float r = (clamped - n) + rest;  // in [-1/2, 1/2] and a little more
    float p = fma(1.4690247e-05f, r, 0.00015453309f);
    p = fma(p, r, 0.0013336623f);
    p = fma(p, r, 0.009618085f);
    p = fma(p, r, 0.05550406f);
    p = fma(p, r, 0.2402265f);
    p = fma(p, r, 0.6931472f);
    // Two factors, as 2^n alone may lie outside the normal numbers while the result does not.
    const int scale = n == n ? convert_int(n) : 0;
    const int half_scale = scale >> 1;
    const float first = as_float((uint)(half_scale + 127) << 23);
    const float second = as_float((uint)(scale - half_scale + 127) << 23);
    return fma(p, r, 1.0f) * first * second;
}

/// 2^x. Largest error 0.9 ulp.
CASTOR_INLINE float exponential2(const float x) { return exponential2_extended(x, 0.0f); }

/// e^x. Largest error 0.9 ulp.
CASTOR_INLINE float exponential(const float x)
{
    const DoubleFloat product = two_product(x, 1.442695f);
    return exponential2_extended(product.high, fma(x, 1.925963e-08f, product.low));
}

/// The logarithm to the base 2: -infinity for 0, NaN for negative numbers. Largest error 0.51 ulp.
CASTOR_INLINE float logarithm2(const float x)
{
    if (!(x > 0.0f)) return x == 0.0f ? -INFINITY : NAN;
    if (x == INFINITY) return x;
    const DoubleFloat result = logarithm2_extended(x);
    return result.high + result.low;
}

/// The natural logarithm: -infinity for 0, NaN for negative numbers. Largest error 0.51 ulp.
CASTOR_INLINE float logarithm(const float x)
{
    if (!(x > 0.0f)) return x == 0.0f ? -INFINITY : NAN;
    if (x == INFINITY) return x;
    const DoubleFloat binary = logarithm2_extended(x);
    const DoubleFloat product = two_product(binary.high, 0.6931472f);
    return product.high + fma(binary.high, -1.9046542e-09f, fma(binary.low, 0.6931472f, product.low));
}

/// x^y for x >= 0, special cases as C's pow; NaN for negative x (even if y is an integer) unless y is 0.
/// Largest error 1.0 ulp.
CASTOR_INLINE float power(const float x, const float y)
{
    if (y == 0.0f || x == 1.0f) return 1.0f;
    if (!(x >= 0.0f) || y != y) return NAN;
    if (x == 0.0f || x == INFINITY) return (x == 0.0f) == (y > 0.0f) ? 0.0f : INFINITY;
    const DoubleFloat binary = logarithm2_extended(x);
    const DoubleFloat product = two_product(y, binary.high);
    return exponential2_extended(product.high, fma(y, binary.low, product.low));
}

// ---- Sine and cosine ----

CASTOR_INLINE float sine_of_reduced(const float r)  // |r| <= pi/4
{
    const float z = r * r;
    const float p = fma(fma(fma(2.8372472e-06f, z, -0.00019853498f), z, 0.00833338f), z, -0.16666667f);
    return fma(r * z, p, r);
}

CASTOR_INLINE float cosine_of_reduced(const float r)  // |r| <= pi/4
{
    const float z = r * r;
    const float p = fma(fma(fma(-2.8974165e-07f, z, 2.4822968e-05f), z, -0.0013888982f), z, 0.041666668f);
    const float half_z = 0.5f * z;
    const float w = 1.0f - half_z;
    return w + fma(z * z, p, (1.0f - w) - half_z);  // what the subtraction lost comes back
}

// The sine of x + quarter_turns * pi/2. Cody and Waite's reduction with fma: x - n pi/2, pi/2 in three parts; the first
// step is exact.
CASTOR_INLINE float sine_of_shifted(const float x, const int quarter_turns)
{
    if (!(fabs(x) <= CASTOR_LARGEST_ANGLE)) return NAN;
    const float n = fma(x, 0.63661975f, CASTOR_ROUNDING_MAGIC) - CASTOR_ROUNDING_MAGIC;
    const float r = fma(-n, -1.7151245e-15f, fma(-n, -4.371139e-08f, fma(-n, 1.5707964f, x)));
    const int quadrant = convert_int(n) + quarter_turns;
    const float value = (quadrant & 1) != 0 ? cosine_of_reduced(r) : sine_of_reduced(r);
    return (quadrant & 2) != 0 ? -value : value;
}

/// The sine of x radians, |x| <= CASTOR_LARGEST_ANGLE; NaN beyond. Largest error 1.5 ulp.
CASTOR_INLINE float sine(const float x) { return sine_of_shifted(x, 0); }

/// The cosine of x radians, |x| <= CASTOR_LARGEST_ANGLE; NaN beyond. Largest error 1.5 ulp.
CASTOR_INLINE float cosine(const float x) { return sine_of_shifted(x, 1); }

// ---- Arc functions ----

CASTOR_INLINE float arc_sine_series(const float x, const float z)  // arc sine of x less x, z = x^2 <= 1/4
{
    float p = fma(0.03762079f, z, 0.014360783f);
    p = fma(p, z, 0.031829413f);
    p = fma(p, z, 0.044514194f);
    p = fma(p, z, 0.075005196f);
    p = fma(p, z, 0.1666666f);
    return x * z * p;
}

/// The arc sine, in [-pi/2, pi/2]; NaN for |x| > 1. Largest error 1.6 ulp.
CASTOR_INLINE float arc_sine(const float x)
{
    const float a = fabs(x);
    if (a <= 0.5f) return x + arc_sine_series(x, x * x);
    const float z = 0.5f * (1.0f - a);  // exact; arc sine of a = pi/2 - 2 arc sine of sqrt(z)
    const float s = square_root(z);
    const float result = 1.5707964f - (2.0f * s - (-4.371139e-08f - 2.0f * arc_sine_series(s, z)));
    return x < 0.0f ? -result : result;
}

/// The arc cosine, in [0, pi]; NaN for |x| > 1. Largest error 1.1 ulp.
CASTOR_INLINE float arc_cosine(const float x)
{
    const float a = fabs(x);
    if (a <= 0.5f) return 1.5707964f - (x - (-4.371139e-08f - arc_sine_series(x, x * x)));
    const float z = 0.5f * (1.0f - a);
    const float s = square_root(z);
    const float half_angle = s + arc_sine_series(s, z);
    return x < 0.0f ? 3.1415927f - (2.0f * half_angle - -8.742278e-08f) : 2.0f * half_angle;
}

/// The angle of the point (x, y), in [-pi, pi]; with zeros and infinities the angles that C's atan2 gives. Largest
/// error 1.7 ulp.
CASTOR_INLINE float arc_tangent2(const float y, const float x)
{
    const float ax = fabs(x), ay = fabs(y);
    const bool steep = ay > ax;
    const float larger = steep ? ay : ax, smaller = steep ? ax : ay;
    const float t = larger == smaller ? (larger == 0.0f ? 0.0f : 1.0f) : divide(smaller, larger);
    const float z = t * t;
    float p = fma(0.0011496948f, z, -0.007498915f);
    p = fma(p, z, 0.02292798f);
    p = fma(p, z, -0.045151565f);
    p = fma(p, z, 0.06774846f);
    p = fma(p, z, -0.0882595f);
    p = fma(p, z, 0.11062278f);
    p = fma(p, z, -0.1428047f);
    p = fma(p, z, 0.19999722f);
    p = fma(p, z, -0.33333328f);
    float angle = fma(t * z, p, t);
    const bool left = (as_uint(x) >> 31) != 0u;
    if (steep)
        angle = 1.5707964f + ((left ? angle : -angle) + -4.371139e-08f);
    else if (left)
        angle = 3.1415927f - (angle - -8.742278e-08f);
    if (x != x || y != y) return NAN;
    return as_float(as_uint(angle) | (as_uint(y) & 0x80000000u));
}
