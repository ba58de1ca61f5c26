// One work-item a slot. Writes its pixel's mean over the samples to its place in the tile, row-major, three floats a pixel.
#include "device/camera.cl"

kernel void resolve(const RenderParams params, const uint sample_count, const global float4 *restrict film_sum,
                    global float *restrict tile_pixels)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    const uint2 pixel = pixel_of_slot(params, slot);
    if (!is_in_tile(params, pixel)) return;
    const float count = (float)sample_count;
    const float3 sum = film_sum[slot].xyz;
    const float3 mean = (float3)(divide(sum.x, count), divide(sum.y, count), divide(sum.z, count));
    vstore3(mean, pixel.y * params.tile_width + pixel.x, tile_pixels);
}
