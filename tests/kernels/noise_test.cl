// Noise (w) and its slope at points (x, y, z), with w octaves.
#include "device/noise.cl"

kernel void noise_test(const uint count, const global float4 *restrict points, global float4 *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    results[i] = noise_of_octaves(points[i].xyz, convert_uint(points[i].w));
}
