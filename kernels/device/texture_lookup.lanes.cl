// Texels of pictures, filtered, at coordinates (u, v): x = u * width, y = v * height, without a shift by half a texel.
// Arithmetic in a fixed order, so that colours are the same on every device. For CASTOR_LANES lanes (see lanes.cl),
// which all look into the same picture.
#include "castor/shared/constants.h"
#include "castor/shared/types.h"
#include "device/elementary.lanes.cl"
#include "device/vector.lanes.cl"

// The largest float below 1.
#define CASTOR_BELOW_ONE 0.99999994f

CASTOR_INLINE LANES(Vectors) LANES(colours_of_bytes)(const Whole texel)
{
    return LANES(vectors)(LANES(convert_float)(texel & 255u), LANES(convert_float)((texel >> 8u) & 255u),
                          LANES(convert_float)((texel >> 16u) & 255u));
}

// Loads the texels with these numbers. `format`: of a TextureImage.
CASTOR_INLINE LANES(Vectors)
    LANES(load_texels)(const global uint *restrict texels, const uint format, const Whole number)
{
    if (format != CASTOR_TEXELS_FLOATS) return LANES(colours_of_bytes)(LANES(gather_wholes)(texels, number, 1));
    return LANES(gather_threes)((const global float *)texels, number);
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
CASTOR_INLINE LANES(TexelPairs) LANES(load_texel_pairs)(const global uint *restrict texels, const uint format,
                                                        const Whole row, const LANES(Cells) cell)
{
    LANES(TexelPairs) pair;
    if (cell.is_inner && format != CASTOR_TEXELS_FLOATS) {
        const LANES(WholeTwos) both = LANES(gather_whole_twos)(texels, row + cell.x, 1);
        pair.left = LANES(colours_of_bytes)(both.x);
        pair.right = LANES(colours_of_bytes)(both.y);
        return pair;
    }
    pair.left = LANES(load_texels)(texels, format, row + cell.x);
    pair.right = LANES(load_texels)(texels, format, row + cell.right);
    return pair;
}

#if CASTOR_LANES == 16 && defined(__AVX512F__)
// Texels along the edges of a window.
#define CASTOR_WINDOW_WIDTH 8u
#define CASTOR_WINDOW_HEIGHT 4u

CASTOR_INLINE uint16 two_rows16(const global uint *at, const uint width)
{
    return (uint16)(vload8(0, at), vload8(0, at + width));
}

// Returns the words with numbers CASTOR_WINDOW_WIDTH * y + x of a window.
CASTOR_INLINE uint16 words_in_window16(const uint16 upper, const uint16 lower, const uint16 number)
{
    return as_uint16(permute_two_16(as_float16(upper), as_float16(lower), number));
}
#endif

// Returns the texels that points lie in. `u`, `v`: wrapped.
CASTOR_INLINE LANES(Vectors) LANES(nearest_texels)(const global uint *restrict texels, const uint format,
                                                   const uint width, const uint height, const Real u, const Real v)
{
    const Whole x = min(LANES(convert_uint)(u * convert_float(width)), (Whole)(width - 1u));
    const Whole y = min(LANES(convert_uint)(v * convert_float(height)), (Whole)(height - 1u));
    return LANES(load_texels)(texels, format, y * width + x);
}

CASTOR_INLINE LANES(Vectors) LANES(between_four)(const LANES(TexelPairs) above, const LANES(TexelPairs) below,
                                                 const Real across, const Real down)
{
    const LANES(Vectors) upper = LANES(between_texels)(above.left, above.right, across);
    const LANES(Vectors) lower = LANES(between_texels)(below.left, below.right, across);
    return LANES(between_texels)(upper, lower, down);
}

// Interpolates between four texels of a picture of this size, which begins at `texels`. `x`, `y`: in texels.
CASTOR_ONCE LANES(Vectors)
    LANES(bilinear_texels_anywhere)(const global uint *restrict texels, const uint format, const uint width,
                                    const uint height, const uint wrap, const Real x, const Real y)
{
    LANES(Cells) cell;
    cell.x = min(LANES(convert_uint)(x), (Whole)(width - 1u));
    cell.y = min(LANES(convert_uint)(y), (Whole)(height - 1u));
    cell.right = LANES(next_texels)(cell.x, (Whole)(width), CASTOR_WRAP_OF_U(wrap));
    cell.below = LANES(next_texels)(cell.y, (Whole)(height), CASTOR_WRAP_OF_V(wrap));
    cell.is_inner = !LANES(mask_of)(cell.right != cell.x + 1u);  // but where a picture begins again
    const Real across = x - LANES(convert_float)(cell.x), down = y - LANES(convert_float)(cell.y);
    return LANES(between_four)(LANES(load_texel_pairs)(texels, format, cell.y * width, cell),
                               LANES(load_texel_pairs)(texels, format, cell.below * width, cell), across, down);
}

// The same. `u`, `v`: wrapped.
CASTOR_INLINE LANES(Vectors)
    LANES(bilinear_texels)(const global uint *restrict texels, const uint format, const uint width, const uint height,
                           const uint wrap, const Real u, const Real v)
{
    const Real x = u * convert_float(width), y = v * convert_float(height);
#if CASTOR_LANES == 16 && defined(__AVX512F__)
    // Cells of samples of one pixel mostly lie in a window around one of them, of which each row is loaded once.
    if (format != CASTOR_TEXELS_FLOATS && width >= CASTOR_WINDOW_WIDTH && height >= CASTOR_WINDOW_HEIGHT) {
        const uint16 cell_x = convert_uint16(x), cell_y = convert_uint16(y);
        const uint left = min(max(cell_x.s0, 3u) - 3u, width - CASTOR_WINDOW_WIDTH);
        const uint top = min(max(cell_y.s0, 1u) - 1u, height - CASTOR_WINDOW_HEIGHT);
        const uint16 column = cell_x - left, row = cell_y - top;
        if (!mask_of16((column >= CASTOR_WINDOW_WIDTH - 1u) | (row >= CASTOR_WINDOW_HEIGHT - 1u))) {
            const global uint *const first = texels + ((size_t)width * top + left);
            const uint16 upper = two_rows16(first, width), lower = two_rows16(first + 2 * (size_t)width, width);
            const uint16 number = CASTOR_WINDOW_WIDTH * row + column;
            TexelPairs16 above, below;
            above.left = colours_of_bytes16(words_in_window16(upper, lower, number));
            above.right = colours_of_bytes16(words_in_window16(upper, lower, number + 1u));
            below.left = colours_of_bytes16(words_in_window16(upper, lower, number + CASTOR_WINDOW_WIDTH));
            below.right = colours_of_bytes16(words_in_window16(upper, lower, number + (CASTOR_WINDOW_WIDTH + 1u)));
            return between_four16(above, below, x - convert_float16(cell_x), y - convert_float16(cell_y));
        }
    }
#endif
    return LANES(bilinear_texels_anywhere)(texels, format, width, height, wrap, x, y);
}

// Interpolates between two levels: `level` 0 is the picture itself, 1 half its size. `texels`: of level 0; `u`, `v`:
// wrapped.
CASTOR_INLINE LANES(Vectors)
    LANES(trilinear_texels)(const global uint *restrict texels, const global TextureImage *image, const uint wrap,
                            const Real u, const Real v, const Real level)
{
    const Real zero = (Real)(0.0f), last = (Real)(convert_float(image->level_count - 1u));
    const Real limited = level > 0.0f ? (level < last ? level : last) : zero;
    const Whole finer = LANES(convert_uint)(limited);
    const Real rest = limited - LANES(convert_float)(finer);
    const uint words = image->format == CASTOR_TEXELS_FLOATS ? 3u : 1u;
    LANES(Vectors) texel = LANES(vectors)(zero, zero, zero);
    // One level after another. Neighbours mostly have the same.
    const global uint *fine = texels;
    uint width = image->width, height = image->height;
    uint left = LANES(mask_of)(zero == zero);
    for (uint number = 0; left; ++number) {
        const Mask is_here = finer == number;
        const uint lanes = LANES(mask_of)(is_here);
        const uint half_width = max(width / 2u, 1u), half_height = max(height / 2u, 1u);
        const global uint *const coarse = fine + (size_t)words * width * height;
        if (lanes) {
            LANES(Vectors) here = LANES(bilinear_texels)(fine, image->format, width, height, wrap, u, v);
            // At the last level nothing is between.
            if (LANES(mask_of)(is_here & (rest != 0.0f)))
                here = LANES(between_texels)(
                    here, LANES(bilinear_texels)(coarse, image->format, half_width, half_height, wrap, u, v), rest);
            texel = LANES(choose_vectors)(is_here, here, texel);
            left &= ~lanes;
        }
        fine = coarse;
        width = half_width;
        height = half_height;
    }
    return texel;
}

// Returns texels at coordinates (u, v) as `filter` says; `level`: of trilinear textures alone. `texels`: of all
// pictures.
CASTOR_ONCE LANES(Vectors)
    LANES(filtered_texels)(const global uint *restrict texels, const global TextureImage *image, const uint filter,
                           const uint wrap, const Real u, const Real v, const Real level)
{
    const global uint *const first = texels + image->first_texel;
    const Real at_u = LANES(wrapped_coordinates)(u, CASTOR_WRAP_OF_U(wrap));
    const Real at_v = LANES(wrapped_coordinates)(v, CASTOR_WRAP_OF_V(wrap));
    if (filter == CASTOR_TEXTURE_NEAREST)
        return LANES(nearest_texels)(first, image->format, image->width, image->height, at_u, at_v);
    if (filter == CASTOR_TEXTURE_TRILINEAR) return LANES(trilinear_texels)(first, image, wrap, at_u, at_v, level);
    return LANES(bilinear_texels)(first, image->format, image->width, image->height, wrap, at_u, at_v);
}
