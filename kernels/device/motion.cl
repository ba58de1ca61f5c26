// Instances that move.
#include "castor/shared/layout.h"
#include "castor/shared/types.h"

// Returns where a point is that moves with the instance, after so much of the time that the shutter is open; before,
// where the time is negative.
CASTOR_INLINE float3 moved_point(const float3 point, const float time, const global Instance *instance)
{
    return fma((float3)(time), vload3(0, instance->motion), point);
}
