// The pixels and samples that slots belong to (see slots.cl), for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/sample_order.h"
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

// The numbers by which samples of pixels are drawn: see sample_dimension.
typedef struct LANES(SampleNumbers) {
    Whole pixel, sample;
} LANES(SampleNumbers);

// Returns the numbers of a sample of each pixel. Where pixels share a sequence, a pixel has the samples of its place
// along a Z curve over the picture, so that those of each aligned square of pixels lie as well together as those of one
// pixel, and errors are blue noise (Ahmed, Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error
// via Hierarchical Ordering of Pixels"). sample_dimension shuffles the curve in every dimension anew, by halves where
// the paper does it by quarters. The sequence has 2^32 points; larger pictures have one for each square that it fills.
CASTOR_INLINE LANES(SampleNumbers)
    LANES(sample_numbers)(const RenderParams params, const LANES(Pixels) pixel, const Whole sample)
{
    LANES(SampleNumbers) numbers;
    numbers.pixel = pixel.y << 16u | pixel.x;
    numbers.sample = sample;
    const uint order = params.flags >> CASTOR_Z_ORDER_SHIFT;
    if (order == 0) return numbers;
    const uint bits = order - 1u;  // of a pixel's sample
    const Whole place = LANES(spread_bits)(pixel.y) << 1u | LANES(spread_bits)(pixel.x);
    numbers.pixel = (place >> 1u) >> (31u - bits);
    numbers.sample = place << bits | sample;
    return numbers;
}

CASTOR_INLINE Whole LANES(samples_of_slots)(const RenderParams params, const Whole slot)
{
    return params.sample + (slot & ((1u << params.sample_shift) - 1u));
}

CASTOR_INLINE LANES(SampleNumbers)
    LANES(numbers_of_slots)(const RenderParams params, const global uint *restrict pixel_blocks, const Whole slot)
{
    return LANES(sample_numbers)(params, LANES(pixels_of_any_slots)(params, pixel_blocks, slot),
                                 LANES(samples_of_slots)(params, slot));
}

// Returns the points of the unit square that the samples of any slots have in some dimension: see sample_dimensions.
CASTOR_ONCE LANES(Points) LANES(points_of_slots)(const RenderParams params, const global uint *restrict pixel_blocks,
                                                 const Whole slot, const Whole dimension)
{
    const LANES(SampleNumbers) numbers = LANES(numbers_of_slots)(params, pixel_blocks, slot);
    return LANES(sample_dimension)(numbers.pixel, numbers.sample, params.seed, dimension);
}
