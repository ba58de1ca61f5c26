// One work-item a pixel. Adds what the samples found of each group of lights to the rows of film_features from
// `first_row` on, in the order of samples, so that the sums have the same bits however the samples are divided.
// `row_length`: pixels of a row.
#include "castor/shared/wave_columns.h"
#include "device/slots.cl"

kernel void add_groups(const RenderParams params, const uint row_length, const uint first_row, const uint group_count,
                       CASTOR_READ(film_terms), CASTOR_WRITE(film_features))
{
    const uint place = get_global_id(0);
    if (place >= params.pixel_count) return;
    const uint pixel = pixel_on_curve(params, place);
    for (uint group = 0; group < group_count; ++group) {
        const uint of_pixel = (first_row + group) * row_length + pixel;
        float4 sum = film_features[of_pixel];
        for (uint slot = place << params.sample_shift; slot < (place + 1) << params.sample_shift; ++slot)
            sum.xyz += film_terms[(1u + group) * slot_count(params) + slot].xyz;
        film_features[of_pixel] = sum;
    }
}
