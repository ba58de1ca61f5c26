// Correctly rounded division and square root: the operators where the device rounds them correctly (the host then
// defines CASTOR_CORRECTLY_ROUNDED as 1 and builds with -cl-fp32-correctly-rounded-divide-sqrt), integer arithmetic
// elsewhere.
//
// CASTOR_CORRECTLY_ROUNDED  1: `/` and `sqrt` of the device are correctly rounded. 0: they are within 3 ulp, as the
//                           full profile promises.
#include "castor/shared/layout.h"
#ifndef CASTOR_CORRECTLY_ROUNDED
#define CASTOR_CORRECTLY_ROUNDED 0
#endif

// A positive finite float as mantissa * 2^exponent with mantissa in [2^23, 2^24).
typedef struct Unpacked {
    uint mantissa;
    int exponent;
} Unpacked;

CASTOR_INLINE Unpacked unpack_float(const uint magnitude)
{
    Unpacked result;
    if (magnitude < 0x00800000u) {  // denormal
        const int shift = convert_int(clz(magnitude)) - 8;
        result.mantissa = magnitude << shift;
        result.exponent = -149 - shift;
    } else {
        result.mantissa = (magnitude & 0x007fffffu) | 0x00800000u;
        result.exponent = convert_int(magnitude >> 23) - 150;
    }
    return result;
}

// Returns the bits of (quotient + some fraction of 1, if `inexact`) * 2^exponent, rounded to nearest, ties to even.
// `quotient` is in [2^24, 2^26): at least one bit more than a float has.
CASTOR_INLINE uint pack_float(const uint quotient, const bool inexact, const int exponent)
{
    const int shift = 8 - convert_int(clz(quotient));  // to 24 bits
    const int leading = exponent + shift;              // exponent of the last bit of the result
    if (leading > 104) return 0x7f800000u;
    const int denormal_shift = leading < -149 ? min(-149 - leading, 26) : 0;
    const int total = shift + denormal_shift;
    const uint kept = quotient >> total;
    const uint rest = quotient & ((1u << total) - 1u);
    const uint half_unit = 1u << (total - 1);
    const bool up = rest > half_unit || (rest == half_unit && (inexact || (kept & 1u) != 0u));
    // Mantissa and exponent side by side: a carry out of the mantissa moves into the exponent, up to infinity.
    const uint base = denormal_shift > 0 ? kept : ((uint)(leading + 149) << 23) + kept;
    return base + (up ? 1u : 0u);
}

// Returns a / b by integers, correctly rounded. The device's own quotient is only a first guess.
CASTOR_INLINE float divide_by_integers(const float a, const float b)
{
    const uint magnitude_a = as_uint(a) & 0x7fffffffu;
    const uint magnitude_b = as_uint(b) & 0x7fffffffu;
    const uint sign = (as_uint(a) ^ as_uint(b)) & 0x80000000u;
    if (magnitude_a > 0x7f800000u || magnitude_b > 0x7f800000u) return NAN;
    if (magnitude_a == 0x7f800000u) return magnitude_b == 0x7f800000u ? NAN : as_float(sign | 0x7f800000u);
    if (magnitude_b == 0u) return magnitude_a == 0u ? NAN : as_float(sign | 0x7f800000u);
    if (magnitude_b == 0x7f800000u || magnitude_a == 0u) return as_float(sign);

    const Unpacked ua = unpack_float(magnitude_a);
    const Unpacked ub = unpack_float(magnitude_b);
    const long dividend = (long)ua.mantissa << 25;
    const long divisor = (long)ub.mantissa;
    long quotient = (long)convert_uint(convert_float(ua.mantissa) / convert_float(ub.mantissa) * 33554432.0f);
    long remainder = dividend - quotient * divisor;
    // The guess is off by some ten units; one more step leaves at most one.
    quotient += (long)convert_int(convert_float(remainder) / convert_float(ub.mantissa));
    remainder = dividend - quotient * divisor;
    if (remainder < 0) {
        quotient -= 1;
        remainder += divisor;
    }
    if (remainder >= divisor) {
        quotient += 1;
        remainder -= divisor;
    }
    return as_float(sign | pack_float((uint)quotient, remainder != 0, ua.exponent - ub.exponent - 25));
}

// Returns the square root by integers, correctly rounded. The device's own root is only a first guess.
CASTOR_INLINE float square_root_by_integers(const float x)
{
    const uint magnitude = as_uint(x) & 0x7fffffffu;
    if (magnitude == 0u) return x;
    if (magnitude > 0x7f800000u || as_uint(x) != magnitude) return NAN;
    if (magnitude == 0x7f800000u) return x;

    const Unpacked u = unpack_float(magnitude);
    const int odd = u.exponent & 1;
    const uint mantissa = u.mantissa << odd;   // times an even power of 2
    const long square = (long)mantissa << 26;  // in [2^49, 2^51)
    long root = (long)convert_uint(sqrt(convert_float(mantissa)) * 8192.0f);
    long remainder = square - root * root;
    root += (long)convert_int(convert_float(remainder) / (2.0f * convert_float(root)));
    remainder = square - root * root;
    if (remainder < 0) {
        remainder += 2 * root - 1;
        root -= 1;
    }
    if (remainder > 2 * root) {
        remainder -= 2 * root + 1;
        root += 1;
    }
    return as_float(pack_float((uint)root, remainder != 0, (u.exponent - odd) / 2 - 13));
}

#if CASTOR_CORRECTLY_ROUNDED
CASTOR_INLINE float divide(const float a, const float b) { return a / b; }
CASTOR_INLINE float square_root(const float x) { return sqrt(x); }
#else
CASTOR_INLINE float divide(const float a, const float b) { return divide_by_integers(a, b); }
CASTOR_INLINE float square_root(const float x) { return square_root_by_integers(x); }
#endif
