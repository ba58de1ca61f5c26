// Filtered texels.
#include "device/texture_lookup.x1.cl"
#include "device/texture_lookup.x16.cl"

kernel void texture_test(const uint count, const Texture texture, const global TextureImage *restrict images,
                         const global uint *restrict texels, const global float4 *restrict points,
                         global float4 *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float4 point = points[i];
    const Vectors texel =
        filtered_texels(texels, images + texture.image, texture.filter, texture.wrap, point.x, point.y, point.z);
    results[i] = (float4)(texel.x, texel.y, texel.z, 0.0f);
}

// The same for sixteen points after one another.
kernel void texture16_test(const uint count, const Texture texture, const global TextureImage *restrict images,
                           const global uint *restrict texels, const global float4 *restrict points,
                           global float4 *restrict results)
{
    const uint i = 16 * get_global_id(0);
    if (i >= count) return;
    const Vectors16 point = load_vectors16(points + i);
    const Vectors16 texel =
        filtered_texels16(texels, images + texture.image, texture.filter, texture.wrap, point.x, point.y, point.z);
    store_vectors16(texel, results + i);
}
