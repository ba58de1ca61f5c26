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

// Returns the picture of a level, of one level alone.
CASTOR_INLINE TextureImage LANES(image_of_level)(TextureImage image, const uint level)
{
    const uint words = image.format == CASTOR_TEXELS_FLOATS ? 3u : 1u;
    for (uint i = 0; i < level; ++i) {
        image.first_texel += image.width * image.height * words;
        image.width = max(image.width / 2u, 1u);
        image.height = max(image.height / 2u, 1u);
    }
    return image;
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

// Cells of pictures: texels, and their neighbours to the right and below.
typedef struct LANES(Cells) {
    Whole x, right;  // columns
    Whole y, below;  // rows
    int is_inner;    // `right` is x + 1 for every lane
} LANES(Cells);

// Loads the texels of cells in rows that begin at `row` texels.
CASTOR_INLINE LANES(TexelPairs)
    LANES(load_texel_pairs)(const global uint *restrict texels, const TextureImage image, const LANES(Levels) level,
                            const Whole row, const LANES(Cells) cell)
{
    LANES(TexelPairs) pair;
    if (cell.is_inner && image.format != CASTOR_TEXELS_FLOATS) {
        const LANES(WholeTwos) both = LANES(gather_whole_twos)(texels, level.first_texel + row + cell.x, 1);
        pair.left = LANES(colours_of_bytes)(both.x);
        pair.right = LANES(colours_of_bytes)(both.y);
        return pair;
    }
    pair.left = LANES(load_texels)(texels, image, level, row, cell.x);
    pair.right = LANES(load_texels)(texels, image, level, row, cell.right);
    return pair;
}

// The words of texels that are bytes, at the corners of cells.
typedef struct LANES(CellWords) {
    Whole left_above, right_above, left_below, right_below;
} LANES(CellWords);

#if CASTOR_LANES == 16 && defined(__AVX512F__)
#define CASTOR_TEXEL_WINDOW 16u

// Returns the first column of a window that holds all cells; CASTOR_INVALID_INDEX: there is none.
CASTOR_INLINE uint window_of_cells16(const Cells16 cell, const uint width)
{
    if (!cell.is_inner || width < CASTOR_TEXEL_WINDOW) return CASTOR_INVALID_INDEX;
    const uint first = min(cell.x.s0 - min(cell.x.s0, CASTOR_TEXEL_WINDOW / 2u - 1u), width - CASTOR_TEXEL_WINDOW);
    return mask_of16(cell.x - first >= CASTOR_TEXEL_WINDOW - 1u) ? CASTOR_INVALID_INDEX : first;
}

CASTOR_INLINE uint16 words_in_window16(const global uint *row, const uint16 x)
{
    return as_uint16(permute_16(as_float16(vload16(0, row)), x));
}

// Loads words where all lanes look into one picture of this width, whose texels begin at `texels`, and their columns
// lie in a window: as samples of one pixel mostly do. Each row is loaded once, for all lanes that it counts in.
CASTOR_INLINE CellWords16 load_words_in_window16(const global uint *restrict texels, const uint width,
                                                 const uint window, const Cells16 cell)
{
    uint rows[CASTOR_LANES], next_rows[CASTOR_LANES];
    store_wholes16(cell.y, rows);
    store_wholes16(cell.below, next_rows);
    const uint16 left = cell.x - window, right = left + 1u;
    CellWords16 words;
    words.left_above = words.right_above = words.left_below = words.right_below = (uint16)(0);
    for (uint lanes = 0xffffu; lanes;) {
        const uint lane = lowest_bit(lanes);
        const int16 is_here = cell.y == rows[lane];
        const global uint *const above = texels + ((size_t)width * rows[lane] + window);
        const global uint *const below = texels + ((size_t)width * next_rows[lane] + window);
        words.left_above = is_here ? words_in_window16(above, left) : words.left_above;
        words.right_above = is_here ? words_in_window16(above, right) : words.right_above;
        words.left_below = is_here ? words_in_window16(below, left) : words.left_below;
        words.right_below = is_here ? words_in_window16(below, right) : words.right_below;
        lanes &= ~mask_of16(is_here);
    }
    return words;
}
#endif

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

CASTOR_INLINE LANES(Vectors) LANES(between_four)(const LANES(TexelPairs) above, const LANES(TexelPairs) below,
                                                 const Real across, const Real down)
{
    const LANES(Vectors) upper = LANES(between_texels)(above.left, above.right, across);
    const LANES(Vectors) lower = LANES(between_texels)(below.left, below.right, across);
    return LANES(between_texels)(upper, lower, down);
}

// Interpolates between four texels. `is_same_level`: it is the same for every lane.
CASTOR_INLINE LANES(Vectors)
    LANES(bilinear_texels)(const global uint *restrict texels, const TextureImage image, const LANES(Levels) level,
                           const int is_same_level, const uint wrap, const LANES(Twos) uv)
{
    const Real x = LANES(wrapped_coordinates)(uv.x, CASTOR_WRAP_OF_U(wrap)) * LANES(convert_float)(level.width);
    const Real y = LANES(wrapped_coordinates)(uv.y, CASTOR_WRAP_OF_V(wrap)) * LANES(convert_float)(level.height);
    LANES(Cells) cell;
    cell.x = min(LANES(convert_uint)(x), level.width - 1u);
    cell.y = min(LANES(convert_uint)(y), level.height - 1u);
    cell.right = LANES(next_texels)(cell.x, level.width, CASTOR_WRAP_OF_U(wrap));
    cell.below = LANES(next_texels)(cell.y, level.height, CASTOR_WRAP_OF_V(wrap));
    cell.is_inner = !LANES(mask_of)(cell.right != cell.x + 1u);  // but where a picture begins again
    const Real across = x - LANES(convert_float)(cell.x), down = y - LANES(convert_float)(cell.y);
    LANES(TexelPairs) above, below;
#if CASTOR_LANES == 16 && defined(__AVX512F__)
    const uint window = is_same_level && image.format != CASTOR_TEXELS_FLOATS ? window_of_cells16(cell, level.width.s0)
                                                                              : CASTOR_INVALID_INDEX;
    if (window != CASTOR_INVALID_INDEX) {
        const CellWords16 words = load_words_in_window16(texels + level.first_texel.s0, level.width.s0, window, cell);
        above.left = colours_of_bytes16(words.left_above);
        above.right = colours_of_bytes16(words.right_above);
        below.left = colours_of_bytes16(words.left_below);
        below.right = colours_of_bytes16(words.right_below);
        return between_four16(above, below, across, down);
    }
#endif
    above = LANES(load_texel_pairs)(texels, image, level, cell.y * level.width, cell);
    below = LANES(load_texel_pairs)(texels, image, level, cell.below * level.width, cell);
    return LANES(between_four)(above, below, across, down);
}

// Interpolates between two levels: `level` 0 is the picture itself, 1 half its size.
CASTOR_ONCE LANES(Vectors) LANES(trilinear_texels)(const global uint *restrict texels, const TextureImage image,
                                                   const uint wrap, const LANES(Twos) uv, const Real level)
{
    const Real zero = (Real)(0.0f), last = (Real)(convert_float(image.level_count - 1u));
    const Real limited = level > 0.0f ? (level < last ? level : last) : zero;
    const Whole finer = LANES(convert_uint)(limited);
    const uint first = LANES(first_lane)(finer);
    const int is_same = !LANES(mask_of)(finer != first);
    const LANES(Levels) fine = is_same ? LANES(picture_itself)(LANES(image_of_level)(image, first))
                                       : LANES(levels_below)(LANES(picture_itself)(image), image, finer);
    const LANES(Vectors) texel = LANES(bilinear_texels)(texels, image, fine, is_same, wrap, uv);
    const Real rest = limited - LANES(convert_float)(finer);
    const Mask is_between = rest != 0.0f;
    if (!LANES(mask_of)(is_between)) return texel;
    // Where the level is the last one, nothing is between: below some of one level there is another.
    const LANES(Levels) coarse = is_same ? LANES(picture_itself)(LANES(image_of_level)(image, first + 1u))
                                         : LANES(levels_below)(fine, image, is_between ? (Whole)(1) : (Whole)(0));
    const LANES(Vectors) mixed =
        LANES(between_texels)(texel, LANES(bilinear_texels)(texels, image, coarse, is_same, wrap, uv), rest);
    return LANES(choose_vectors)(is_between, mixed, texel);
}

// `filter`: not the trilinear one.
CASTOR_INLINE LANES(Vectors) LANES(plain_texels)(const global uint *restrict texels, const TextureImage image,
                                                 const uint filter, const uint wrap, const LANES(Twos) uv)
{
    if (filter == CASTOR_TEXTURE_NEAREST) return LANES(nearest_texels)(texels, image, wrap, uv);
    return LANES(bilinear_texels)(texels, image, LANES(picture_itself)(image), 1, wrap, uv);
}

// `level`: of trilinear textures alone.
CASTOR_INLINE LANES(Vectors)
    LANES(filtered_texels)(const global uint *restrict texels, const TextureImage image, const uint filter,
                           const uint wrap, const LANES(Twos) uv, const Real level)
{
    if (filter == CASTOR_TEXTURE_TRILINEAR) return LANES(trilinear_texels)(texels, image, wrap, uv, level);
    return LANES(plain_texels)(texels, image, filter, wrap, uv);
}
