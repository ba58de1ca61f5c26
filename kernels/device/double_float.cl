// Numbers of about 48 bits as unevaluated sums of two floats (Dekker 1971; Joldes, Muller, Popescu 2017, "Tight and rigorous error bounds for basic
// building blocks of double-word arithmetic"). Every step is exact arithmetic of the kind that all devices share.
#include "castor/shared/layout.h"

typedef struct DoubleFloat {
    float high;
    float low;
} DoubleFloat;

// high + low with |low| at most half an ulp of high, for |a| >= |b|.
CASTOR_INLINE DoubleFloat quick_two_sum(const float a, const float b)
{
    DoubleFloat sum;
    sum.high = a + b;
    sum.low = b - (sum.high - a);
    return sum;
}

// Exactly a + b.
CASTOR_INLINE DoubleFloat two_sum(const float a, const float b)
{
    DoubleFloat sum;
    sum.high = a + b;
    const float b_part = sum.high - a;
    sum.low = (a - (sum.high - b_part)) + (b - b_part);
    return sum;
}

// Exactly a * b.
CASTOR_INLINE DoubleFloat two_product(const float a, const float b)
{
    DoubleFloat product;
    product.high = a * b;
    product.low = fma(a, b, -product.high);
    return product;
}

CASTOR_INLINE DoubleFloat add_double_float(const DoubleFloat a, const DoubleFloat b)
{
    const DoubleFloat high = two_sum(a.high, b.high);
    const DoubleFloat low = two_sum(a.low, b.low);
    const DoubleFloat partial = quick_two_sum(high.high, high.low + low.high);
    return quick_two_sum(partial.high, low.low + partial.low);
}

CASTOR_INLINE DoubleFloat negate_double_float(const DoubleFloat a)
{
    DoubleFloat negated;
    negated.high = -a.high;
    negated.low = -a.low;
    return negated;
}

CASTOR_INLINE DoubleFloat multiply_double_float(const DoubleFloat a, const DoubleFloat b)
{
    const DoubleFloat product = two_product(a.high, b.high);
    const float cross_terms = fma(a.high, b.low, a.low * b.high);
    return quick_two_sum(product.high, product.low + cross_terms);
}
