// The pixels and samples that slots belong to (see slots.cl), for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/types.h"
#include "device/curve.lanes.cl"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

#if CASTOR_BLOCK_SLOTS % CASTOR_LANES
#error "the lanes of a work-item lie in one pixel block"
#endif

typedef struct LANES(Pixels) {
    Whole x, y;
} LANES(Pixels);

// Returns the pixels of the slots slot, slot + 1 ... of a wave, which lie in one block. They may lie outside the
// picture, at its right and lower edge.
CASTOR_INLINE LANES(Pixels)
    LANES(pixels_of_slots)(const RenderParams params, const global uint *restrict pixel_blocks, const uint slot)
{
    const uint block = pixel_blocks[(params.first_pixel + (slot >> params.sample_shift)) / CASTOR_BLOCK_SLOTS];
    const Whole place = (slot + LANES(lane_numbers)()) >> params.sample_shift;
    LANES(Pixels) pixel;
    pixel.x = (block & 0xffffu) + LANES(x_on_curve)(place);
    pixel.y = (block >> 16u) + LANES(y_on_curve)(place);
    return pixel;
}

// Returns the same for any slots.
CASTOR_INLINE LANES(Pixels)
    LANES(pixels_of_any_slots)(const RenderParams params, const global uint *restrict pixel_blocks, const Whole slot)
{
    const Whole place = slot >> params.sample_shift;
    const Whole block = LANES(gather_wholes)(pixel_blocks, (params.first_pixel + place) / CASTOR_BLOCK_SLOTS, 1);
    LANES(Pixels) pixel;
    pixel.x = (block & 0xffffu) + LANES(x_on_curve)(place);
    pixel.y = (block >> 16u) + LANES(y_on_curve)(place);
    return pixel;
}

// Returns the numbers by which the samples of pixels are drawn.
CASTOR_INLINE Whole LANES(pixel_numbers)(const LANES(Pixels) pixel) { return pixel.y << 16u | pixel.x; }

CASTOR_INLINE Whole LANES(samples_of_slots)(const RenderParams params, const Whole slot)
{
    return params.sample + (slot & ((1u << params.sample_shift) - 1u));
}

// Returns the points of the unit square that the samples of any slots have in some dimension: see sample_dimension.
CASTOR_ONCE LANES(Points) LANES(points_of_slots)(const RenderParams params, const global uint *restrict pixel_blocks,
                                                 const Whole slot, const Whole dimension)
{
    return LANES(sample_dimension)(LANES(pixel_numbers)(LANES(pixels_of_any_slots)(params, pixel_blocks, slot)),
                                   LANES(samples_of_slots)(params, slot), params.seed, dimension);
}
