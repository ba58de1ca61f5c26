// What paths add to the sums of their pixels, for CASTOR_LANES lanes (see lanes.cl).
//
// A float sum depends on the order of its terms. Where samples of a pixel are traced side by side, their terms are
// kept apart, row `term` of the slot, until add_samples adds them in the order of samples one by one. So they are where
// add_samples must know what each sample is (CASTOR_RENDER_DEVIATIONS).
//
// The paths of a scene with dielectrics branch, so that there is no bound on their terms. There each branch has a sum
// of its own, always (path_states.lanes.cl). Where paths are traced to their ends (CASTOR_TRACES_PATHS), each slot has
// one, in row 0: terms are added to it in the order of bounces.
#include "castor/shared/wave_columns.h"
#include "device/features.cl"
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

// Whether each term of a sample has a row.
CASTOR_INLINE int LANES(keeps_terms)(const RenderParams params)
{
    return !CASTOR_HAS_SLOT_SUMS && (params.sample_shift > 0 || (params.flags & CASTOR_RENDER_DEVIATIONS) != 0);
}

// Returns the sums of the slots of the paths at place, place + 1 ...: of `slot`, as LANES(slots) gives them.
CASTOR_INLINE LANES(Vectors)
    LANES(slot_sums)(const RenderParams params, const uint place, const Whole slot, const global float4 *restrict sums)
{
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE) return LANES(load_vectors)(sums + place);
    return LANES(gather_vectors)(sums, slot);
}

// Adds terms to the sums of the slots of the paths at place, place + 1 ..., where `counts`.
CASTOR_INLINE void LANES(add_to_slots)(const RenderParams params, const uint place, const Whole slot, const Mask counts,
                                       const LANES(Vectors) value, global float4 *restrict sums)
{
    const Mask is_added = counts & ((value.x != 0.0f) | (value.y != 0.0f) | (value.z != 0.0f));
    if (!LANES(mask_of)(is_added)) return;
    const LANES(Vectors) before = LANES(slot_sums)(params, place, slot, sums);
    const LANES(Vectors) sum = LANES(sum_of_vectors)(before, value);
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE)
        LANES(store_vectors)(LANES(choose_vectors)(is_added, sum, before), sums + place);
    else
        LANES(scatter_vectors)(sum, slot, is_added, sums);
}

#if CASTOR_HAS_LIGHT_GROUPS
// Adds terms to the sums of the slots for groups of lights, where `counts`: row 1 + g is that of group g.
CASTOR_INLINE void LANES(add_to_groups)(const RenderParams params, const uint place, const Whole slot,
                                        const Mask counts, const Whole group, const LANES(Vectors) value,
                                        global float4 *restrict film_terms)
{
    uint groups[CASTOR_LANES];
    LANES(store_wholes)(group, groups);
    Mask is_left = counts;
    while (LANES(mask_of)(is_left)) {
        const uint next = groups[lowest_bit(LANES(mask_of)(is_left))];
        const Mask is_next = is_left & (group == next);
        LANES(add_to_slots)(params, place, slot, is_next, value, film_terms + (1u + next) * slot_count(params));
        is_left &= !is_next;
    }
}
#endif

// Adds terms to the sums of their pixels where `counts`, with one sample of each pixel: those of the paths at place,
// place + 1 ..., which have these slots.
CASTOR_INLINE void LANES(add_to_sums)(const RenderParams params, const uint place, const Whole slot, const Mask counts,
                                      const LANES(Vectors) value, global float4 *restrict film_sum)
{
#if CASTOR_LANES == 1
    if (counts) film_sum[pixel_on_curve(params, slot)] += (float4)(value.x, value.y, value.z, 0.0f);
#else
    float4 rows[CASTOR_LANES];
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE) {
        // The slots are a square of pixels. Adding +0 changes no sum, since none is -0.
        const Real zero = (Real)(0.0f);
        LANES(store_private_rows)
        (counts ? value.x : zero, counts ? value.y : zero, counts ? value.z : zero, zero, rows);
        global float4 *const first = film_sum + pixel_on_curve(params, place);
        for (uint i = 0; i < CASTOR_LANES; ++i) first[y_on_curve(i) * CASTOR_PIXEL_BLOCK + x_on_curve(i)] += rows[i];
        return;
    }
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
    if (LANES(keeps_terms)(params))
        LANES(keep_terms)(params, place, slot, counts, term, value, film_terms);
    else if (CASTOR_HAS_SLOT_SUMS)
        LANES(add_to_slots)(params, place, slot, counts, value, film_terms);
    else
        LANES(add_to_sums)(params, place, slot, counts, value, film_sum);
}
