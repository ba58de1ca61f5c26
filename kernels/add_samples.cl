// One work-item a pixel. Adds the terms of samples that were traced side by side to the film, in the order in which
// they are added where samples are traced one by one, and so with the same bits.
#include "castor/shared/wave_columns.h"

kernel void add_samples(const RenderParams params, CASTOR_READ(path_terms), CASTOR_READ(film_terms),
                        CASTOR_WRITE(film_sum))
{
    const uint pixel = get_global_id(0);
    if (pixel >= params.pixel_count) return;
    float4 sum = film_sum[pixel];
    for (uint slot = pixel; slot < params.slot_count; slot += params.pixel_count)
        for (uint term = 0; term < path_terms[slot]; ++term) sum += film_terms[term * params.slot_count + slot];
    film_sum[pixel] = sum;
}
