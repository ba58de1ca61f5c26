// Texels of pictures, filtered, at coordinates (u, v): x = u * width, y = v * height, without a shift by half a texel.
// Arithmetic in a fixed order, so that colours are the same on every device. For CASTOR_LANES lanes (see lanes.cl),
// which all look into the same picture.
#include "castor/shared/constants.h"
#include "castor/shared/types.h"
#include "device/elementary.lanes.cl"
#include "device/vector.lanes.cl"

// The largest float below 1.
#define CASTOR_BELOW_ONE 0.99999994f

// Levels of a picture, each lane's own.
typedef struct LANES(Levels) {
    Whole width;
    Whole height;
    Whole first_texel;
} LANES(Levels);

CASTOR_INLINE LANES(Levels) LANES(picture_itself)(const TextureImage image)
{
    LANES(Levels) level;
    level.width = (Whole)(image.width);
    level.height = (Whole)(image.height);
    level.first_texel = (Whole)(image.first_texel);
    return level;
}

// Returns levels `by` below these.
CASTOR_INLINE LANES(Levels) LANES(levels_below)(LANES(Levels) level, const TextureImage image, const Whole by)
{
    const uint words = image.format == CASTOR_TEXELS_FLOATS ? 3u : 1u;
    for (uint i = 0; LANES(mask_of)(by > i); ++i) {
        const Mask goes_on = by > i;
        const Whole after = level.first_texel + level.width * level.height * words;
        level.first_texel = goes_on ? after : level.first_texel;
        level.width = goes_on ? max(level.width / 2u, (Whole)(1)) : level.width;
        level.height = goes_on ? max(level.height / 2u, (Whole)(1)) : level.height;
    }
    return level;
}

CASTOR_INLINE LANES(Vectors) LANES(colours_of_bytes)(const Whole texel)
{
    return LANES(vectors)(LANES(convert_float)(texel & 255u), LANES(convert_float)((texel >> 8u) & 255u),
                          LANES(convert_float)((texel >> 16u) & 255u));
}

// Loads the texels of columns x of rows that begin at `row` texels.
CASTOR_INLINE LANES(Vectors) LANES(load_texels)(const global uint *restrict texels, const TextureImage image,
                                                const LANES(Levels) level, const Whole row, const Whole x)
{
    const Whole number = row + x;
    if (image.format != CASTOR_TEXELS_FLOATS)
        return LANES(colours_of_bytes)(LANES(gather_wholes)(texels, level.first_texel + number, 1));
    const Whole first = level.first_texel + 3u * number;
    const global float *const floats = (const global float *)texels;
    return LANES(vectors)(LANES(gather_reals)(floats, first, 1), LANES(gather_reals)(floats, first + 1u, 1),
                          LANES(gather_reals)(floats, first + 2u, 1));
}

// Texels side by side in a row.
typedef struct LANES(TexelPairs) {
    LANES(Vectors) left, right;
} LANES(TexelPairs);

// Loads the texels of columns x and `right` of rows that begin at `row` texels. `is_next`: `right` is x + 1 for every
// lane.
CASTOR_INLINE LANES(TexelPairs)
    LANES(load_texel_pairs)(const global uint *restrict texels, const TextureImage image, const LANES(Levels) level,
                            const Whole row, const Whole x, const Whole right, const int is_next)
{
    LANES(TexelPairs) pair;
    if (is_next && image.format != CASTOR_TEXELS_FLOATS) {
        const LANES(WholeTwos) both = LANES(gather_whole_twos)(texels, level.first_texel + row + x, 1);
        pair.left = LANES(colours_of_bytes)(both.x);
        pair.right = LANES(colours_of_bytes)(both.y);
        return pair;
    }
    pair.left = LANES(load_texels)(texels, image, level, row, x);
    pair.right = LANES(load_texels)(texels, image, level, row, right);
    return pair;
}

// How pictures continue along u and v, of a Texture's `wrap`.
#define CASTOR_WRAP_OF_U(wrap) ((wrap)&CASTOR_WRAP_MASK)
#define CASTOR_WRAP_OF_V(wrap) ((wrap) >> CASTOR_WRAP_BITS)

// Brings coordinates into [0, 1): u - floor(u); or into [0, 1] where pictures do not repeat, or are reflected. What is
// a little below a whole number stays below 1.
CASTOR_INLINE Real LANES(wrapped_coordinates)(const Real u, const uint wrap)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    if (wrap == CASTOR_WRAP_MIRROR) {
        const Real half_u = 0.5f * u;
        const Real in_two = 2.0f * (half_u - LANES(rounded_down)(half_u));
        return in_two <= 1.0f ? in_two : 2.0f - in_two;
    }
    if (wrap == CASTOR_WRAP_CLAMP) return u > 0.0f ? (u < 1.0f ? u : one) : zero;
    const Real part = u - LANES(rounded_down)(u);
    return part < 1.0f ? part : (Real)(CASTOR_BELOW_ONE);
}

// The texels after others in rows or columns of so many.
CASTOR_INLINE Whole LANES(next_texels)(const Whole i, const Whole count, const uint wrap)
{
    const Whole after = i + 1u;
    return after < count ? after : (wrap == CASTOR_WRAP_REPEAT ? (Whole)(0) : i);
}

CASTOR_INLINE LANES(Vectors) LANES(between_texels)(const LANES(Vectors) a, const LANES(Vectors) b, const Real t)
{
    return LANES(vectors)(fma(t, b.x - a.x, a.x), fma(t, b.y - a.y, a.y), fma(t, b.z - a.z, a.z));
}

// Returns the texels that points lie in.
CASTOR_INLINE LANES(Vectors) LANES(nearest_texels)(const global uint *restrict texels, const TextureImage image,
                                                   const uint wrap, const LANES(Twos) uv)
{
    const LANES(Levels) level = LANES(picture_itself)(image);
    const Whole x = LANES(convert_uint)(LANES(wrapped_coordinates)(uv.x, CASTOR_WRAP_OF_U(wrap)) *
                                        LANES(convert_float)(level.width));
    const Whole y = LANES(convert_uint)(LANES(wrapped_coordinates)(uv.y, CASTOR_WRAP_OF_V(wrap)) *
                                        LANES(convert_float)(level.height));
    return LANES(load_texels)(texels, image, level, min(y, level.height - 1u) * level.width, min(x, level.width - 1u));
}

// Interpolates between four texels.
CASTOR_INLINE LANES(Vectors) LANES(bilinear_texels)(const global uint *restrict texels, const TextureImage image,
                                                    const LANES(Levels) level, const uint wrap, const LANES(Twos) uv)
{
    const Real x = LANES(wrapped_coordinates)(uv.x, CASTOR_WRAP_OF_U(wrap)) * LANES(convert_float)(level.width);
    const Real y = LANES(wrapped_coordinates)(uv.y, CASTOR_WRAP_OF_V(wrap)) * LANES(convert_float)(level.height);
    const Whole p = min(LANES(convert_uint)(x), level.width - 1u);
    const Whole q = min(LANES(convert_uint)(y), level.height - 1u);
    const Whole right = LANES(next_texels)(p, level.width, CASTOR_WRAP_OF_U(wrap));
    const Whole row = q * level.width,
                next_row = LANES(next_texels)(q, level.height, CASTOR_WRAP_OF_V(wrap)) * level.width;
    const Real across = x - LANES(convert_float)(p), down = y - LANES(convert_float)(q);
    const int is_next = !LANES(mask_of)(right != p + 1u);  // but where a picture begins again
    const LANES(TexelPairs) above = LANES(load_texel_pairs)(texels, image, level, row, p, right, is_next);
    const LANES(TexelPairs) below = LANES(load_texel_pairs)(texels, image, level, next_row, p, right, is_next);
    const LANES(Vectors) upper = LANES(between_texels)(above.left, above.right, across);
    const LANES(Vectors) lower = LANES(between_texels)(below.left, below.right, across);
    return LANES(between_texels)(upper, lower, down);
}

// Interpolates between two levels: `level` 0 is the picture itself, 1 half its size.
CASTOR_ONCE LANES(Vectors) LANES(trilinear_texels)(const global uint *restrict texels, const TextureImage image,
                                                   const uint wrap, const LANES(Twos) uv, const Real level)
{
    const Real zero = (Real)(0.0f), last = (Real)(convert_float(image.level_count - 1u));
    const Real limited = level > 0.0f ? (level < last ? level : last) : zero;
    const Whole finer = LANES(convert_uint)(limited);
    const LANES(Levels) fine = LANES(levels_below)(LANES(picture_itself)(image), image, finer);
    const LANES(Vectors) texel = LANES(bilinear_texels)(texels, image, fine, wrap, uv);
    const Real rest = limited - LANES(convert_float)(finer);
    const Mask is_between = rest != 0.0f;
    if (!LANES(mask_of)(is_between)) return texel;
    const LANES(Levels) coarse = LANES(levels_below)(fine, image, is_between ? (Whole)(1) : (Whole)(0));
    const LANES(Vectors) mixed =
        LANES(between_texels)(texel, LANES(bilinear_texels)(texels, image, coarse, wrap, uv), rest);
    return LANES(choose_vectors)(is_between, mixed, texel);
}

// `level`: of trilinear textures alone.
CASTOR_INLINE LANES(Vectors)
    LANES(filtered_texels)(const global uint *restrict texels, const TextureImage image, const uint filter,
                           const uint wrap, const LANES(Twos) uv, const Real level)
{
    if (filter == CASTOR_TEXTURE_NEAREST) return LANES(nearest_texels)(texels, image, wrap, uv);
    if (filter == CASTOR_TEXTURE_BILINEAR)
        return LANES(bilinear_texels)(texels, image, LANES(picture_itself)(image), wrap, uv);
    return LANES(trilinear_texels)(texels, image, wrap, uv, level);
}
