// Numbers of about 48 bits as unevaluated sums of two floats (Dekker 1971; Joldes, Muller, Popescu 2017, "Tight and
// rigorous error bounds for basic building blocks of double-word arithmetic"), one or several at once. Every step is
// exact arithmetic of the kind that all devices share.
#include "castor/shared/layout.h"

// For the type T (float, float4, float8, float16): the struct DOUBLE, and functions whose names end in SUFFIX.
//
// two_sum, two_product  exactly a + b, exactly a * b
// quick_two_sum         exactly a + b, for |a| >= |b|
// add_double_float, multiply_double_float: of two such numbers; the sum's error is relative to |a| + |b|
// scale_double_float    such a number times a float
#define CASTOR_DEFINE_DOUBLE_FLOAT(DOUBLE, T, SUFFIX)                                                 \
    typedef struct DOUBLE {                                                                           \
        T high;                                                                                       \
        T low;                                                                                        \
    } DOUBLE;                                                                                         \
                                                                                                      \
    CASTOR_INLINE DOUBLE quick_two_sum##SUFFIX(const T a, const T b)                                  \
    {                                                                                                 \
        DOUBLE sum;                                                                                   \
        sum.high = a + b;                                                                             \
        sum.low = b - (sum.high - a);                                                                 \
        return sum;                                                                                   \
    }                                                                                                 \
                                                                                                      \
    CASTOR_INLINE DOUBLE two_sum##SUFFIX(const T a, const T b)                                        \
    {                                                                                                 \
        DOUBLE sum;                                                                                   \
        sum.high = a + b;                                                                             \
        const T b_part = sum.high - a;                                                                \
        sum.low = (a - (sum.high - b_part)) + (b - b_part);                                           \
        return sum;                                                                                   \
    }                                                                                                 \
                                                                                                      \
    CASTOR_INLINE DOUBLE two_product##SUFFIX(const T a, const T b)                                    \
    {                                                                                                 \
        DOUBLE product;                                                                               \
        product.high = a * b;                                                                         \
        product.low = fma(a, b, -product.high);                                                       \
        return product;                                                                               \
    }                                                                                                 \
                                                                                                      \
    CASTOR_INLINE DOUBLE add_double_float##SUFFIX(const DOUBLE a, const DOUBLE b)                     \
    {                                                                                                 \
        const DOUBLE sum = two_sum##SUFFIX(a.high, b.high);                                           \
        return quick_two_sum##SUFFIX(sum.high, sum.low + (a.low + b.low));                            \
    }                                                                                                 \
                                                                                                      \
    CASTOR_INLINE DOUBLE multiply_double_float##SUFFIX(const DOUBLE a, const DOUBLE b)                \
    {                                                                                                 \
        const DOUBLE product = two_product##SUFFIX(a.high, b.high);                                   \
        return quick_two_sum##SUFFIX(product.high, product.low + fma(a.high, b.low, a.low * b.high)); \
    }                                                                                                 \
                                                                                                      \
    CASTOR_INLINE DOUBLE scale_double_float##SUFFIX(const DOUBLE a, const T b)                        \
    {                                                                                                 \
        const DOUBLE product = two_product##SUFFIX(a.high, b);                                        \
        return quick_two_sum##SUFFIX(product.high, fma(a.low, b, product.low));                       \
    }

CASTOR_DEFINE_DOUBLE_FLOAT(DoubleFloat, float, )
CASTOR_DEFINE_DOUBLE_FLOAT(DoubleFloat4, float4, 4)
CASTOR_DEFINE_DOUBLE_FLOAT(DoubleFloat8, float8, 8)
CASTOR_DEFINE_DOUBLE_FLOAT(DoubleFloat16, float16, 16)
