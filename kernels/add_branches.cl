// One work-item a branch of those that were in the queue together, [first, first + path_count) of their level's list;
// of level 0 (is_eye) all. Adds the sums of its children, which are zero where there is none.
#include "castor/shared/wave_columns.h"

kernel void add_branches(const uint path_count, const uint first, const uint is_eye, const uint row_length,
                         CASTOR_READ(branch_list), CASTOR_READ(branch_sums), CASTOR_WRITE(film_terms))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const uint branch = is_eye ? place : branch_list[first + place];
    film_terms[branch] = film_terms[branch] + branch_sums[place] + branch_sums[row_length + place];
}
