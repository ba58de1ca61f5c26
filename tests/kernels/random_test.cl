// The point of a sample in the unit square.
#include "device/pixels.x1.cl"

kernel void random_test(const uint count, const uint seed, const uint flags, const global uint *restrict pixels,
                        const global uint *restrict samples, global float2 *restrict points)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    RenderParams params;
    params.flags = flags;
    const Pixels pixel = {pixels[i] & 0xffffu, pixels[i] >> 16u};
    const SampleNumbers numbers = sample_numbers(params, pixel, samples[i]);
    const Points point = sample_square(numbers.pixel, numbers.sample, seed);
    points[i] = (float2)(point.x, point.y);
}
