// One elementary function, chosen by its number in host/reference/elementary.h, for CASTOR_LANES lanes (see
// device/lanes.cl). `count` is a multiple of the lanes.
#include "device/elementary.lanes.cl"

CASTOR_INLINE Real LANES(elementary)(const uint function, const Real x, const Real y)
{
    switch (function) {
        case 0:
            return LANES(sine)(x);
        case 1:
            return LANES(cosine)(x);
        case 2:
            return LANES(arc_sine)(x);
        case 3:
            return LANES(arc_cosine)(x);
        case 4:
            return LANES(exponential)(x);
        case 5:
            return LANES(exponential2)(x);
        case 6:
            return LANES(logarithm)(x);
        case 7:
            return LANES(logarithm2)(x);
        case 8:
            return LANES(power)(x, y);
        case 9:
            return LANES(arc_tangent2)(x, y);
        case 10:
            return LANES(rounded_down)(x);
    }
    return (Real)(NAN);
}

kernel CASTOR_IN_LANES void LANES(elementary_test)(const uint count, const uint function,
                                                   const global float *restrict x, const global float *restrict y,
                                                   global float *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    LANES(store_real_column)
    (LANES(elementary)(function, LANES(load_real_column)(x + i), LANES(load_real_column)(y + i)), results + i);
}
