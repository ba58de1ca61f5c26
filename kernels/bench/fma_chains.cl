// Measures the roof of arithmetic: eight vectors per work-item, each x = x * factor + summand `steps` times. Enough
// chains hide the latency of one. Writes each work-item's sum of the chains.
#include "bench/lanes.cl"

kernel void fma_chains(const uint count, const uint steps, const float factor, const float summand,
                       global Lanes *restrict sums)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Lanes f = (Lanes)(factor);
    const Lanes s = (Lanes)(summand);
    const Lanes first = lane_numbers() + (float)(i & 15);
    Lanes x0 = first;
    Lanes x1 = first + 1.0f;
    Lanes x2 = first + 2.0f;
    Lanes x3 = first + 3.0f;
    Lanes x4 = first + 4.0f;
    Lanes x5 = first + 5.0f;
    Lanes x6 = first + 6.0f;
    Lanes x7 = first + 7.0f;
    for (uint step = 0; step < steps; ++step) {
        x0 = fma(x0, f, s);
        x1 = fma(x1, f, s);
        x2 = fma(x2, f, s);
        x3 = fma(x3, f, s);
        x4 = fma(x4, f, s);
        x5 = fma(x5, f, s);
        x6 = fma(x6, f, s);
        x7 = fma(x7, f, s);
    }
    sums[i] = ((x0 + x1) + (x2 + x3)) + ((x4 + x5) + (x6 + x7));
}
