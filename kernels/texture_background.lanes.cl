// CASTOR_LANES slots a work-item (see lanes.cl), whose places are the same. Writes what eye rays see that meet nothing:
// the texels of the pixels (i, j) of an n x m picture at u = i / n, v = j / m.
#include "castor/shared/wave_columns.h"
#include "device/camera.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/texture_lookup.lanes.cl"

kernel CASTOR_IN_LANES void LANES(texture_background)(const TextureParams texture_params, const RenderParams params,
                                                      const Camera camera, const global Texture *restrict textures,
                                                      const global TextureImage *restrict texture_images,
                                                      const global uint *restrict texels, CASTOR_READ(pixel_blocks),
                                                      CASTOR_READ(surface_material), CASTOR_WRITE(surface_diffuse))
{
    const uint slot = get_global_id(0) * CASTOR_LANES;
    if (slot >= texture_params.path_count) return;
    const Mask is_missed = LANES(is_place)(slot, texture_params.path_count) &
                           (LANES(load_whole_column)(surface_material + slot) == CASTOR_INVALID_INDEX);
    if (!LANES(mask_of)(is_missed)) return;
    const LANES(Pixels) pixel = LANES(pixels_of_slots)(params, pixel_blocks, slot);
    const Texture texture = textures[texture_params.background];
    const Real u = LANES(divide)(LANES(convert_float)(pixel.x), (Real)(convert_float(camera.width)));
    const Real v = LANES(divide)(LANES(convert_float)(pixel.y), (Real)(convert_float(camera.height)));
    const LANES(Vectors) texel = LANES(filtered_texels)(texels, texture_images + texture.image, texture.filter,
                                                        texture.wrap, u, v, (Real)(0.0f));
    const LANES(Rows) before = LANES(load_rows)(surface_diffuse + slot);
    const Real w = is_missed ? (Real)(0.0f) : before.w;
    const LANES(Vectors) seen = LANES(choose_vectors)(is_missed, texel, LANES(vectors_of_rows)(before));
    LANES(store_rows)(seen.x, seen.y, seen.z, w, surface_diffuse + slot);
}
