// The point of a sample in the unit square.
#include "device/random.cl"

kernel void random_test(const uint count, const uint seed, const global uint *restrict pixels,
                        const global uint *restrict samples, global float2 *restrict points)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    points[i] = sample_square(pixels[i], samples[i], seed);
}
