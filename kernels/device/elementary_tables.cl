// The constants and the table of elementary.lanes.cl.
#include "castor/shared/layout.h"

// Adding and subtracting it rounds a float of at most 2^22 in magnitude to the nearest integer.
#define CASTOR_ROUNDING_MAGIC 12582912.0f  // 1.5 * 2^23

// The largest argument of sine and cosine, in magnitude: their reduction is accurate so far.
#define CASTOR_LARGEST_ANGLE 1e5f

// clang-format off
// -log2(j/32) for j = 22 ... 46, then zeros: a multiple of 2^-15, and the rest.
constant float minus_log2_of_32nds_high[32] = {
    0.54055786f, 0.47644043f, 0.41503906f, 0.35614014f, 0.29956055f, 0.24511719f, 0.19265747f, 0.14202881f,
    0.09310913f, 0.045806885f, 0.0f, -0.044403076f, -0.08746338f, -0.12927246f, -0.16992188f, -0.20944214f,
    -0.2479248f, -0.2854004f, -0.32192993f, -0.35754395f, -0.39230347f, -0.42626953f, -0.45944214f, -0.4918518f,
    -0.5235596f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
constant float minus_log2_of_32nds_low[32] = {
    1.0520034e-05f, -2.3857444e-06f, -1.5632212e-06f, 3.6735066e-06f, -2.650161e-07f, -4.6896635e-06f,
    -1.2392761e-05f, -9.803722e-06f, 2.735321e-07f, -3.1951524e-06f, 0.0f, 8.956814e-06f, 5.376559e-07f,
    -1.05560075e-05f, -3.1264424e-06f, -1.1226957e-05f, -2.708756e-06f, -1.8282373e-06f, 1.8367533e-06f,
    -8.059305e-06f, -1.3955982e-05f, 4.776548e-06f, 1.0520034e-05f, -1.2896891e-06f, -2.3857444e-06f, 0.0f, 0.0f,
    0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
// clang-format on

// Return the entries `index` of a table of 32.
CASTOR_INLINE float look_up(constant float *table, const uint index) { return table[index % 32u]; }

CASTOR_INLINE float4 look_up4(constant float *table, const uint4 index)
{
    const uint4 i = index % 32u;
    return (float4)(table[i.x], table[i.y], table[i.z], table[i.w]);
}

CASTOR_INLINE float16 look_up16(constant float *table, const uint16 index)
{
#if defined(__AVX512F__)
    typedef __attribute__((__vector_size__(64))) float float16_of_gcc;
    typedef __attribute__((__vector_size__(64))) int int16_of_gcc;
    return as_float16(__builtin_ia32_vpermi2varps512((float16_of_gcc)vload16(0, table), (int16_of_gcc)as_int16(index),
                                                     (float16_of_gcc)vload16(1, table)));
#else
    return (float16)(look_up4(table, index.s0123), look_up4(table, index.s4567), look_up4(table, index.s89ab),
                     look_up4(table, index.scdef));
#endif
}
