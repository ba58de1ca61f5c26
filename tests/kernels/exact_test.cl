// Quotient and root by the device's operators (which `divide` and `square_root` are where it rounds them correctly), and by integers.
#include "device/exact.cl"

kernel void exact_test(const uint count, const global float *restrict a, const global float *restrict b,
                       global float4 *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    results[i] = (float4)(divide(a[i], b[i]), divide_by_integers(a[i], b[i]), square_root(a[i]),
                          square_root_by_integers(a[i]));
}
