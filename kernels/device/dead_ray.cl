// A slot without a ray holds one that hits nothing: its t_max lies before its t_min.
#include "castor/shared/layout.h"
CASTOR_INLINE float4 dead_origin_tmin(void) { return (float4)(0.0f, 0.0f, 0.0f, 1.0f); }
CASTOR_INLINE float4 dead_direction_tmax(void) { return (float4)(0.0f, 0.0f, 1.0f, 0.0f); }

// Rays count hits with t > 0; the interval of a ray is closed.
#define CASTOR_SMALLEST_T 1e-30f
