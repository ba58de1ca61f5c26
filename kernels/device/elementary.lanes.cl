// The elementary functions that camera, shading and lights need, for CASTOR_LANES lanes (see lanes.cl), from exact
// operations only: + - * fma, comparisons, conversions, integers and bit casts, and `divide` and `square_root` of
// exact.cl. So they give the same bits on every device and for every number of lanes, which no built-in promises. There
// are no branches: what does not apply to a lane is computed and not chosen. The errors stated bound the largest
// measured, in units in the last place of the exact result rounded to float; tests/kernels/elementary_test.cpp holds
// the functions to them. A device that flushes denormals returns zero where the result is one.
#include "device/double_float.lanes.cl"
#include "device/elementary_tables.cl"
#include "device/simd.lanes.cl"

// ---- Exponential and logarithm ----

// Returns log2(x) to about 34 bits, as a sum of two floats, for x positive and finite (denormals as well).
// x = 2^k m with m in [sqrt(1/2), sqrt(2)), and j/32 near 1/m: log2(x) = k - log2(j/32) + log2(1 + f), f = m j/32 - 1.
// f is exact: m j/32 is a multiple of 2^-29 (2^-28 for m >= 1) and |f| < 0.025 holds no more than 24 bits of those.
CASTOR_INLINE LANES(DoubleFloat) LANES(logarithm2_extended)(const Real x)
{
    const Whole bits_of_x = LANES(as_uint)(x);
    // The bits of a denormal are its value in units of 2^-149.
    const Mask is_denormal = bits_of_x < 0x00800000u;
    const Whole bits = is_denormal ? LANES(as_uint)(LANES(convert_float)(bits_of_x)) : bits_of_x;
    const Int above = LANES(as_int)(bits - 0x3f3504f3u) >> 23;  // 0x3f3504f3: sqrt(1/2)
    const Int k = (is_denormal ? (Int)(-149) : (Int)(0)) + above;
    const Real m = LANES(as_float)(bits - (LANES(as_uint)(above) << 23u));

    // 32/m to 0.06
    const Real inverse =
        fma(fma(fma((Real)(-30.143465f), m, (Real)(126.05984f)), m, (Real)(-193.91116f)), m, (Real)(129.94101f));
    const Real j = (inverse + CASTOR_ROUNDING_MAGIC) - CASTOR_ROUNDING_MAGIC;
    const Real f = fma(m, j * 0.03125f, (Real)(-1.0f));
    const Whole entry = LANES(as_uint)(LANES(convert_int)(j)) - 22u;
    const Real offset_high = LANES(look_up)(minus_log2_of_32nds_high, entry);
    const Real offset_low = LANES(look_up)(minus_log2_of_32nds_low, entry);

    // log2(1 + f) = f/ln 2 - f^2/(2 ln 2) + f^3 P(f): the first two terms in extended precision.
    const Real p =
        fma(fma(fma((Real)(-0.24061465f), f, (Real)(0.28870314f)), f, (Real)(-0.36067373f)), f, (Real)(0.48089832f));
    const LANES(DoubleFloat) linear = LANES(two_product)(f, (Real)(1.442695f));
    const LANES(DoubleFloat) square = LANES(two_product)(f, f);
    const LANES(DoubleFloat) quadratic = LANES(two_product)(square.high, (Real)(-0.7213475f));
    const Real small = fma(square.high * f, p,
                           fma(f, (Real)(1.925963e-08f), linear.low) +
                               fma(square.low, (Real)(-0.7213475f), quadratic.low) + square.high * -9.629815e-09f);
    const LANES(DoubleFloat) series = LANES(quick_two_sum)(linear.high, quadratic.high);
    const LANES(DoubleFloat) sum = LANES(quick_two_sum)(LANES(convert_float)(k) + offset_high, series.high);
    return LANES(quick_two_sum)(sum.high, sum.low + (series.low + (small + offset_low)));
}

// Returns 2^(high + low), |low| small beside 1. NaN for NaN.
CASTOR_INLINE Real LANES(exponential2_extended)(const Real high, const Real low)
{
    const Real clamped = high > 200.0f ? (Real)(200.0f) : high < -200.0f ? (Real)(-200.0f) : high;
    const Real rest = clamped == high ? low : (Real)(0.0f);
    const Real n = (clamped + CASTOR_ROUNDING_MAGIC) - CASTOR_ROUNDING_MAGIC;
    const Real r = (clamped - n) + rest;  // in [-1/2, 1/2] and a little more
    Real p = fma((Real)(1.4690247e-05f), r, (Real)(0.00015453309f));
    p = fma(p, r, (Real)(0.0013336623f));
    p = fma(p, r, (Real)(0.009618085f));
    p = fma(p, r, (Real)(0.05550406f));
    p = fma(p, r, (Real)(0.2402265f));
    p = fma(p, r, (Real)(0.6931472f));
    // Two factors, as 2^n alone may lie outside the normal numbers while the result does not.
    const Int scale = LANES(convert_int)(n == n ? n : (Real)(0.0f));
    const Int half_scale = scale >> 1;
    const Real first = LANES(as_float)(LANES(as_uint)(half_scale + 127) << 23u);
    const Real second = LANES(as_float)(LANES(as_uint)(scale - half_scale + 127) << 23u);
    return fma(p, r, (Real)(1.0f)) * first * second;
}

/// 2^x. Largest error 0.9 ulp.
CASTOR_INLINE Real LANES(exponential2)(const Real x) { return LANES(exponential2_extended)(x, (Real)(0.0f)); }

/// e^x. Largest error 0.9 ulp.
CASTOR_INLINE Real LANES(exponential)(const Real x)
{
    const LANES(DoubleFloat) product = LANES(two_product)(x, (Real)(1.442695f));
    return LANES(exponential2_extended)(product.high, fma(x, (Real)(1.925963e-08f), product.low));
}

// Returns `finite`, the logarithm of a positive finite x, or what the logarithm of another x is.
CASTOR_INLINE Real LANES(logarithm_of_any)(const Real x, const Real finite)
{
    const Real of_zero_or_less = x == 0.0f ? (Real)(-INFINITY) : (Real)(NAN);
    return x > 0.0f ? (x == INFINITY ? x : finite) : of_zero_or_less;
}

/// The logarithm to the base 2: -infinity for 0, NaN for negative numbers. Largest error 0.51 ulp.
CASTOR_INLINE Real LANES(logarithm2)(const Real x)
{
    const LANES(DoubleFloat) result = LANES(logarithm2_extended)(x);
    return LANES(logarithm_of_any)(x, result.high + result.low);
}

/// log2(x) to 2e-5, for x positive and finite; of denormals and 0 a number below -126, of infinity and NaN any number.
/// x = 2^k m with m in [sqrt(1/2), sqrt(2)); the polynomial is the best one of its degree for log2(1 + f), f = m - 1.
CASTOR_INLINE Real LANES(rough_logarithm2)(const Real x)
{
    const Int bits = LANES(as_int)(x);
    const Int k = (bits - 0x3f3504f3) >> 23;  // 0x3f3504f3: sqrt(1/2)
    const Real f = LANES(as_float)(bits - (k << 23)) - 1.0f;
    const Real p =
        fma(fma(fma(fma((Real)(0.25266021f), f, (Real)(-0.39457536f)), f, (Real)(0.48668617f)), f, (Real)(-0.7202418f)),
            f, (Real)(1.442578f));
    return fma(f, p, LANES(convert_float)(k));
}

/// The natural logarithm: -infinity for 0, NaN for negative numbers. Largest error 0.51 ulp.
CASTOR_INLINE Real LANES(logarithm)(const Real x)
{
    const LANES(DoubleFloat) binary = LANES(logarithm2_extended)(x);
    const LANES(DoubleFloat) product = LANES(two_product)(binary.high, (Real)(0.6931472f));
    return LANES(logarithm_of_any)(
        x, product.high + fma(binary.high, (Real)(-1.9046542e-09f), fma(binary.low, (Real)(0.6931472f), product.low)));
}

/// x^y for x >= 0, special cases as C's pow; NaN for negative x (even if y is an integer) unless y is 0.
/// Largest error 1.0 ulp.
CASTOR_ONCE Real LANES(power)(const Real x, const Real y)
{
    const LANES(DoubleFloat) binary = LANES(logarithm2_extended)(x);
    const LANES(DoubleFloat) product = LANES(two_product)(y, binary.high);
    const Real general = LANES(exponential2_extended)(product.high, fma(y, binary.low, product.low));
    const Real of_zero = y > 0.0f ? (Real)(0.0f) : (Real)(INFINITY);
    const Real of_infinity = y > 0.0f ? (Real)(INFINITY) : (Real)(0.0f);
    const Real of_positive = x == INFINITY ? of_infinity : general;
    const Real of_number = x == 0.0f ? of_zero : of_positive;
    const Real of_any = ((x >= 0.0f) & (y == y)) ? of_number : (Real)(NAN);
    return ((y == 0.0f) | (x == 1.0f)) ? (Real)(1.0f) : of_any;
}

// ---- Sine and cosine ----

CASTOR_INLINE Real LANES(sine_of_reduced)(const Real r)  // |r| <= pi/4
{
    const Real z = r * r;
    const Real p = fma(fma(fma((Real)(2.8372472e-06f), z, (Real)(-0.00019853498f)), z, (Real)(0.00833338f)), z,
                       (Real)(-0.16666667f));
    return fma(r * z, p, r);
}

CASTOR_INLINE Real LANES(cosine_of_reduced)(const Real r)  // |r| <= pi/4
{
    const Real z = r * r;
    const Real p = fma(fma(fma((Real)(-2.8974165e-07f), z, (Real)(2.4822968e-05f)), z, (Real)(-0.0013888982f)), z,
                       (Real)(0.041666668f));
    const Real half_z = 0.5f * z;
    const Real w = 1.0f - half_z;
    return w + fma(z * z, p, (1.0f - w) - half_z);  // what the subtraction lost comes back
}

// Returns the sine of x + quarter_turns * pi/2. Cody and Waite's reduction with fma: x - n pi/2, pi/2 in three parts;
// the first step is exact.
CASTOR_INLINE Real LANES(sine_of_shifted)(const Real x, const int quarter_turns)
{
    const Mask is_in_range = fabs(x) <= CASTOR_LARGEST_ANGLE;
    const Real angle = is_in_range ? x : (Real)(0.0f);
    const Real n = fma(angle, (Real)(0.63661975f), (Real)(CASTOR_ROUNDING_MAGIC)) - CASTOR_ROUNDING_MAGIC;
    const Real r =
        fma(-n, (Real)(-1.7151245e-15f), fma(-n, (Real)(-4.371139e-08f), fma(-n, (Real)(1.5707964f), angle)));
    const Int quadrant = LANES(convert_int)(n) + quarter_turns;
    const Real value = (quadrant & 1) != 0 ? LANES(cosine_of_reduced)(r) : LANES(sine_of_reduced)(r);
    const Real signed_value = (quadrant & 2) != 0 ? -value : value;
    return is_in_range ? signed_value : (Real)(NAN);
}

/// The sine of x radians, |x| <= CASTOR_LARGEST_ANGLE; NaN beyond. Largest error 1.5 ulp.
CASTOR_INLINE Real LANES(sine)(const Real x) { return LANES(sine_of_shifted)(x, 0); }

/// The cosine of x radians, |x| <= CASTOR_LARGEST_ANGLE; NaN beyond. Largest error 1.5 ulp.
CASTOR_INLINE Real LANES(cosine)(const Real x) { return LANES(sine_of_shifted)(x, 1); }

// ---- Arc functions ----

CASTOR_INLINE Real LANES(arc_sine_series)(const Real x, const Real z)  // arc sine of x less x, z = x^2 <= 1/4
{
    Real p = fma((Real)(0.03762079f), z, (Real)(0.014360783f));
    p = fma(p, z, (Real)(0.031829413f));
    p = fma(p, z, (Real)(0.044514194f));
    p = fma(p, z, (Real)(0.075005196f));
    p = fma(p, z, (Real)(0.1666666f));
    return x * z * p;
}

/// The arc sine, in [-pi/2, pi/2]; NaN for |x| > 1. Largest error 1.6 ulp.
CASTOR_INLINE Real LANES(arc_sine)(const Real x)
{
    const Real a = fabs(x);
    const Real small = x + LANES(arc_sine_series)(x, x * x);
    const Real z = 0.5f * (1.0f - a);  // exact; arc sine of a = pi/2 - 2 arc sine of sqrt(z)
    const Real s = LANES(square_root)(z);
    const Real result = 1.5707964f - (2.0f * s - (-4.371139e-08f - 2.0f * LANES(arc_sine_series)(s, z)));
    return a <= 0.5f ? small : (x < 0.0f ? -result : result);
}

/// The arc cosine, in [0, pi]; NaN for |x| > 1. Largest error 1.1 ulp.
CASTOR_INLINE Real LANES(arc_cosine)(const Real x)
{
    const Real a = fabs(x);
    const Real small = 1.5707964f - (x - (-4.371139e-08f - LANES(arc_sine_series)(x, x * x)));
    const Real z = 0.5f * (1.0f - a);
    const Real s = LANES(square_root)(z);
    const Real half_angle = s + LANES(arc_sine_series)(s, z);
    const Real large = x < 0.0f ? 3.1415927f - (2.0f * half_angle - -8.742278e-08f) : 2.0f * half_angle;
    return a <= 0.5f ? small : large;
}

/// The angle of the point (x, y), in [-pi, pi]; with zeros and infinities the angles that C's atan2 gives. Largest
/// error 1.7 ulp.
CASTOR_INLINE Real LANES(arc_tangent2)(const Real y, const Real x)
{
    const Real ax = fabs(x), ay = fabs(y);
    const Mask is_steep = ay > ax;
    const Real longer = is_steep ? ay : ax, shorter = is_steep ? ax : ay;
    const Real of_equal = longer == 0.0f ? (Real)(0.0f) : (Real)(1.0f);
    const Real t = longer == shorter ? of_equal : LANES(divide)(shorter, longer);
    const Real z = t * t;
    Real p = fma((Real)(0.0011496948f), z, (Real)(-0.007498915f));
    p = fma(p, z, (Real)(0.02292798f));
    p = fma(p, z, (Real)(-0.045151565f));
    p = fma(p, z, (Real)(0.06774846f));
    p = fma(p, z, (Real)(-0.0882595f));
    p = fma(p, z, (Real)(0.11062278f));
    p = fma(p, z, (Real)(-0.1428047f));
    p = fma(p, z, (Real)(0.19999722f));
    p = fma(p, z, (Real)(-0.33333328f));
    const Real angle = fma(t * z, p, t);
    const Mask is_left = (LANES(as_uint)(x) >> 31u) != 0u;
    const Real of_steep = 1.5707964f + ((is_left ? angle : -angle) + -4.371139e-08f);
    const Real of_flat = is_left ? 3.1415927f - (angle - -8.742278e-08f) : angle;
    const Real of_upper = is_steep ? of_steep : of_flat;
    const Real of_any = LANES(as_float)(LANES(as_uint)(of_upper) | (LANES(as_uint)(y) & 0x80000000u));
    return ((x == x) & (y == y)) ? of_any : (Real)(NAN);
}

// ---- Rounding ----

/// The largest whole number that is not above x; NaN for NaN. Exact.
CASTOR_INLINE Real LANES(rounded_down)(const Real x)
{
    const Mask has_fraction = fabs(x) < 8388608.0f;  // 2^23: all larger floats are whole
    const Real towards_zero = LANES(convert_float)(LANES(convert_int)(has_fraction ? x : (Real)(0.0f)));
    const Real below = towards_zero > x ? towards_zero - 1.0f : towards_zero;
    return has_fraction ? below : x;
}
