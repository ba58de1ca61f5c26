// One work-item a path. Moves those that go on to their places in the queue, in the order of before, so that paths of
// neighbouring pixels stay neighbours: next_block_places says where those of each block of places begin.
#include "castor/shared/wave_columns.h"

kernel void compact_paths(const RenderParams params, CASTOR_READ(next_rank), CASTOR_READ(next_block_places),
                          CASTOR_READ(next_slot), CASTOR_READ(next_origin_tmin), CASTOR_READ(next_direction_tmax),
                          CASTOR_WRITE(path_slot), CASTOR_WRITE(ray_origin_tmin), CASTOR_WRITE(ray_direction_tmax))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count || next_rank[place] == CASTOR_PATH_ENDED) return;
    const uint next = next_block_places[place / CASTOR_BLOCK_SLOTS] + next_rank[place];
    path_slot[next] = next_slot[place];
    ray_origin_tmin[next] = next_origin_tmin[place];
    ray_direction_tmax[next] = next_direction_tmax[place];
}
