// One work-item a block of CASTOR_BLOCK_SLOTS places. Ranks the paths of the block that go on, and counts them.
#include "castor/shared/wave_columns.h"

kernel void rank_paths(const uint place_count, CASTOR_WRITE(next_rank), CASTOR_WRITE(next_block_places))
{
    const uint block = get_global_id(0);
    const uint begin = block * CASTOR_BLOCK_SLOTS;
    if (begin >= place_count) return;
    const uint end = min(begin + CASTOR_BLOCK_SLOTS, place_count);
    uint count = 0;
    for (uint place = begin; place < end; ++place)
        if (next_rank[place] != CASTOR_PATH_ENDED) next_rank[place] = (uchar)count++;
    next_block_places[block] = count;
}
