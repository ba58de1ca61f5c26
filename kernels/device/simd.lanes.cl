// Small operations for CASTOR_LANES lanes (see lanes.cl), beside those of simd.cl.
#include "device/lanes.cl"
#include "device/simd.cl"

// Comparisons choose: one instruction each, and the second operand where one is NaN or both are equal.
CASTOR_INLINE Real LANES(larger)(const Real a, const Real b) { return a > b ? a : b; }
CASTOR_INLINE Real LANES(smaller)(const Real a, const Real b) { return a < b ? a : b; }

// Load and store the lanes one after the other: reals and wholes in private memory, columns in buffers.
#if CASTOR_LANES == 1
CASTOR_INLINE void store_reals(const float value, float *at) { *at = value; }
CASTOR_INLINE void store_wholes(const uint value, uint *at) { *at = value; }
CASTOR_INLINE float load_real_column(const global float *at) { return *at; }
CASTOR_INLINE void store_real_column(const float value, global float *at) { *at = value; }
CASTOR_INLINE uint load_whole_column(const global uint *at) { return *at; }
CASTOR_INLINE void store_whole_column(const uint value, global uint *at) { *at = value; }
CASTOR_INLINE uint load_bytes(const global uchar *at) { return *at; }
CASTOR_INLINE void store_bytes(const uint value, global uchar *at) { *at = (uchar)value; }
#else
#if CASTOR_LANES < 16  // those of 16 are in simd.cl
CASTOR_INLINE void LANES(store_reals)(const Real value, float *at) { LANES(vstore)(value, 0, at); }
CASTOR_INLINE void LANES(store_wholes)(const Whole value, uint *at) { LANES(vstore)(value, 0, at); }
CASTOR_INLINE void LANES(store_real_column)(const Real value, global float *at) { LANES(vstore)(value, 0, at); }
CASTOR_INLINE void LANES(store_whole_column)(const Whole value, global uint *at) { LANES(vstore)(value, 0, at); }
#endif
CASTOR_INLINE Real LANES(load_real_column)(const global float *at) { return LANES(vload)(0, at); }
CASTOR_INLINE Whole LANES(load_whole_column)(const global uint *at) { return LANES(vload)(0, at); }
CASTOR_INLINE Whole LANES(load_bytes)(const global uchar *at) { return LANES(convert_uint)(LANES(vload)(0, at)); }
CASTOR_INLINE void LANES(store_bytes)(const Whole value, global uchar *at)
{
    LANES(vstore)(LANES(convert_uchar)(value), 0, at);
}
#endif

// Returns the number of the first lane, the largest one of all lanes, and whether all are the same.
#if CASTOR_LANES == 1
CASTOR_INLINE uint first_lane(const uint number) { return number; }
CASTOR_INLINE uint largest_of_lanes(const uint number) { return number; }
CASTOR_INLINE int are_same(const uint number) { return 1; }
#elif CASTOR_LANES == 16
CASTOR_INLINE uint first_lane16(const uint16 number) { return number.s0; }
CASTOR_INLINE uint largest_of_lanes16(const uint16 number)
{
    const uint8 eight = max(number.lo, number.hi);
    const uint4 four = max(eight.lo, eight.hi);
    const uint2 two = max(four.lo, four.hi);
    return max(two.x, two.y);
}
CASTOR_INLINE int are_same16(const uint16 number) { return !mask_of16(number != number.s0); }
#endif

#if CASTOR_LANES == 16
// Returns the least number of each of four vectors, which costs little more than that of one.
CASTOR_INLINE float4 least_of_four_16(const float16 a, const float16 b, const float16 c, const float16 d)
{
    const float16 ab = smaller16((float16)(a.lo, b.lo), (float16)(a.hi, b.hi));
    const float16 cd = smaller16((float16)(c.lo, d.lo), (float16)(c.hi, d.hi));
    const float16 quarters =
        smaller16((float16)(ab.s0123, ab.s89ab, cd.s0123, cd.s89ab), (float16)(ab.s4567, ab.scdef, cd.s4567, cd.scdef));
    const float16 pairs = smaller16(quarters, quarters.s23016745ab89efcd);
    const float16 least = smaller16(pairs, pairs.s1032547698badcfe);
    return least.s048c;
}
#endif
