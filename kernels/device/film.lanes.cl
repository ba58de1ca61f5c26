// What paths add to the sums of their pixels, for CASTOR_LANES lanes (see lanes.cl).
//
// A float sum depends on the order of its terms. Where samples of a pixel are traced side by side, their terms are
// kept apart, row `term` of the slot, until add_samples adds them in the order of samples one by one.
#include "castor/shared/wave_columns.h"
#include "device/slots.cl"
#include "device/vector.lanes.cl"

// Keeps the terms of the paths at place, place + 1 ..., which have these slots, where `counts`; at the first bounce all
// of them count.
CASTOR_INLINE void LANES(keep_terms)(const RenderParams params, const uint place, const Whole slot, const Mask counts,
                                     const uint term, const LANES(Vectors) value, global float4 *restrict film_terms)
{
    global float4 *const row = film_terms + term * slot_count(params);
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE)
        LANES(store_vectors)(value, row + place);
    else
        LANES(scatter_vectors)(value, slot, counts, row);
}

// Adds terms to the sums of their pixels where `counts`, with one sample of each pixel.
CASTOR_INLINE void LANES(add_to_sums)(const RenderParams params, const Whole slot, const Mask counts,
                                      const LANES(Vectors) value, global float4 *restrict film_sum)
{
#if CASTOR_LANES == 1
    if (counts) film_sum[pixel_on_curve(params, slot)] += (float4)(value.x, value.y, value.z, 0.0f);
#else
    float4 rows[CASTOR_LANES];
    uint slots[CASTOR_LANES];
    LANES(store_private_rows)(value.x, value.y, value.z, (Real)(0.0f), rows);
    LANES(store_wholes)(slot, slots);
    for (uint left = LANES(mask_of)(counts); left; left &= left - 1) {
        const uint lane = lowest_bit(left);
        film_sum[pixel_on_curve(params, slots[lane])] += rows[lane];
    }
#endif
}

CASTOR_INLINE void LANES(add_terms)(const RenderParams params, const uint place, const Whole slot, const Mask counts,
                                    const uint term, const LANES(Vectors) value, global float4 *restrict film_sum,
                                    global float4 *restrict film_terms)
{
    if (params.sample_shift > 0)
        LANES(keep_terms)(params, place, slot, counts, term, value, film_terms);
    else
        LANES(add_to_sums)(params, slot, counts, value, film_sum);
}
