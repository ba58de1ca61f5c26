// Directions to an environment, drawn as its picture's light is distributed, for CASTOR_LANES lanes (see lanes.cl).
//
// A table (host/scene/environment_table.h) cuts the light into equal parts, of which each cell of the picture, a square
// of texels, has some. A random part chooses the cell, down a tree of 2 x 2 choices with whole numbers for thresholds:
// every device chooses the same. (McCool, Harwood 1997, "Probability Trees"; Clarberg and others 2005, "Wavelet
// Importance Sampling".) Parts are not divided on the way down, so that what is left of the random number is exact.
//
// All texels of a cell are as probable. Within a texel, directions are drawn uniformly by solid angle where the mapping
// is latlong, and by the picture's area where it is probe. So the density is a function of cell and row, or of cell and
// angle, which density_of_texels gives for any direction.
#include "device/curve.lanes.cl"
#include "device/elementary.lanes.cl"
#include "device/environment_table.cl"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

// Directions to points of a picture.
typedef struct LANES(PictureDirections) {
    LANES(Vectors) direction;  // unit
    Real density;              // with which the direction was drawn, by solid angle; 0: there is none
} LANES(PictureDirections);

// Cells, and what is left of the random numbers.
typedef struct LANES(ChosenCells) {
    Whole x, y;
    Whole part_count;  // of the cell
    Real across;       // in [0, 1]
} LANES(ChosenCells);

// Undoes spread_bits, whatever the bits between are.
CASTOR_INLINE Whole LANES(gathered_bits)(Whole x)
{
    x &= 0x55555555u;
    x = (x | (x >> 1u)) & 0x33333333u;
    x = (x | (x >> 2u)) & 0x0f0f0f0fu;
    x = (x | (x >> 4u)) & 0x00ff00ffu;
    return (x | (x >> 8u)) & 0x0000ffffu;
}

// Returns the numbers of cells: squares of cells one after the other, in each the order of a Z curve.
CASTOR_INLINE Whole LANES(cell_numbers)(const EnvironmentTable table, const Whole x, const Whole y)
{
    const uint bits = min(table.across_bits, table.down_bits);
    const uint low = (1u << bits) - 1u;
    const Whole square = (x >> bits) | (y >> bits);  // one of both is 0
    return (square << (2u * bits)) | LANES(spread_bits)(x & low) | (LANES(spread_bits)(y & low) << 1u);
}

// `at`: of the unit square, multiples of 2^-24.
CASTOR_INLINE LANES(ChosenCells) LANES(choose_cells)(const EnvironmentTable table, const LANES(Points) at)
{
    const Whole part = LANES(convert_uint)(at.x * (float)CASTOR_EMITTER_PARTS);
    const uint all_bits = table.across_bits + table.down_bits;
    Whole number = (Whole)(0), begin = (Whole)(0), end = (Whole)(CASTOR_EMITTER_PARTS);
    const global uint *level = table.tree;
    for (uint below = max((all_bits + 1u) / 2u, 1u); below-- > 0;) {
        const LANES(Rows) row = LANES(gather_rows)((const global float4 *)level, number);
        const Whole first = LANES(as_uint)(row.x), second = LANES(as_uint)(row.y), third = LANES(as_uint)(row.z),
                    fourth = LANES(as_uint)(row.w);
        const Mask is_second = part >= second, is_third = part >= third, is_fourth = part >= fourth;
        begin = is_fourth ? fourth : (is_third ? third : (is_second ? second : first));
        end = is_fourth ? end : (is_third ? fourth : (is_second ? third : second));
        const Whole child = is_fourth ? (Whole)(3) : (is_third ? (Whole)(2) : (is_second ? (Whole)(1) : (Whole)(0)));
        number = (number << 2u) | child;
        level += max(1u << (all_bits - 2u * below), 4u);
    }
    LANES(ChosenCells) cell;
    cell.part_count = end - begin;
    const Whole low_bits = LANES(convert_uint)(at.y * (float)CASTOR_EMITTER_PARTS) & 4095u;
    const Real rest = fma(LANES(convert_float)(low_bits) + 0.5f, (Real)(0x1p-12f), LANES(convert_float)(part - begin));
    cell.across = LANES(divide)(rest, LANES(convert_float)(cell.part_count));
    const uint bits = min(table.across_bits, table.down_bits);
    const Whole square = (number >> (2u * bits)) << bits;
    const Whole in_square = number & ((1u << (2u * bits)) - 1u);
    cell.x = LANES(gathered_bits)(in_square) | (table.across_bits > bits ? square : (Whole)(0));
    cell.y = LANES(gathered_bits)(in_square >> 1u) | (table.down_bits > bits ? square : (Whole)(0));
    return cell;
}

// Returns how many texels cells have along an axis of the picture of so many texels.
CASTOR_INLINE Real LANES(texels_of_cells)(const EnvironmentTable table, const Whole cell, const uint size)
{
    return LANES(convert_float)(min((Whole)(1u << table.texel_bits), size - (cell << table.texel_bits)));
}

// Returns how many rows lie between rows of a latlong picture and the nearer pole.
CASTOR_INLINE Whole LANES(rows_to_pole)(const Whole y, const uint height) { return min(y, height - 1u - y); }

// Returns the density, by solid angle, of directions to these texels of a latlong picture, which are in cells with so
// many parts. From a row's upper edge to its lower one, sin^2 of half the angle from the pole grows by the sine in its
// middle times `half_row`, the sine of half of its height.
CASTOR_INLINE Real LANES(density_of_rows)(const EnvironmentTable table, const TextureImage image, const Whole x,
                                          const Whole y, const Real part_count)
{
    const float height = (float)image.height;
    const Real middle =
        fma((Real)(3.1415927f), LANES(convert_float)(LANES(rows_to_pole)(y, image.height)), (Real)(1.5707964f));
    const Real sine_of_row = LANES(sine)(LANES(divide)(middle, (Real)(height)));
    const Real half_row = LANES(sine)(LANES(divide)((Real)(1.5707964f), (Real)(height)));
    const Real texels = LANES(texels_of_cells)(table, x >> table.texel_bits, image.width) *
                        LANES(texels_of_cells)(table, y >> table.texel_bits, image.height);
    const Real parts_of_texel = LANES(divide)(part_count * ((float)image.width * 0x1p-24f), texels);
    return LANES(divide)(parts_of_texel, 12.566371f * half_row * sine_of_row);
}

// Returns the density of directions at an angle of pi * radius from the axis of a probe. `widening`: the sine of this
// angle / radius.
CASTOR_INLINE Real LANES(density_of_disk)(const EnvironmentTable table, const TextureImage image, const Whole x,
                                          const Whole y, const Real part_count, const Real widening)
{
    const Real texels = LANES(texels_of_cells)(table, x >> table.texel_bits, image.width) *
                        LANES(texels_of_cells)(table, y >> table.texel_bits, image.height);
    const Real parts_of_area =
        LANES(divide)(part_count * ((float)image.width * (float)image.height * 0x1p-24f), texels);
    const Mask is_wide = widening > 0.0f;
    const Real density = LANES(divide)(parts_of_area, 12.566371f * (is_wide ? widening : (Real)(1.0f)));
    return is_wide ? density : (Real)(0.0f);
}

// Returns the density with which draw_directions draws unit directions, which lie in these texels.
CASTOR_INLINE Real LANES(density_of_texels)(const EnvironmentTable table, const uint mapping, const TextureImage image,
                                            const Whole x, const Whole y, const LANES(Vectors) direction)
{
    const Whole cell = LANES(cell_numbers)(table, x >> table.texel_bits, y >> table.texel_bits);
    const LANES(WholeTwos) parts = LANES(gather_whole_twos)(table.parts, cell, 1);
    const Real part_count = LANES(convert_float)(parts.y - parts.x);
    if (mapping == CASTOR_ENVIRONMENT_LATLONG) return LANES(density_of_rows)(table, image, x, y, part_count);
    const Real sin_angle = LANES(square_root)(fma(direction.x, direction.x, direction.y * direction.y));
    const Real radius = 0.31830987f * LANES(arc_tangent2)(sin_angle, -direction.z);
    const Mask is_on_axis = !(radius > 0.0f);
    const Real widening =
        is_on_axis ? (Real)(3.1415927f) : LANES(divide)(sin_angle, is_on_axis ? (Real)(1.0f) : radius);
    return LANES(density_of_disk)(table, image, x, y, part_count, widening);
}

// Draws directions. `at`: of the unit square, multiples of 2^-24. Some points of a probe have none.
CASTOR_INLINE LANES(PictureDirections) LANES(draw_directions)(const EnvironmentTable table, const uint mapping,
                                                              const TextureImage image, const LANES(Points) at)
{
    const Real one = (Real)(1.0f);
    const float width = (float)image.width, height = (float)image.height;
    const LANES(ChosenCells) cell = LANES(choose_cells)(table, at);
    const Real texels_across = LANES(texels_of_cells)(table, cell.x, image.width);
    const Real texels_down = LANES(texels_of_cells)(table, cell.y, image.height);
    const Real across = cell.across * texels_across, down = at.y * texels_down;
    const Real column = LANES(smaller)(LANES(rounded_down)(across), texels_across - 1.0f);
    const Real row = LANES(smaller)(LANES(rounded_down)(down), texels_down - 1.0f);
    const Whole texel_x = (cell.x << table.texel_bits) + LANES(convert_uint)(column);
    const Whole texel_y = (cell.y << table.texel_bits) + LANES(convert_uint)(row);
    const Real part_count = LANES(convert_float)(cell.part_count);
    LANES(PictureDirections) drawn;
    // From the picture's middle: to the right, and down.
    const Real right = (LANES(convert_float)(texel_x) - 0.5f * width) + (across - column);
    if (mapping == CASTOR_ENVIRONMENT_LATLONG) {
        const Mask is_lower = 2u * texel_y >= (Whole)(image.height);
        const Real from_pole = is_lower ? (row + 1.0f) - down : down - row;  // in its row
        const Real half_row = LANES(divide)((Real)(1.5707964f), (Real)(height));
        const Real edge = LANES(convert_float)(LANES(rows_to_pole)(texel_y, image.height)) * half_row;
        const Real sine_of_edge = LANES(sine)(edge);
        const Real growth = LANES(sine)(fma((Real)(2.0f), edge, half_row)) * LANES(sine)(half_row);
        const Real squared = LANES(smaller)(fma(from_pole, growth, sine_of_edge * sine_of_edge), one);
        const Real cos_angle = fma((Real)(-2.0f), squared, one);
        const Real sin_angle = 2.0f * LANES(square_root)(squared * (1.0f - squared));
        const Real turn = LANES(divide)(6.2831855f * right, (Real)(width));
        drawn.direction = LANES(vectors)(sin_angle * LANES(sine)(turn), is_lower ? -cos_angle : cos_angle,
                                         -sin_angle * LANES(cosine)(turn));
        drawn.density = LANES(density_of_rows)(table, image, texel_x, texel_y, part_count);
        return drawn;
    }
    const Real below = (LANES(convert_float)(texel_y) - 0.5f * height) + (down - row);
    const Real x = LANES(divide)(2.0f * right, (Real)(width)), y = LANES(divide)(-2.0f * below, (Real)(height));
    const Real radius = LANES(square_root)(fma(x, x, y * y));
    const Mask is_direction = radius < 1.0f, is_on_axis = !(radius > 0.0f);
    const Real from_axis = LANES(smaller)(radius, one), from_back = 1.0f - from_axis;
    const Real sin_angle = LANES(sine)(3.1415927f * LANES(smaller)(from_axis, from_back));
    const Real quotient = LANES(divide)(sin_angle, is_on_axis ? one : radius);
    const Real widening = is_on_axis ? (Real)(3.1415927f) : quotient;
    drawn.direction = LANES(vectors)(widening * x, widening * y, -LANES(cosine)(3.1415927f * from_axis));
    const Real density = LANES(density_of_disk)(table, image, texel_x, texel_y, part_count, widening);
    drawn.density = is_direction ? density : (Real)(0.0f);
    return drawn;
}
