// Rows of four floats, as buffers hold them, for CASTOR_LANES lanes (see lanes.cl): 1, 8 or 16.
#include "device/simd.lanes.cl"

typedef struct LANES(Rows) {
    Real x, y, z, w;
} LANES(Rows);

// Load a row for each lane: those that follow one another, or those with a number each.
#if CASTOR_LANES == 1
CASTOR_INLINE Rows load_rows(const global float4 *at)
{
    const float4 row = *at;
    Rows rows = {row.x, row.y, row.z, row.w};
    return rows;
}
CASTOR_INLINE Rows gather_rows(const global float4 *rows, const uint number) { return load_rows(rows + number); }
#elif CASTOR_LANES == 8
#define CASTOR_COLUMN_OF_ROWS(r, c) (float8)(r[0].c, r[1].c, r[2].c, r[3].c, r[4].c, r[5].c, r[6].c, r[7].c)
CASTOR_INLINE Rows8 rows_of_array8(const float4 *array)
{
    Rows8 rows;
    rows.x = CASTOR_COLUMN_OF_ROWS(array, x);
    rows.y = CASTOR_COLUMN_OF_ROWS(array, y);
    rows.z = CASTOR_COLUMN_OF_ROWS(array, z);
    rows.w = CASTOR_COLUMN_OF_ROWS(array, w);
    return rows;
}
#elif CASTOR_LANES == 16
// Returns the sixteen rows that stand in four vectors, four in each.
CASTOR_INLINE Rows16 rows_of_vectors16(const float16 a, const float16 b, const float16 c, const float16 d)
{
    Rows16 rows;
#if defined(__AVX512F__)
    // The compiler's own permutations are more.
    const uint16 two_columns = (uint16)(0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29);
    const float16 low_xy = permute_two_16(a, b, two_columns), high_xy = permute_two_16(c, d, two_columns);
    const float16 low_zw = permute_two_16(a, b, two_columns + 2u), high_zw = permute_two_16(c, d, two_columns + 2u);
    rows.x = (float16)(low_xy.lo, high_xy.lo);
    rows.y = (float16)(low_xy.hi, high_xy.hi);
    rows.z = (float16)(low_zw.lo, high_zw.lo);
    rows.w = (float16)(low_zw.hi, high_zw.hi);
#else
    rows.x = (float16)(a.s048c, b.s048c, c.s048c, d.s048c);
    rows.y = (float16)(a.s159d, b.s159d, c.s159d, d.s159d);
    rows.z = (float16)(a.s26ae, b.s26ae, c.s26ae, d.s26ae);
    rows.w = (float16)(a.s37bf, b.s37bf, c.s37bf, d.s37bf);
#endif
    return rows;
}
CASTOR_INLINE Rows16 load_rows16(const global float4 *at)
{
    const global float *const floats = (const global float *)at;
    return rows_of_vectors16(vload16(0, floats), vload16(1, floats), vload16(2, floats), vload16(3, floats));
}
CASTOR_INLINE Rows16 gather_rows16(const global float4 *rows, const uint16 number)
{
    return rows_of_vectors16((float16)(rows[number.s0], rows[number.s1], rows[number.s2], rows[number.s3]),
                             (float16)(rows[number.s4], rows[number.s5], rows[number.s6], rows[number.s7]),
                             (float16)(rows[number.s8], rows[number.s9], rows[number.sa], rows[number.sb]),
                             (float16)(rows[number.sc], rows[number.sd], rows[number.se], rows[number.sf]));
}
#endif

// Returns one row, in every lane.
CASTOR_INLINE LANES(Rows) LANES(same_rows)(const float4 row)
{
    LANES(Rows) rows;
    rows.x = (Real)(row.x);
    rows.y = (Real)(row.y);
    rows.z = (Real)(row.z);
    rows.w = (Real)(row.w);
    return rows;
}
