// Measures the roof of memory: a = b + factor * c over buffers that no cache holds (McCalpin 1995, STREAM), with one
// work-item per vector.
#include "bench/lanes.cl"

kernel void triad(const uint count, const float factor, const global Lanes *restrict b, const global Lanes *restrict c,
                  global Lanes *restrict a)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    a[i] = fma((Lanes)(factor), c[i], b[i]);
}
