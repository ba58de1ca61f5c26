// What OpenCL defines exactly, one operation beside the other, for castor doctor.
#include "castor/shared/layout.h"

typedef struct ArithmeticResult {
    float sum, difference, product, fused;
    float unfused;    // a * b + c, which no compiler may contract
    float converted;  // the bits of a as an int, to float
    int truncated;    // b towards zero, 0 where that is no int
    uint relations;   // a < b, a <= b, a == b, a != b, isnan(a), isinf(a), a < b ? 1 : 0 by select, from bit 0 on
} ArithmeticResult;

kernel void arithmetic(const uint count, const global float *restrict a, const global float *restrict b,
                       const global float *restrict c, global ArithmeticResult *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float x = a[i], y = b[i];
    ArithmeticResult result;
    result.sum = x + y;
    result.difference = x - y;
    result.product = x * y;
    result.fused = fma(x, y, c[i]);
    result.unfused = x * y + c[i];
    result.converted = convert_float(as_int(x));
    result.truncated = y > -0x1p30f && y < 0x1p30f ? convert_int_rtz(y) : 0;
    result.relations = (uint)(x < y) | (uint)(x <= y) << 1 | (uint)(x == y) << 2 | (uint)(x != y) << 3 |
                       (uint)isnan(x) << 4 | (uint)isinf(x) << 5 | select(0u, 1u, (uint)(x < y)) << 6;
    results[i] = result;
}
