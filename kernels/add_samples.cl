// One work-item a pixel. Adds the terms of samples that were traced side by side to the film, in the order in which
// they are added where samples are traced one by one, and so with the same bits. Where slots have sums (film.lanes.cl),
// it adds these, which are row 0 of the terms.
//
// With CASTOR_RENDER_DEVIATIONS, w of the film becomes the sum of the squared deviations of the samples' luminances
// from their mean, which is (n - 1) times their variance (Welford 1962, "Note on a Method for Calculating Corrected
// Sums of Squares and Products"): the means before each sample are those of the film. No difference of large sums is
// taken.
#include "castor/shared/wave_columns.h"
#include "device/exact.cl"
#include "device/features.cl"
#include "device/slots.cl"

// Returns the luminance of linear RGB (IEC 61966-2-1).
CASTOR_INLINE float luminance_of(const float3 rgb) { return fma(0.2126f, rgb.x, fma(0.7152f, rgb.y, 0.0722f * rgb.z)); }

// Returns what the sample `number`, from 0 on, adds to the sum of squared deviations. `earlier`: the sum of the samples
// before it.
CASTOR_INLINE float squared_deviation(const float3 earlier, const float3 sample, const uint number)
{
    if (number == 0) return 0.0f;
    const float count = (float)number;
    const float difference = luminance_of(sample) - divide(luminance_of(earlier), count);
    return difference * difference * divide(count, count + 1.0f);
}

kernel void add_samples(const RenderParams params, CASTOR_READ(path_terms), CASTOR_READ(film_terms),
                        CASTOR_WRITE(film_sum))
{
    const uint place = get_global_id(0);
    if (place >= params.pixel_count) return;
    const uint pixel = pixel_on_curve(params, place);
    const uint first_slot = place << params.sample_shift;
    float4 sum = film_sum[pixel];
    float deviation = sum.w;
    for (uint slot = first_slot; slot < (place + 1) << params.sample_shift; ++slot) {
        const float3 earlier = sum.xyz;
        float3 sample = (float3)(0.0f);
        for (uint term = 0; term < (CASTOR_HAS_SLOT_SUMS ? 1 : path_terms[slot]); ++term) {
            const float4 value = film_terms[term * slot_count(params) + slot];
            sample += value.xyz;
            sum += value;  // w means nothing: a sum of whole vectors is the shorter chain
        }
        if (params.flags & CASTOR_RENDER_DEVIATIONS)
            deviation += squared_deviation(earlier, sample, params.sample + (slot - first_slot));
    }
    film_sum[pixel] = (float4)(sum.xyz, deviation);
}
