// The point of a sample in the unit square.
#include "device/random.x1.cl"

kernel void random_test(const uint count, const uint seed, const global uint *restrict pixels,
                        const global uint *restrict samples, global float2 *restrict points)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Points point = sample_square(pixels[i], samples[i], seed);
    points[i] = (float2)(point.x, point.y);
}
