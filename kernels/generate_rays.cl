// One work-item a slot. Begins a path for each slot, in order: the eye ray of one sample of its pixel, and
// throughput 1. Each ray is counted in its slot of `ray_counts`.
#include "castor/shared/wave_columns.h"
#include "device/camera.cl"
#include "device/dead_ray.cl"

kernel void generate_rays(const RenderParams params, const Camera camera, CASTOR_READ(pixel_blocks),
                          CASTOR_WRITE(path_slot), CASTOR_WRITE(ray_origin_tmin), CASTOR_WRITE(ray_direction_tmax),
                          CASTOR_WRITE(path_throughput), CASTOR_WRITE(ray_counts))
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    const uint2 pixel = pixel_of_number(pixel_blocks, slot % params.pixel_count);
    float4 origin_tmin = dead_origin_tmin();
    float4 direction_tmax = dead_direction_tmax();
    if (pixel.x < camera.width && pixel.y < camera.height) {
        const float2 at = sample_position(params, pixel, params.sample + slot / params.pixel_count);
        origin_tmin = (float4)(camera.position[0], camera.position[1], camera.position[2], camera.t_min);
        direction_tmax = (float4)(camera_direction(camera, at.x, at.y), camera.t_max);
        ++ray_counts[slot];
    }
    path_slot[slot] = slot;
    ray_origin_tmin[slot] = origin_tmin;
    ray_direction_tmax[slot] = direction_tmax;
    path_throughput[slot] = (float4)(1.0f);
}
