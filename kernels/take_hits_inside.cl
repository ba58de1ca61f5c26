// One work-item a path. Gives the rays that are inside dielectrics the hits that were found for them apart.
#include "castor/shared/wave_columns.h"

kernel void take_hits_inside(const RenderParams params, CASTOR_READ(path_slot), CASTOR_READ(path_state),
                             CASTOR_READ(inside_hits), CASTOR_WRITE(hits))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    if (path_state[path_slot[place]].z != CASTOR_INVALID_INDEX) hits[place] = inside_hits[place];
}
