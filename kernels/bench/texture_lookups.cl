// A lookup in a picture for each point (u, v, level), with a texture's filter.
#include "device/texture_lookup.cl"

kernel void texture_lookups(const uint count, const Texture texture, const global TextureImage *restrict images,
                            const global uint *restrict texels, const global float4 *restrict points,
                            global float4 *restrict found)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float3 texel = filtered_texel(texels, images[texture.image], texture.filter, texture.wrap, points[i].x,
                                        points[i].y, points[i].z);
    found[i] = (float4)(texel, 0.0f);
}
