// A ray that hits nothing, since its t_max lies before its t_min: for pixels outside the picture, and for lights that
// add nothing.
#include "castor/shared/layout.h"
CASTOR_INLINE float4 dead_origin_tmin(void) { return (float4)(0.0f, 0.0f, 0.0f, 1.0f); }
CASTOR_INLINE float4 dead_direction_tmax(void) { return (float4)(0.0f, 0.0f, 1.0f, 0.0f); }

// The smallest t_min of mirror and shadow rays: hits count for t > 0, and the interval of a ray is closed.
#define CASTOR_SMALLEST_T 1e-30f
