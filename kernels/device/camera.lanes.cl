// Eye rays for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/types.h"
#include "device/elementary.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

// Computes the directions of eye rays through points of the image: s - e of the lecture, with s = q + s_u u - s_v v.
CASTOR_INLINE LANES(Vectors) LANES(camera_direction)(const Camera camera, const LANES(Points) at)
{
    LANES(Vectors) direction;
    direction.x = fma(at.x, (Real)(camera.step_x[0]), fma(-at.y, (Real)(camera.step_y[0]), (Real)(camera.corner[0])));
    direction.y = fma(at.x, (Real)(camera.step_x[1]), fma(-at.y, (Real)(camera.step_y[1]), (Real)(camera.corner[1])));
    direction.z = fma(at.x, (Real)(camera.step_x[2]), fma(-at.y, (Real)(camera.step_y[2]), (Real)(camera.corner[2])));
    return direction;
}

// Origin and direction of eye rays.
typedef struct LANES(EyeRays) {
    LANES(Vectors) origin, direction;
} LANES(EyeRays);

// Computes the eye rays through points of the image, and of the lens: those are points of the unit square.
CASTOR_INLINE LANES(EyeRays)
    LANES(eye_rays)(const Camera camera, const LANES(Points) at, const LANES(Points) lens_point)
{
    LANES(EyeRays) ray;
    ray.origin = LANES(same_vectors)(camera.position);
    ray.direction = LANES(camera_direction)(camera, at);
    if (camera.projection == CASTOR_PROJECTION_PINHOLE) return ray;
    if (camera.projection == CASTOR_PROJECTION_PARALLEL) {
        ray.origin = LANES(sum_of_vectors)(ray.origin, ray.direction);
        ray.direction = LANES(same_vectors)(camera.lens_x);
        return ray;
    }
    const LANES(Vectors) moved =
        LANES(sum_of_vectors)(LANES(scaled_vectors)(LANES(same_vectors)(camera.lens_x), lens_point.x - 0.5f),
                              LANES(scaled_vectors)(LANES(same_vectors)(camera.lens_y), lens_point.y - 0.5f));
    ray.origin = LANES(sum_of_vectors)(ray.origin, moved);
    ray.direction = LANES(points_on_rays)(ray.direction, (Real)(-camera.sharpness), moved);
    return ray;
}

// Inverts the tent's distribution function.
CASTOR_INLINE Real LANES(tent_offset)(const Real x)
{
    const Real below = LANES(square_root)(2.0f * x) - 1.0f;
    const Real above = 1.0f - LANES(square_root)(2.0f - 2.0f * x);
    return x < 0.5f ? below : above;
}

// Draws from a round Gaussian of sigma 0.5 cut at radius 2: r = sigma sqrt(-2 ln(1 - x (1 - e^(-8)))).
CASTOR_INLINE LANES(Points) LANES(gaussian_offset)(const LANES(Points) point)
{
    const Real inside = (Real)(0.99966454f);  // 1 - e^(-8)
    const Real radius = 0.5f * LANES(square_root)(-2.0f * LANES(logarithm)(fma(-inside, point.x, (Real)(1.0f))));
    const Real angle = 6.2831855f * point.y;
    LANES(Points) offset;
    offset.x = radius * LANES(cosine)(angle);
    offset.y = radius * LANES(sine)(angle);
    return offset;
}

// Draws samples' positions relative to their pixels' centres, in proportion to the filter's weight.
CASTOR_INLINE LANES(Points) LANES(filter_offset)(const uint filter, const LANES(Points) point)
{
    LANES(Points) offset;
    if (filter == CASTOR_FILTER_GAUSSIAN) return LANES(gaussian_offset)(point);
    if (filter == CASTOR_FILTER_TENT) {
        offset.x = LANES(tent_offset)(point.x);
        offset.y = LANES(tent_offset)(point.y);
    } else {
        offset.x = point.x - 0.5f;
        offset.y = point.y - 0.5f;
    }
    return offset;
}

// Returns the points of the image through which samples of pixels go.
CASTOR_INLINE LANES(Points)
    LANES(sample_position)(const RenderParams params, const LANES(Pixels) pixel, const LANES(SampleNumbers) numbers)
{
    LANES(Points) at;
    at.x = LANES(convert_float)(pixel.x) + 0.5f;
    at.y = LANES(convert_float)(pixel.y) + 0.5f;
    if (params.flags & CASTOR_RENDER_PIXEL_CENTRES) return at;
    const LANES(Points) point = LANES(sample_square)(numbers.pixel, numbers.sample, params.seed);
    const LANES(Points) offset = LANES(filter_offset)(params.filter, point);
    at.x += offset.x;
    at.y += offset.y;
    return at;
}
