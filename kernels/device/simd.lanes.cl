// Small operations for CASTOR_LANES lanes (see lanes.cl), beside those of simd.cl.
#include "device/lanes.cl"
#include "device/simd.cl"

// Comparisons choose: one instruction each, and the second operand where one is NaN or both are equal.
CASTOR_INLINE Real LANES(larger)(const Real a, const Real b) { return a > b ? a : b; }
CASTOR_INLINE Real LANES(smaller)(const Real a, const Real b) { return a < b ? a : b; }

// Store the lanes one after the other.
#if CASTOR_LANES == 1
CASTOR_INLINE void store_reals(const float value, float *at) { *at = value; }
CASTOR_INLINE void store_wholes(const uint value, uint *at) { *at = value; }
#else
CASTOR_INLINE void LANES(store_reals)(const Real value, float *at) { LANES(vstore)(value, 0, at); }
CASTOR_INLINE void LANES(store_wholes)(const Whole value, uint *at) { LANES(vstore)(value, 0, at); }
#endif
