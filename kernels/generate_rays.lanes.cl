// CASTOR_LANES slots a work-item (see lanes.cl), which are of one pixel block. Begins a path for each slot, in order:
// the eye ray of one sample of its pixel.
#include "castor/shared/wave_columns.h"
#include "device/camera.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/slots.cl"

#define CASTOR_GENERATE_RAYS_PARAMETERS                                                                       \
    const RenderParams params, const Camera camera, CASTOR_READ(pixel_blocks), CASTOR_WRITE(ray_origin_tmin), \
        CASTOR_WRITE(ray_direction_tmax), CASTOR_WRITE(ray_counts)
#define CASTOR_GENERATE_RAYS_ARGUMENTS params, camera, pixel_blocks, ray_origin_tmin, ray_direction_tmax, ray_counts

CASTOR_ONCE void LANES(generate_rays_of_item)(const uint item, CASTOR_GENERATE_RAYS_PARAMETERS)
{
    const uint slot = item * CASTOR_LANES;
    if (slot >= slot_count(params)) return;
    const LANES(Pixels) pixel = LANES(pixels_of_slots)(params, pixel_blocks, slot);
    const LANES(SampleNumbers) numbers =
        LANES(sample_numbers)(params, pixel, LANES(samples_of_slots)(params, slot + LANES(lane_numbers)()));
    const LANES(Points) at = LANES(sample_position)(params, pixel, numbers);
    const Mask is_inside = (pixel.x < camera.width) & (pixel.y < camera.height);
    LANES(Points) lens_point = at;  // means nothing without a lens
    if (camera.projection == CASTOR_PROJECTION_LENS)
        lens_point =
            LANES(sample_dimension)(numbers.pixel, numbers.sample, params.seed, (Whole)(CASTOR_DIMENSION_LENS));
    const LANES(EyeRays) eye_ray = LANES(eye_rays)(camera, at, lens_point);
    LANES(PathRays) ray;
    ray.origin = eye_ray.origin;
    ray.t_min = (Real)(camera.t_min);
    ray.direction = eye_ray.direction;
    ray.t_max = (Real)(camera.t_max);
    ray = LANES(choose_rays)(is_inside, ray, LANES(dead_rays)());
    LANES(store_path_rays)(ray, ray_origin_tmin + slot, ray_direction_tmax + slot);
    ray_counts[item] += popcount(LANES(mask_of)(is_inside));
}

kernel CASTOR_IN_LANES void LANES(generate_rays)(CASTOR_GENERATE_RAYS_PARAMETERS)
{
    LANES(generate_rays_of_item)(get_global_id(0), CASTOR_GENERATE_RAYS_ARGUMENTS);
}
