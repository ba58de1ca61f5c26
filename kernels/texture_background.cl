// A work-item a slot, whose place is the same. Writes what eye rays see that meet nothing: the texel of the pixel (i,
// j) of an n x m picture at u = i / n, v = j / m.
#include "castor/shared/wave_columns.h"
#include "device/camera.x1.cl"
#include "device/texture_lookup.cl"

kernel void texture_background(const TextureParams texture_params, const RenderParams params, const Camera camera,
                               const global Texture *restrict textures,
                               const global TextureImage *restrict texture_images, const global uint *restrict texels,
                               CASTOR_READ(pixel_blocks), CASTOR_READ(surface_material), CASTOR_WRITE(surface_diffuse))
{
    const uint slot = get_global_id(0);
    if (slot >= texture_params.path_count || surface_material[slot] != CASTOR_INVALID_INDEX) return;
    const Pixels pixel = pixels_of_slots(params, pixel_blocks, slot);
    const Texture texture = textures[texture_params.background];
    const float u = divide(convert_float(pixel.x), convert_float(camera.width));
    const float v = divide(convert_float(pixel.y), convert_float(camera.height));
    const float3 texel =
        filtered_texel(texels, texture_images[texture.image], texture.filter, texture.wrap, u, v, 0.0f);
    surface_diffuse[slot] = (float4)(texel, 0.0f);
}
