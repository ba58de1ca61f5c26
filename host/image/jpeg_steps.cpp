#include "image/jpeg_steps.h"

#include <algorithm>
#include <array>

namespace castor {

namespace {

std::uint8_t limited(std::int64_t value) {
    return static_cast<std::uint8_t>(std::clamp<std::int64_t>(value, 0, 255));
}

/// Divides by 2^bits and rounds.
std::int64_t scaled_down(std::int64_t value, int bits) {
    return (value + (std::int64_t{1} << (bits - 1))) >> bits;
}

// Constants are multiples of 2^-13, and what the columns give is kept in multiples of 1/4.
constexpr int kConstantBits = 13;
constexpr int kColumnBits = 2;

using Eight = std::array<std::int64_t, 8>;

/// Returns the inverse transform of eight coefficients, times the square root of 8, in multiples of 2^-13.
Eight transform(const Eight& in) {
    const std::int64_t rotated = (in[2] + in[6]) * 4433;
    const std::int64_t even2 = rotated - in[6] * 15137, even3 = rotated + in[2] * 6270;
    const std::int64_t even0 = (in[0] + in[4]) << kConstantBits, even1 = (in[0] - in[4]) << kConstantBits;
    const Eight even{even0 + even3, even1 + even2, even1 - even2, even0 - even3};

    const std::int64_t all = (in[7] + in[3] + in[5] + in[1]) * 9633;
    const std::int64_t outer = (in[7] + in[1]) * -7373, inner = (in[5] + in[3]) * -20995;
    const std::int64_t first = (in[7] + in[3]) * -16069 + all, second = (in[5] + in[1]) * -3196 + all;
    const Eight odd{in[1] * 12299 + outer + second, in[3] * 25172 + inner + first, in[5] * 16819 + inner + second,
                    in[7] * 2446 + outer + first};

    Eight out;
    for (std::size_t i = 0; i < 4; ++i) {
        out[i] = even[i] + odd[i];
        out[7 - i] = even[i] - odd[i];
    }
    return out;
}

}  // namespace

void jpeg_inverse_dct(std::uint8_t* out, int stride, short* coefficients) {
    std::array<Eight, 8> rows;
    for (std::size_t column = 0; column < 8; ++column) {
        Eight values;
        bool is_even = true;
        for (std::size_t row = 0; row < 8; ++row) {
            values[row] = coefficients[8 * row + column];
            is_even &= row == 0 || values[row] == 0;
        }
        if (is_even) {  // as most are
            for (Eight& row : rows) row[column] = values[0] << kColumnBits;
            continue;
        }
        values = transform(values);
        for (std::size_t row = 0; row < 8; ++row)
            rows[row][column] = scaled_down(values[row], kConstantBits - kColumnBits);
    }
    constexpr std::int64_t kMiddle = 128;
    for (const Eight& row : rows) {
        const Eight values = transform(row);
        for (std::size_t column = 0; column < 8; ++column)
            out[column] = limited(kMiddle + scaled_down(values[column], kConstantBits + kColumnBits + 3));
        out += stride;
    }
}

std::uint8_t* jpeg_double_row(std::uint8_t* out, std::uint8_t* near, std::uint8_t* far, int width, int /*factor*/) {
    const auto column = [&](int i) { return 3 * near[i] + far[i]; };  // 4 times the value
    for (int i = 0; i < width; ++i) {
        const int here = 3 * column(i), before = column(std::max(i - 1, 0)), after = column(std::min(i + 1, width - 1));
        out[2 * i] = static_cast<std::uint8_t>((here + before + 8) >> 4);
        out[2 * i + 1] = static_cast<std::uint8_t>((here + after + 7) >> 4);
    }
    return out;
}

void jpeg_rgb_row(std::uint8_t* out, const std::uint8_t* luma, const std::uint8_t* blue, const std::uint8_t* red,
                  int count, int step) {
    constexpr int kBits = 16;
    for (int i = 0; i < count; ++i, out += step) {
        const std::int64_t cb = blue[i] - 128, cr = red[i] - 128;
        out[0] = limited(luma[i] + scaled_down(91881 * cr, kBits));
        out[1] = limited(luma[i] + scaled_down(-22554 * cb - 46802 * cr, kBits));
        out[2] = limited(luma[i] + scaled_down(116130 * cb, kBits));
        if (step == 4) out[3] = 255;
    }
}

}  // namespace castor
