// Texels of pictures, filtered, at coordinates (u, v): x = u * width, y = v * height, without a shift by half a texel.
// Arithmetic in a fixed order, so that colours are the same on every device.
#include "castor/shared/constants.h"
#include "castor/shared/types.h"
#include "device/elementary.x1.cl"

// The largest float below 1.
#define CASTOR_BELOW_ONE 0.99999994f

// Returns a level of the picture as a picture of its own.
CASTOR_INLINE TextureImage level_of_image(TextureImage image, const uint level)
{
    const uint words = image.format == CASTOR_TEXELS_FLOATS ? 3u : 1u;
    for (uint i = 0; i < level; ++i) {
        image.first_texel += image.width * image.height * words;
        image.width = max(image.width / 2u, 1u);
        image.height = max(image.height / 2u, 1u);
    }
    return image;
}

CASTOR_INLINE float3 load_texel(const global uint *restrict texels, const TextureImage image, const uint x,
                                const uint y)
{
    const size_t number = (size_t)image.width * y + x;
    if (image.format == CASTOR_TEXELS_FLOATS) {
        const global uint *const bits = texels + image.first_texel + 3 * number;
        return (float3)(as_float(bits[0]), as_float(bits[1]), as_float(bits[2]));
    }
    const uint bytes = texels[image.first_texel + number];
    return convert_float3((uint3)(bytes & 255u, bytes >> 8u & 255u, bytes >> 16u & 255u));
}

// How pictures continue along u and v, of a Texture's `wrap`.
CASTOR_INLINE uint wrap_of_u(const uint wrap) { return wrap & CASTOR_WRAP_MASK; }
CASTOR_INLINE uint wrap_of_v(const uint wrap) { return wrap >> CASTOR_WRAP_BITS; }

// Brings a coordinate into [0, 1): u - floor(u); or into [0, 1] where pictures do not repeat, or are reflected. What is
// a little below a whole number stays below 1.
CASTOR_INLINE float wrapped_coordinate(const float u, const uint wrap)
{
    if (wrap == CASTOR_WRAP_MIRROR) {
        const float half_u = 0.5f * u;
        const float in_two = 2.0f * (half_u - rounded_down(half_u));
        return in_two <= 1.0f ? in_two : 2.0f - in_two;
    }
    if (wrap == CASTOR_WRAP_CLAMP) return u > 0.0f ? (u < 1.0f ? u : 1.0f) : 0.0f;
    const float part = u - rounded_down(u);
    return part < 1.0f ? part : CASTOR_BELOW_ONE;
}

// The texel after another in a row or column of so many.
CASTOR_INLINE uint next_texel(const uint i, const uint count, const uint wrap)
{
    if (i + 1u < count) return i + 1u;
    return wrap == CASTOR_WRAP_REPEAT ? 0u : i;
}

CASTOR_INLINE float3 between_texels(const float3 a, const float3 b, const float t)
{
    return fma((float3)(t), b - a, a);
}

// Returns the texel that the point lies in.
CASTOR_INLINE float3 nearest_texel(const global uint *restrict texels, const TextureImage image, const uint wrap,
                                   const float u, const float v)
{
    const uint x = convert_uint(wrapped_coordinate(u, wrap_of_u(wrap)) * convert_float(image.width));
    const uint y = convert_uint(wrapped_coordinate(v, wrap_of_v(wrap)) * convert_float(image.height));
    return load_texel(texels, image, min(x, image.width - 1u), min(y, image.height - 1u));
}

// Interpolates between four texels.
CASTOR_INLINE float3 bilinear_texel(const global uint *restrict texels, const TextureImage image, const uint wrap,
                                    const float u, const float v)
{
    const float x = wrapped_coordinate(u, wrap_of_u(wrap)) * convert_float(image.width);
    const float y = wrapped_coordinate(v, wrap_of_v(wrap)) * convert_float(image.height);
    const uint p = min(convert_uint(x), image.width - 1u);
    const uint q = min(convert_uint(y), image.height - 1u);
    const uint right = next_texel(p, image.width, wrap_of_u(wrap));
    const uint below = next_texel(q, image.height, wrap_of_v(wrap));
    const float across = x - convert_float(p), down = y - convert_float(q);
    const float3 upper = between_texels(load_texel(texels, image, p, q), load_texel(texels, image, right, q), across);
    const float3 lower =
        between_texels(load_texel(texels, image, p, below), load_texel(texels, image, right, below), across);
    return between_texels(upper, lower, down);
}

// Interpolates between two levels: `level` 0 is the picture itself, 1 half its size.
CASTOR_INLINE float3 trilinear_texel(const global uint *restrict texels, const TextureImage image, const uint wrap,
                                     const float u, const float v, const float level)
{
    const float last = convert_float(image.level_count - 1u);
    const float limited = level > 0.0f ? (level < last ? level : last) : 0.0f;
    const uint finer = convert_uint(limited);
    const TextureImage fine = level_of_image(image, finer);
    const float3 texel = bilinear_texel(texels, fine, wrap, u, v);
    const float rest = limited - convert_float(finer);
    if (rest == 0.0f) return texel;
    return between_texels(texel, bilinear_texel(texels, level_of_image(fine, 1u), wrap, u, v), rest);
}

// `level`: of trilinear textures alone.
CASTOR_INLINE float3 filtered_texel(const global uint *restrict texels, const TextureImage image, const uint filter,
                                    const uint wrap, const float u, const float v, const float level)
{
    if (filter == CASTOR_TEXTURE_NEAREST) return nearest_texel(texels, image, wrap, u, v);
    if (filter == CASTOR_TEXTURE_BILINEAR) return bilinear_texel(texels, image, wrap, u, v);
    return trilinear_texel(texels, image, wrap, u, v, level);
}
