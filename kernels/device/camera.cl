// Eye rays, and the pixels that they belong to.
#include "castor/shared/types.h"
#include "device/elementary.cl"
#include "device/random.cl"
#include "device/vector.cl"

// Computes the direction of the eye ray through the point (x, y) of the image: s - e of the lecture, with
// s = q + s_u u - s_v v.
CASTOR_INLINE float3 camera_direction(const Camera camera, const float x, const float y)
{
    return (float3)(fma(x, camera.step_x[0], fma(-y, camera.step_y[0], camera.corner[0])),
                    fma(x, camera.step_x[1], fma(-y, camera.step_y[1], camera.corner[1])),
                    fma(x, camera.step_x[2], fma(-y, camera.step_y[2], camera.corner[2])));
}

// Returns the pixel with this number in a wave. It may lie outside the picture, at its right and lower edge.
CASTOR_INLINE uint2 pixel_of_number(const global uint *restrict pixel_blocks, const uint number)
{
    const uint block = pixel_blocks[number / CASTOR_BLOCK_SLOTS];
    const uint within = number % CASTOR_BLOCK_SLOTS;
    return (uint2)((block & 0xffff) + within % CASTOR_PIXEL_BLOCK, (block >> 16) + within / CASTOR_PIXEL_BLOCK);
}

// Inverts the tent's distribution function.
CASTOR_INLINE float tent_offset(const float x)
{
    return x < 0.5f ? square_root(2.0f * x) - 1.0f : 1.0f - square_root(2.0f - 2.0f * x);
}

// Draws from a round Gaussian of sigma 0.5 cut at radius 2: r = sigma sqrt(-2 ln(1 - x (1 - e^(-8)))).
CASTOR_INLINE float2 gaussian_offset(const float2 point)
{
    const float inside = 0.99966454f;  // 1 - e^(-8)
    const float radius = 0.5f * square_root(-2.0f * logarithm(fma(-inside, point.x, 1.0f)));
    const float angle = 6.2831855f * point.y;
    return radius * (float2)(cosine(angle), sine(angle));
}

// Draws a sample's position relative to its pixel's centre, in proportion to the filter's weight.
CASTOR_INLINE float2 filter_offset(const uint filter, const float2 point)
{
    if (filter == CASTOR_FILTER_BOX) return point - 0.5f;
    if (filter == CASTOR_FILTER_TENT) return (float2)(tent_offset(point.x), tent_offset(point.y));
    return gaussian_offset(point);
}

// Returns the point of the image through which a sample of a pixel goes.
CASTOR_INLINE float2 sample_position(const RenderParams params, const uint2 pixel, const uint sample)
{
    const float2 centre = (float2)((float)pixel.x + 0.5f, (float)pixel.y + 0.5f);
    if (params.flags & CASTOR_RENDER_PIXEL_CENTRES) return centre;
    const uint number = pixel.y << 16 | pixel.x;
    return centre + filter_offset(params.filter, sample_square(number, sample, params.seed));
}
