// One work-item a path. Gives the rays that passed a surface the hits beyond it.
#include "castor/shared/wave_columns.h"

kernel void take_hits_beyond(const uint path_count, CASTOR_READ(passed), CASTOR_READ(inside_hits), CASTOR_WRITE(hits))
{
    const uint place = get_global_id(0);
    if (place < path_count && passed[place] == CASTOR_PASSED) hits[place] = inside_hits[place];
}
