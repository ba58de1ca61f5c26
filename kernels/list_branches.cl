// One work-item a place. Writes the numbers of the branches that there are to branch_list, in their order:
// next_block_places says where those of each block of places begin.
#include "castor/shared/wave_columns.h"

kernel void list_branches(const uint place_count, CASTOR_READ(next_rank), CASTOR_READ(next_block_places),
                          CASTOR_WRITE(branch_list))
{
    const uint place = get_global_id(0);
    if (place >= place_count || next_rank[place] == CASTOR_PATH_ENDED) return;
    branch_list[next_block_places[place / CASTOR_BLOCK_SLOTS] + next_rank[place]] = place;
}
