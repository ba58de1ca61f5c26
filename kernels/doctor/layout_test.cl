// The device's sizes and offsets, in the order of CASTOR_LAYOUT. One work-item writes them all.
#include "castor/shared/types.h"
#include "doctor/layout_test_fields.h"

#define CASTOR_WRITE_SIZE(type) numbers[n++] = (uint)sizeof(type);
#define CASTOR_WRITE_OFFSET(type, member)                              \
    {                                                                  \
        type value;                                                    \
        numbers[n++] = (uint)((char *)&value.member - (char *)&value); \
    }

kernel void layout_test(const uint count, global uint *restrict numbers)
{
    if (count == 0 || get_global_id(0) != 0) return;
    uint n = 0;
    CASTOR_LAYOUT(CASTOR_WRITE_SIZE, CASTOR_WRITE_OFFSET)
}
