#pragma once

#include <cstdint>

namespace castor {

// The steps of decoding JPEG at which decoders round, each by its own rules. These round as the library of the
// Independent JPEG Group does by default, whose texels the course's pictures show. All are called by stb_image.

/// Turns the coefficients of a block of 8x8 values, row by row, into the values (ITU-T T.81, A.3.3), by the algorithm
/// of Loeffler, Ligtenberg and Moschytz 1989, "Practical Fast 1-D DCT Algorithms with 11 Multiplications". Rows of
/// `out` are `stride` bytes apart.
void jpeg_inverse_dct(std::uint8_t* out, int stride, short* coefficients);

/// Doubles the width and height of an image: returns one row of 2 `width` values, in `out`, between the rows `near` and
/// `far`, of which it is nearer to the former. `factor`, the horizontal one, is 2.
std::uint8_t* jpeg_double_row(std::uint8_t* out, std::uint8_t* near, std::uint8_t* far, int width, int factor);

/// Turns rows of `count` values of Y, Cb and Cr into RGB (T.871), `step` bytes each; of 4 bytes, the last one is 255.
void jpeg_rgb_row(std::uint8_t* out, const std::uint8_t* luma, const std::uint8_t* blue, const std::uint8_t* red,
                  int count, int step);

}  // namespace castor
