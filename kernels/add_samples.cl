// One work-item a pixel. Adds the terms of samples that were traced side by side to the film, in the order in which
// they are added where samples are traced one by one, and so with the same bits. Where slots have sums (film.lanes.cl),
// it adds these, which are row 0 of the terms.
#include "castor/shared/wave_columns.h"
#include "device/features.cl"
#include "device/slots.cl"

kernel void add_samples(const RenderParams params, CASTOR_READ(path_terms), CASTOR_READ(film_terms),
                        CASTOR_WRITE(film_sum))
{
    const uint place = get_global_id(0);
    if (place >= params.pixel_count) return;
    const uint pixel = pixel_on_curve(params, place);
    float4 sum = film_sum[pixel];
    for (uint slot = place << params.sample_shift; slot < (place + 1) << params.sample_shift; ++slot)
        for (uint term = 0; term < (CASTOR_HAS_SLOT_SUMS ? 1 : path_terms[slot]); ++term)
            sum += film_terms[term * slot_count(params) + slot];
    film_sum[pixel] = sum;
}
