// What a path adds to the sum of its pixel.
#include "castor/shared/wave_columns.h"

// Adds a term to the film. A float sum depends on the order of its terms, so where samples of a pixel are traced side
// by side, their terms are kept apart, row `term` of the slot, until add_samples adds them in the order of one by one.
CASTOR_INLINE void add_term(const RenderParams params, const uint slot, const uint term, const float4 value,
                            global float4 *restrict film_sum, global float4 *restrict film_terms)
{
    if (params.flags & CASTOR_RENDER_KEEPS_TERMS)
        film_terms[term * params.slot_count + slot] = value;
    else
        film_sum[slot] += value;
}
