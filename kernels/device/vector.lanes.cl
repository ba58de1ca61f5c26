// Vectors of three components for CASTOR_LANES lanes (see lanes.cl), each component of all lanes side by side. Written
// out, as in vector.cl: dot(), length() and normalize() may round differently on each device.
#include "device/rows.lanes.cl"
#include "device/simd.lanes.cl"

typedef struct LANES(Vectors) {
    Real x, y, z;
} LANES(Vectors);

CASTOR_INLINE LANES(Vectors) LANES(vectors)(const Real x, const Real y, const Real z)
{
    LANES(Vectors) v;
    v.x = x;
    v.y = y;
    v.z = z;
    return v;
}

// Returns three floats, in every lane.
CASTOR_INLINE LANES(Vectors) LANES(same_vectors)(const float *const a)
{
    return LANES(vectors)((Real)(a[0]), (Real)(a[1]), (Real)(a[2]));
}

CASTOR_INLINE LANES(Vectors) LANES(sum_of_vectors)(const LANES(Vectors) a, const LANES(Vectors) b)
{
    return LANES(vectors)(a.x + b.x, a.y + b.y, a.z + b.z);
}

CASTOR_INLINE LANES(Vectors) LANES(difference_of_vectors)(const LANES(Vectors) a, const LANES(Vectors) b)
{
    return LANES(vectors)(a.x - b.x, a.y - b.y, a.z - b.z);
}

// Multiplies component by component.
CASTOR_INLINE LANES(Vectors) LANES(product_of_vectors)(const LANES(Vectors) a, const LANES(Vectors) b)
{
    return LANES(vectors)(a.x * b.x, a.y * b.y, a.z * b.z);
}

CASTOR_INLINE LANES(Vectors) LANES(scaled_vectors)(const LANES(Vectors) a, const Real factor)
{
    return LANES(vectors)(a.x * factor, a.y * factor, a.z * factor);
}

// Chooses lane by lane.
CASTOR_INLINE LANES(Vectors) LANES(choose_vectors)(const Mask is_a, const LANES(Vectors) a, const LANES(Vectors) b)
{
    return LANES(vectors)(is_a ? a.x : b.x, is_a ? a.y : b.y, is_a ? a.z : b.z);
}

CASTOR_INLINE Real LANES(dot_products)(const LANES(Vectors) a, const LANES(Vectors) b)
{
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

CASTOR_INLINE LANES(Vectors) LANES(cross_products)(const LANES(Vectors) a, const LANES(Vectors) b)
{
    return LANES(vectors)(fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x)));
}

CASTOR_INLINE Real LANES(largest_of)(const LANES(Vectors) v) { return LANES(larger)(v.x, LANES(larger)(v.y, v.z)); }

// Returns vectors of length 1; (0,0,0) stays (0,0,0).
CASTOR_INLINE LANES(Vectors) LANES(normalized_vectors)(const LANES(Vectors) a)
{
    const Real length_of_a = LANES(square_root)(LANES(dot_products)(a, a));
    const Mask has_length = length_of_a > 0.0f;
    const Real inverse = LANES(divide)((Real)(1.0f), has_length ? length_of_a : (Real)(1.0f));
    const Real zero = (Real)(0.0f);
    return LANES(vectors)(has_length ? a.x * inverse : zero, has_length ? a.y * inverse : zero,
                          has_length ? a.z * inverse : zero);
}

// Returns origin + t * direction.
CASTOR_INLINE LANES(Vectors)
    LANES(points_on_rays)(const LANES(Vectors) origin, const Real t, const LANES(Vectors) direction)
{
    return LANES(vectors)(fma(t, direction.x, origin.x), fma(t, direction.y, origin.y), fma(t, direction.z, origin.z));
}

// Gather elements number * stride, a number for each lane. The product may exceed 32 bits.
CASTOR_INLINE Whole LANES(gather_wholes)(const global uint *column, const Whole number, const uint stride)
{
#if CASTOR_LANES == 1
    return column[(size_t)stride * number];
#elif CASTOR_LANES == 16
    return (Whole)(column[(size_t)stride * number.s0], column[(size_t)stride * number.s1],
                   column[(size_t)stride * number.s2], column[(size_t)stride * number.s3],
                   column[(size_t)stride * number.s4], column[(size_t)stride * number.s5],
                   column[(size_t)stride * number.s6], column[(size_t)stride * number.s7],
                   column[(size_t)stride * number.s8], column[(size_t)stride * number.s9],
                   column[(size_t)stride * number.sa], column[(size_t)stride * number.sb],
                   column[(size_t)stride * number.sc], column[(size_t)stride * number.sd],
                   column[(size_t)stride * number.se], column[(size_t)stride * number.sf]);
#endif
}

CASTOR_INLINE Real LANES(gather_reals)(const global float *column, const Whole number, const uint stride)
{
    return LANES(as_float)(LANES(gather_wholes)((const global uint *)column, number, stride));
}

typedef struct LANES(Twos) {
    Real x, y;
} LANES(Twos);

CASTOR_INLINE LANES(Twos) LANES(choose_twos)(const Mask is_a, const LANES(Twos) a, const LANES(Twos) b)
{
    const LANES(Twos) two = {is_a ? a.x : b.x, is_a ? a.y : b.y};
    return two;
}

typedef struct LANES(WholeTwos) {
    Whole x, y;
} LANES(WholeTwos);

// Gather elements number * stride, and those that follow each.
CASTOR_INLINE LANES(WholeTwos)
    LANES(gather_whole_twos)(const global uint *column, const Whole number, const uint stride)
{
    LANES(WholeTwos) two;
#if CASTOR_LANES == 16
    const Whole lower =
        (Whole)(vload2(0, column + (size_t)stride * number.s0), vload2(0, column + (size_t)stride * number.s1),
                vload2(0, column + (size_t)stride * number.s2), vload2(0, column + (size_t)stride * number.s3),
                vload2(0, column + (size_t)stride * number.s4), vload2(0, column + (size_t)stride * number.s5),
                vload2(0, column + (size_t)stride * number.s6), vload2(0, column + (size_t)stride * number.s7));
    const Whole upper =
        (Whole)(vload2(0, column + (size_t)stride * number.s8), vload2(0, column + (size_t)stride * number.s9),
                vload2(0, column + (size_t)stride * number.sa), vload2(0, column + (size_t)stride * number.sb),
                vload2(0, column + (size_t)stride * number.sc), vload2(0, column + (size_t)stride * number.sd),
                vload2(0, column + (size_t)stride * number.se), vload2(0, column + (size_t)stride * number.sf));
    two.x = (Whole)(lower.even, upper.even);
    two.y = (Whole)(lower.odd, upper.odd);
#else
    two.x = LANES(gather_wholes)(column, number, stride);
    two.y = LANES(gather_wholes)(column + 1, number, stride);
#endif
    return two;
}

CASTOR_INLINE LANES(Vectors) LANES(vectors_of_rows)(const LANES(Rows) rows)
{
    return LANES(vectors)(rows.x, rows.y, rows.z);
}

CASTOR_INLINE LANES(Vectors) LANES(load_vectors)(const global float4 *at)
{
    return LANES(vectors_of_rows)(LANES(load_rows)(at));
}

CASTOR_INLINE LANES(Vectors) LANES(gather_vectors)(const global float4 *rows, const Whole number)
{
    return LANES(vectors_of_rows)(LANES(gather_rows)(rows, number));
}

// The same of a column that has three floats, and not four, for each vector.
CASTOR_INLINE LANES(Vectors) LANES(gather_threes)(const global float *threes, const Whole number)
{
    return LANES(vectors)(LANES(gather_reals)(threes, number, 3), LANES(gather_reals)(threes + 1, number, 3),
                          LANES(gather_reals)(threes + 2, number, 3));
}

CASTOR_INLINE void LANES(store_vectors)(const LANES(Vectors) v, global float4 *at)
{
    LANES(store_rows)(v.x, v.y, v.z, (Real)(0.0f), at);
}

// Stores what counts, at rows with a number each.
CASTOR_INLINE void LANES(scatter_rows)(const Real x, const Real y, const Real z, const Real w, const Whole number,
                                       const Mask counts, global float4 *rows)
{
#if CASTOR_LANES == 1
    if (counts) rows[number] = (float4)(x, y, z, w);
#else
    float4 values[CASTOR_LANES];
    uint numbers[CASTOR_LANES];
    LANES(store_private_rows)(x, y, z, w, values);
    LANES(store_wholes)(number, numbers);
    for (uint left = LANES(mask_of)(counts); left; left &= left - 1)
        rows[numbers[lowest_bit(left)]] = values[lowest_bit(left)];
#endif
}

CASTOR_INLINE void LANES(scatter_vectors)(const LANES(Vectors) v, const Whole number, const Mask counts,
                                          global float4 *rows)
{
    LANES(scatter_rows)(v.x, v.y, v.z, (Real)(0.0f), number, counts, rows);
}

// The same for whole numbers.
CASTOR_INLINE void LANES(scatter_wholes)(const Whole value, const Whole number, const Mask counts, global uint *column)
{
#if CASTOR_LANES == 1
    if (counts) column[number] = value;
#else
    uint values[CASTOR_LANES], numbers[CASTOR_LANES];
    LANES(store_wholes)(value, values);
    LANES(store_wholes)(number, numbers);
    for (uint left = LANES(mask_of)(counts); left; left &= left - 1)
        column[numbers[lowest_bit(left)]] = values[lowest_bit(left)];
#endif
}
