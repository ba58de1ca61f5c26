// One work-item a slot. Limits the sum of its sample.
#include "castor/shared/wave_columns.h"
#include "device/slots.cl"

kernel void limit_samples(const RenderParams params, const PathParams path, CASTOR_WRITE(film_terms))
{
    const uint slot = get_global_id(0);
    if (slot >= slot_count(params)) return;
    const float4 sum = film_terms[slot];
    const float most = path.largest_sample;
    film_terms[slot] =
        (float4)(sum.x > most ? most : sum.x, sum.y > most ? most : sum.y, sum.z > most ? most : sum.z, sum.w);
}
