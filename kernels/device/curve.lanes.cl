// The Z curve of a pixel block (see slots.cl), and of larger squares, for CASTOR_LANES lanes (see lanes.cl).
#include "device/lanes.cl"

// Return the column and the row, in its block, of the pixel at a place of the curve. Bits above those of a place in a
// block are ignored.
CASTOR_INLINE Whole LANES(x_on_curve)(const Whole place)
{
    return (place & 1u) | ((place >> 1u) & 2u) | ((place >> 2u) & 4u);
}
CASTOR_INLINE Whole LANES(y_on_curve)(const Whole place) { return LANES(x_on_curve)(place >> 1u); }

// Puts a zero above each bit of numbers below 2^16.
CASTOR_INLINE Whole LANES(spread_bits)(Whole x)
{
    x = (x | (x << 8u)) & 0x00ff00ffu;
    x = (x | (x << 4u)) & 0x0f0f0f0fu;
    x = (x | (x << 2u)) & 0x33333333u;
    return (x | (x << 1u)) & 0x55555555u;
}
