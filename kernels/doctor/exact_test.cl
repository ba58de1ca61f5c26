// Quotient and root by the device's operators (which `divide` and `square_root` are where it rounds them correctly),
// and by integers.
#include "device/exact.cl"

kernel void exact_test(const uint count, const global float *restrict a, const global float *restrict b,
                       global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    results[4 * i] = divide(a[i], b[i]);
    results[4 * i + 1] = divide_by_integers(a[i], b[i]);
    results[4 * i + 2] = square_root(a[i]);
    results[4 * i + 3] = square_root_by_integers(a[i]);
}
