// The columns of textures, and what does not depend on lanes (see textures.lanes.cl).
#include "castor/shared/types.h"
#include "device/noise.cl"

typedef struct TextureColumns {
    const global Texture *textures;
    const global TextureImage *images;
    const global uint *texels;
} TextureColumns;

// Tells whether a texture is a function of texture coordinates alone.
CASTOR_INLINE int is_plain_picture(const global Texture *texture)
{
    return texture->kind == CASTOR_TEXTURE_IMAGE && texture->filter != CASTOR_TEXTURE_TRILINEAR &&
           texture->target < CASTOR_TARGET_NORMAL_MAP;
}

// Returns a texture's noise in [0, 1] (w), and its slope.
CASTOR_INLINE float4 noise_value(const global Texture *texture, const float3 position)
{
    float4 noise = noise_of_octaves(position * texture->noise_scale, texture->noise_octaves);
    noise.xyz *= texture->noise_scale;
    if (texture->noise_conversion == CASTOR_NOISE_ABSOLUTE) return noise.w < 0.0f ? -noise : noise;
    noise *= 0.5f;
    noise.w += 0.5f;
    return noise;
}
