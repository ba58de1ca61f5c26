// fma by integers, of numbers and of vectors.
#include "device/fma_by_integers.cl"

kernel void fma_test(const uint count, const global float *restrict a, const global float *restrict b,
                     const global float *restrict c, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    results[i] = fma_by_integers(a[i], b[i], c[i]);
}

// The first sixteen floats of each column give sixteen results by vectors of sixteen, then fifteen by vectors of three.
kernel void fma_vectors_test(const uint count, const global float *restrict a, const global float *restrict b,
                             const global float *restrict c, global float *restrict results)
{
    if (get_global_id(0) != 0) return;
    vstore16(fma_by_integers(vload16(0, a), vload16(0, b), vload16(0, c)), 0, results);
    for (uint i = 0; i < 5; ++i) vstore3(fma_by_integers(vload3(i, a), vload3(i, b), vload3(i, c)), i, results + 16);
}
