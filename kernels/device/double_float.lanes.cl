// Numbers of about 48 bits as unevaluated sums of two floats (Dekker 1971; Joldes, Muller, Popescu 2017, "Tight and
// rigorous error bounds for basic building blocks of double-word arithmetic"), for CASTOR_LANES lanes (see lanes.cl).
// Every step is exact arithmetic of the kind that all devices share.
#include "device/lanes.cl"

typedef struct LANES(DoubleFloat) {
    Real high;
    Real low;
} LANES(DoubleFloat);

// Returns a + b exactly, for |a| >= |b|.
CASTOR_INLINE LANES(DoubleFloat) LANES(quick_two_sum)(const Real a, const Real b)
{
    LANES(DoubleFloat) sum;
    sum.high = a + b;
    sum.low = b - (sum.high - a);
    return sum;
}

// Returns a + b exactly.
CASTOR_INLINE LANES(DoubleFloat) LANES(two_sum)(const Real a, const Real b)
{
    LANES(DoubleFloat) sum;
    sum.high = a + b;
    const Real b_part = sum.high - a;
    sum.low = (a - (sum.high - b_part)) + (b - b_part);
    return sum;
}

// Returns a * b exactly.
CASTOR_INLINE LANES(DoubleFloat) LANES(two_product)(const Real a, const Real b)
{
    LANES(DoubleFloat) product;
    product.high = a * b;
    product.low = fma(a, b, -product.high);
    return product;
}

// Returns a + b with an error relative to |a| + |b|.
CASTOR_INLINE LANES(DoubleFloat) LANES(add_double_float)(const LANES(DoubleFloat) a, const LANES(DoubleFloat) b)
{
    const LANES(DoubleFloat) sum = LANES(two_sum)(a.high, b.high);
    return LANES(quick_two_sum)(sum.high, sum.low + (a.low + b.low));
}

CASTOR_INLINE LANES(DoubleFloat) LANES(multiply_double_float)(const LANES(DoubleFloat) a, const LANES(DoubleFloat) b)
{
    const LANES(DoubleFloat) product = LANES(two_product)(a.high, b.high);
    return LANES(quick_two_sum)(product.high, product.low + fma(a.high, b.low, a.low * b.high));
}

// Returns a times the float b.
CASTOR_INLINE LANES(DoubleFloat) LANES(scale_double_float)(const LANES(DoubleFloat) a, const Real b)
{
    const LANES(DoubleFloat) product = LANES(two_product)(a.high, b);
    return LANES(quick_two_sum)(product.high, fma(a.low, b, product.low));
}

// Returns the square of a vector's length.
CASTOR_INLINE LANES(DoubleFloat) LANES(direction_squared)(const Real dx, const Real dy, const Real dz)
{
    return LANES(add_double_float)(LANES(add_double_float)(LANES(two_product)(dx, dx), LANES(two_product)(dy, dy)),
                                   LANES(two_product)(dz, dz));
}
