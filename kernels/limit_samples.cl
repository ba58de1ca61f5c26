// One work-item a slot. Limits the sum of its sample, and those of its groups of lights by the same factors.
#include "castor/shared/wave_columns.h"
#include "device/exact.cl"
#include "device/slots.cl"

kernel void limit_samples(const RenderParams params, const PathParams path, const uint group_count,
                          CASTOR_WRITE(film_terms))
{
    const uint slot = get_global_id(0);
    if (slot >= slot_count(params)) return;
    const float4 sum = film_terms[slot];
    const float most = path.largest_sample;
    film_terms[slot] =
        (float4)(sum.x > most ? most : sum.x, sum.y > most ? most : sum.y, sum.z > most ? most : sum.z, sum.w);
    for (uint group = 0; group < group_count; ++group) {
        const uint row = (1u + group) * slot_count(params) + slot;
        const float4 of_group = film_terms[row];
        film_terms[row] = (float4)(sum.x > most ? of_group.x * divide(most, sum.x) : of_group.x,
                                   sum.y > most ? of_group.y * divide(most, sum.y) : of_group.y,
                                   sum.z > most ? of_group.z * divide(most, sum.z) : of_group.z, 0.0f);
    }
}
