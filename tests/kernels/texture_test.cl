// Filtered texels.
#include "device/texture_lookup.cl"

kernel void texture_test(const uint count, const global Texture *restrict textures,
                         const global TextureImage *restrict images, const global uint *restrict texels,
                         const global uint *restrict numbers, const global float4 *restrict points,
                         global float4 *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Texture texture = textures[numbers[i]];
    const float3 texel = filtered_texel(texels, images[texture.image], texture.filter, texture.wrap, points[i].x,
                                        points[i].y, points[i].z);
    results[i] = (float4)(texel, 0.0f);
}
