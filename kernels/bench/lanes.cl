// The vector type Lanes of CASTOR_LANES floats (8 or 16), and lane_numbers: 0, 1, 2 ... in it.
#include "castor/shared/layout.h"

#ifndef CASTOR_LANES
#define CASTOR_LANES 16
#endif

#if CASTOR_LANES == 8
typedef float8 Lanes;
CASTOR_INLINE Lanes lane_numbers(void) { return (float8)(0, 1, 2, 3, 4, 5, 6, 7); }
#else
typedef float16 Lanes;
CASTOR_INLINE Lanes lane_numbers(void) { return (float16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15); }
#endif
