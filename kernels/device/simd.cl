// Operations on vectors within one work-item that OpenCL C lacks, or defines loosely. A CPU's device compiler does not
// vectorise a traversal over work-items, so its vectors are written out. The names fit LANES (lanes.cl).
#include "castor/shared/layout.h"
#include "device/exact.cl"

// CASTOR_REGISTERS_OF_16  1: a register holds 16 floats, so that what is done with as many is worth more than with 8
#ifndef CASTOR_REGISTERS_OF_16
#if defined(__AVX512F__)
#define CASTOR_REGISTERS_OF_16 1
#else
#define CASTOR_REGISTERS_OF_16 0
#endif
#endif

CASTOR_INLINE uint mask_of(const int is_true) { return is_true ? 1 : 0; }

// Returns a number whose bit i is set where component i of a comparison's result is true.
CASTOR_INLINE uint mask_of4(const int4 is_true)
{
#if defined(__SSE__)
    return (uint)__builtin_ia32_movmskps((__attribute__((__vector_size__(16))) float)as_float4(is_true));
#else
    const int4 bits = is_true & (int4)(1, 2, 4, 8);
    return (uint)((bits.x | bits.y) | (bits.z | bits.w));
#endif
}

CASTOR_INLINE uint mask_of8(const int8 is_true)
{
#if defined(__AVX512DQ__) && defined(__AVX512VL__)
    return (uchar)__builtin_ia32_cvtd2mask256((__attribute__((__vector_size__(32))) int)is_true);
#elif defined(__AVX__)
    return (uint)__builtin_ia32_movmskps256((__attribute__((__vector_size__(32))) float)as_float8(is_true));
#else
    return mask_of4(is_true.lo) | mask_of4(is_true.hi) << 4;
#endif
}

CASTOR_INLINE uint mask_of16(const int16 is_true)
{
#if defined(__AVX512DQ__)
    return (ushort)__builtin_ia32_cvtd2mask512((__attribute__((__vector_size__(64))) int)is_true);
#else
    return mask_of8(is_true.lo) | mask_of8(is_true.hi) << 8;
#endif
}

// Returns which lanes' bits are set.
CASTOR_INLINE int16 lanes_of_mask16(const uint mask)
{
    return (((int16)(1) << (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)) & (int)mask) != 0;
}

// Returns the number of the lowest set bit of `mask`, which is not zero.
CASTOR_INLINE uint lowest_bit(const uint mask)
{
#if defined(__SSE__)
    return (uint)__builtin_ctz(mask);
#else
    return 31u - clz(mask & (0u - mask));
#endif
}

// Return the number of each lane.
CASTOR_INLINE uint lane_numbers(void) { return 0; }
CASTOR_INLINE uint8 lane_numbers8(void) { return (uint8)(0, 1, 2, 3, 4, 5, 6, 7); }
CASTOR_INLINE uint16 lane_numbers16(void) { return (uint16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15); }

// Store sixteen numbers, one after the other, in private memory and in a buffer. PoCL 3.1 takes vstore16 apart: three
// or four stores of a register, and who loads all sixteen soon afterwards waits until the cache has every one.
#if defined(__SSE__)
typedef float16 UnalignedFloat16 __attribute__((aligned(4)));
typedef uint16 UnalignedUint16 __attribute__((aligned(4)));
CASTOR_INLINE void store_reals16(const float16 value, float *at) { *(UnalignedFloat16 *)at = value; }
CASTOR_INLINE void store_wholes16(const uint16 value, uint *at) { *(UnalignedUint16 *)at = value; }
CASTOR_INLINE void store_real_column16(const float16 value, global float *at)
{
    *(global UnalignedFloat16 *)at = value;
}
CASTOR_INLINE void store_whole_column16(const uint16 value, global uint *at) { *(global UnalignedUint16 *)at = value; }
#else
CASTOR_INLINE void store_reals16(const float16 value, float *at) { vstore16(value, 0, at); }
CASTOR_INLINE void store_wholes16(const uint16 value, uint *at) { vstore16(value, 0, at); }
CASTOR_INLINE void store_real_column16(const float16 value, global float *at) { vstore16(value, 0, at); }
CASTOR_INLINE void store_whole_column16(const uint16 value, global uint *at) { vstore16(value, 0, at); }
#endif

#if defined(__AVX512F__)
// Returns by % 32 < 16 ? a[by % 16] : b[by % 16], component by component.
CASTOR_INLINE float16 permute_two_16(const float16 a, const float16 b, const uint16 by)
{
    typedef __attribute__((__vector_size__(64))) int int16_of_gcc;
    typedef __attribute__((__vector_size__(64))) float float16_of_gcc;
    return as_float16(__builtin_ia32_vpermi2varps512((float16_of_gcc)a, (int16_of_gcc)as_int16(by), (float16_of_gcc)b));
}
#endif

// Returns the components that `mask` has as bits, one after the other, then zeros.
CASTOR_INLINE uint16 some_side_by_side_16(const uint16 v, const uint mask)
{
#if defined(__AVX512F__)
    typedef __attribute__((__vector_size__(64))) int int16_of_gcc;
    return as_uint16(
        __builtin_ia32_compresssi512_mask((int16_of_gcc)as_int16(v), (int16_of_gcc)(int16)(0), (ushort)mask));
#else
    uint all[16], some[16] = {0};
    store_wholes16(v, all);
    for (uint left = mask, i = 0; left; left &= left - 1, ++i) some[i] = all[lowest_bit(left)];
    return vload16(0, some);
#endif
}

// Returns v[by % 16], component by component.
CASTOR_INLINE float16 permute_16(const float16 v, const uint16 by)
{
#if defined(__AVX512F__)
    typedef __attribute__((__vector_size__(64))) int int16_of_gcc;
    typedef __attribute__((__vector_size__(64))) float float16_of_gcc;
    return as_float16(__builtin_ia32_permvarsf512((float16_of_gcc)v, (int16_of_gcc)as_int16(by)));
#else
    float from[16], to[16];
    uint places[16];
    store_reals16(v, from);
    store_wholes16(by, places);
    for (uint i = 0; i < 16; ++i) to[i] = from[places[i] & 15u];
    return vload16(0, to);
#endif
}

// Store (x, y, z, w) of each lane as a row of its own.
CASTOR_INLINE void store_rows(const float x, const float y, const float z, const float w, global float4 *rows)
{
    *rows = (float4)(x, y, z, w);
}

#if defined(__AVX512F__)
// Returns the sixteen rows side by side. The compiler's own permutations are three times as many.
CASTOR_INLINE void rows_side_by_side16(const float16 x, const float16 y, const float16 z, const float16 w,
                                       float16 *four_rows)
{
    const uint16 low_singles = (uint16)(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const uint16 low_pairs = (uint16)(0, 1, 16, 17, 2, 3, 18, 19, 4, 5, 20, 21, 6, 7, 22, 23);
    const float16 low_xy = permute_two_16(x, y, low_singles), high_xy = permute_two_16(x, y, low_singles + 8u);
    const float16 low_zw = permute_two_16(z, w, low_singles), high_zw = permute_two_16(z, w, low_singles + 8u);
    four_rows[0] = permute_two_16(low_xy, low_zw, low_pairs);
    four_rows[1] = permute_two_16(low_xy, low_zw, low_pairs + 8u);
    four_rows[2] = permute_two_16(high_xy, high_zw, low_pairs);
    four_rows[3] = permute_two_16(high_xy, high_zw, low_pairs + 8u);
}

CASTOR_INLINE void store_rows16(const float16 x, const float16 y, const float16 z, const float16 w, global float4 *rows)
{
    float16 four_rows[4];
    rows_side_by_side16(x, y, z, w, four_rows);
    global float *const at = (global float *)rows;
    store_real_column16(four_rows[0], at);
    store_real_column16(four_rows[1], at + 16);
    store_real_column16(four_rows[2], at + 32);
    store_real_column16(four_rows[3], at + 48);
}

// The same in private memory.
CASTOR_INLINE void store_private_rows16(const float16 x, const float16 y, const float16 z, const float16 w,
                                        float4 *rows)
{
    float16 four_rows[4];
    rows_side_by_side16(x, y, z, w, four_rows);
    float *const at = (float *)rows;
    store_reals16(four_rows[0], at);
    store_reals16(four_rows[1], at + 16);
    store_reals16(four_rows[2], at + 32);
    store_reals16(four_rows[3], at + 48);
}
#else
CASTOR_INLINE void store_rows4(const float4 x, const float4 y, const float4 z, const float4 w, global float4 *rows)
{
    rows[0] = (float4)(x.x, y.x, z.x, w.x);
    rows[1] = (float4)(x.y, y.y, z.y, w.y);
    rows[2] = (float4)(x.z, y.z, z.z, w.z);
    rows[3] = (float4)(x.w, y.w, z.w, w.w);
}

CASTOR_INLINE void store_rows16(const float16 x, const float16 y, const float16 z, const float16 w, global float4 *rows)
{
    store_rows4(x.s0123, y.s0123, z.s0123, w.s0123, rows);
    store_rows4(x.s4567, y.s4567, z.s4567, w.s4567, rows + 4);
    store_rows4(x.s89ab, y.s89ab, z.s89ab, w.s89ab, rows + 8);
    store_rows4(x.scdef, y.scdef, z.scdef, w.scdef, rows + 12);
}

// The same in private memory.
CASTOR_INLINE void store_private_rows4(const float4 x, const float4 y, const float4 z, const float4 w, float4 *rows)
{
    rows[0] = (float4)(x.x, y.x, z.x, w.x);
    rows[1] = (float4)(x.y, y.y, z.y, w.y);
    rows[2] = (float4)(x.z, y.z, z.z, w.z);
    rows[3] = (float4)(x.w, y.w, z.w, w.w);
}

CASTOR_INLINE void store_private_rows16(const float16 x, const float16 y, const float16 z, const float16 w,
                                        float4 *rows)
{
    store_private_rows4(x.s0123, y.s0123, z.s0123, w.s0123, rows);
    store_private_rows4(x.s4567, y.s4567, z.s4567, w.s4567, rows + 4);
    store_private_rows4(x.s89ab, y.s89ab, z.s89ab, w.s89ab, rows + 8);
    store_private_rows4(x.scdef, y.scdef, z.scdef, w.scdef, rows + 12);
}
#endif

// Divides, correctly rounded lane by lane, as exact.cl does for one lane.
CASTOR_INLINE float4 divide4(const float4 a, const float4 b)
{
#if CASTOR_CORRECTLY_ROUNDED
    return a / b;
#else
    return (float4)(divide(a.x, b.x), divide(a.y, b.y), divide(a.z, b.z), divide(a.w, b.w));
#endif
}

CASTOR_INLINE float8 divide8(const float8 a, const float8 b)
{
#if CASTOR_CORRECTLY_ROUNDED
    return a / b;
#else
    return (float8)(divide(a.s0, b.s0), divide(a.s1, b.s1), divide(a.s2, b.s2), divide(a.s3, b.s3), divide(a.s4, b.s4),
                    divide(a.s5, b.s5), divide(a.s6, b.s6), divide(a.s7, b.s7));
#endif
}

CASTOR_INLINE float16 divide16(const float16 a, const float16 b)
{
#if CASTOR_CORRECTLY_ROUNDED
    return a / b;
#else
    return (float16)(divide4(a.s0123, b.s0123), divide4(a.s4567, b.s4567), divide4(a.s89ab, b.s89ab),
                     divide4(a.scdef, b.scdef));
#endif
}

CASTOR_INLINE float4 square_root4(const float4 a)
{
#if CASTOR_CORRECTLY_ROUNDED
    return sqrt(a);
#else
    return (float4)(square_root(a.x), square_root(a.y), square_root(a.z), square_root(a.w));
#endif
}

CASTOR_INLINE float16 square_root16(const float16 a)
{
#if CASTOR_CORRECTLY_ROUNDED
    return sqrt(a);
#else
    return (float16)(square_root4(a.s0123), square_root4(a.s4567), square_root4(a.s89ab), square_root4(a.scdef));
#endif
}

// Returns v[by % 8], component by component.
CASTOR_INLINE uint8 permute_8(const uint8 v, const uint8 by)
{
#if defined(__AVX2__)
    typedef __attribute__((__vector_size__(32))) int int8_of_gcc;
    return as_uint8(__builtin_ia32_permvarsi256((int8_of_gcc)as_int8(v), (int8_of_gcc)as_int8(by)));
#else
    return shuffle(v, by & 7u);
#endif
}

CASTOR_INLINE uint least_of_8(const uint8 v)
{
    const uint4 four = min(v.lo, v.hi);
    const uint2 two = min(four.lo, four.hi);
    return min(two.x, two.y);
}

CASTOR_INLINE uint greatest_of_8(const uint8 v)
{
    const uint4 four = max(v.lo, v.hi);
    const uint2 two = max(four.lo, four.hi);
    return max(two.x, two.y);
}

// One step of a sorting network: each component of `k` is compared with that of `k.ORDER`, and becomes the lesser or
// the greater of both, as p0 … p7 (`less`, `more`) say. The other macro does the same for four components.
#define CASTOR_SORT_STEP(k, ORDER, p0, p1, p2, p3, p4, p5, p6, p7)           \
    {                                                                        \
        const uint8 other = k.ORDER;                                         \
        const uint8 less = k < other ? k : other;                            \
        const uint8 more = k > other ? k : other;                            \
        k = (uint8)(p0.s0, p1.s1, p2.s2, p3.s3, p4.s4, p5.s5, p6.s6, p7.s7); \
    }
#define CASTOR_SORT_STEP_4(k, ORDER, p0, p1, p2, p3) \
    {                                                \
        const uint4 other = k.ORDER;                 \
        const uint4 less = k < other ? k : other;    \
        const uint4 more = k > other ? k : other;    \
        k = (uint4)(p0.s0, p1.s1, p2.s2, p3.s3);     \
    }

// Sorts by the bitonic network (Batcher 1968, "Sorting networks and their applications"), without branches.
CASTOR_INLINE uint8 greatest_first_8(uint8 k)
{
    CASTOR_SORT_STEP(k, s10325476, more, less, less, more, more, less, less, more)
    CASTOR_SORT_STEP(k, s23016745, more, more, less, less, less, less, more, more)
    CASTOR_SORT_STEP(k, s10325476, more, less, more, less, less, more, less, more)
    CASTOR_SORT_STEP(k, s45670123, more, more, more, more, less, less, less, less)
    CASTOR_SORT_STEP(k, s23016745, more, more, less, less, more, more, less, less)
    CASTOR_SORT_STEP(k, s10325476, more, less, more, less, more, less, more, less)
    return k;
}

#if defined(__AVX512VL__)
// Returns the components that `mask` has as bits, one after the other, then zeros.
CASTOR_INLINE uint8 some_side_by_side_8(const uint8 v, const uint mask)
{
    typedef __attribute__((__vector_size__(32))) int int8_of_gcc;
    return as_uint8(__builtin_ia32_compresssi256_mask((int8_of_gcc)as_int8(v), (int8_of_gcc)(int8)(0), (uchar)mask));
}

// The same for four components: the first three steps.
CASTOR_INLINE uint4 greatest_first_4(uint4 k)
{
    CASTOR_SORT_STEP_4(k, s1032, more, less, less, more)
    CASTOR_SORT_STEP_4(k, s2301, more, more, less, less)
    CASTOR_SORT_STEP_4(k, s1032, more, less, more, less)
    return k;
}
#endif

// Sorts the components that `counts` (all ones or zero) says; those after them have no meaning. Four or fewer, as there
// mostly are of a node's children, need half the network where a CPU can move them together.
CASTOR_INLINE uint8 greatest_of_some_first_8(const uint8 k, const int8 counts)
{
#if defined(__AVX512VL__)
    const uint mask = mask_of8(counts);
    if (popcount(mask) <= 4) return (uint8)(greatest_first_4(some_side_by_side_8(k, mask).lo), (uint4)(0));
#endif
    return greatest_first_8(k & as_uint8(counts));
}

// Prefetches a cache line that will be read soon. An address outside any buffer does no harm.
CASTOR_INLINE void prefetch_line(const global uchar *address)
{
#if defined(__SSE__)
    __builtin_prefetch((const void *)(size_t)address);
#endif
}
