// One work-item a place. Puts branches [first, first + path_count) of a level's list into the queue.
#include "castor/shared/wave_columns.h"

kernel void take_branches(const uint path_count, const uint first, CASTOR_READ(branch_list),
                          CASTOR_READ(next_origin_tmin), CASTOR_READ(next_direction_tmax), CASTOR_WRITE(path_slot),
                          CASTOR_WRITE(ray_origin_tmin), CASTOR_WRITE(ray_direction_tmax))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const uint branch = branch_list[first + place];
    path_slot[place] = branch;
    ray_origin_tmin[place] = next_origin_tmin[branch];
    ray_direction_tmax[place] = next_direction_tmax[branch];
}
