// CASTOR_LANES paths a work-item (see lanes.cl), at the first bounce. Writes as the diffuse reflectance of principled
// surfaces their base colour, after textures and colours of vertices, for planes of albedos (device/albedo_of_hit.cl).
#include "castor/shared/wave_columns.h"
#include "device/hits.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/principled_surface.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/shading.lanes.cl"

kernel CASTOR_IN_LANES void LANES(find_base_colors)(
    const RenderParams params, const PathParams path, const global Material *restrict materials,
    const global PrincipledMaterial *restrict principled_materials, const global Texture *restrict textures,
    const global TextureImage *restrict texture_images, const global uint *restrict texels, CASTOR_READ(pixel_blocks),
    CASTOR_READ(path_slot), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_READ(surface_normal),
    CASTOR_READ(surface_material), CASTOR_READ(surface_uvs), CASTOR_READ(surface_tangent), CASTOR_READ(surface_color),
    CASTOR_WRITE(surface_diffuse))
{
#if CASTOR_HAS_ATTRIBUTES
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Whole known_number = is_met ? material_number : (Whole)(0);
    const LANES(Materials) material = LANES(load_materials)(materials, known_number);
    const Mask is_principled = is_met & (material.kind == CASTOR_MATERIAL_PRINCIPLED);
#if CASTOR_HAS_TEXTURES
    LANES(Rows) diffuse = LANES(load_rows)(surface_diffuse + place);
#else
    LANES(Rows) diffuse = {material.diffuse.x, material.diffuse.y, material.diffuse.z, (Real)(0.0f)};
#endif
    if (LANES(mask_of)(is_principled)) {
        const Whole word = LANES(principled_numbers)(materials, known_number);
        const LANES(Vectors) along = LANES(load_vectors)(ray_direction_tmax + place);
        const LANES(Rows) tangent = LANES(load_rows)(surface_tangent + place);
        const PrincipledTextures of_textures = {principled_materials, textures, texture_images, texels};
        const LANES(Rows) of_vertices = LANES(load_rows)(surface_color + place);
        const Real width = (is_met ? LANES(load_hits)(hits + place).t : (Real)(0.0f)) *
                           LANES(square_root)(LANES(dot_products)(along, along)) * path.pixel_spread;
        const LANES(TexturePlaces) at = LANES(texture_places)(
            LANES(load_rows)(surface_uvs + place), tangent, of_vertices, width,
            LANES(points_of_slots)(params, pixel_blocks, LANES(slots)(params, path_slot, place, is_path),
                                   LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_TEXEL)));
        const LANES(PrincipledSurfaces) surface = LANES(principled_surfaces)(
            of_textures, is_principled ? word : (Whole)(0), is_principled, LANES(load_vectors)(surface_normal + place),
            tangent, LANES(scaled_vectors)(LANES(normalized_vectors)(along), (Real)(-1.0f)),
            LANES(vectors_of_rows)(of_vertices), at);
        const LANES(Vectors) color = surface.material.base_color;
        diffuse.x = is_principled ? color.x : diffuse.x;
        diffuse.y = is_principled ? color.y : diffuse.y;
        diffuse.z = is_principled ? color.z : diffuse.z;
        diffuse.w = is_principled ? (Real)(0.0f) : diffuse.w;
    }
    LANES(store_rows)(diffuse.x, diffuse.y, diffuse.z, diffuse.w, surface_diffuse + place);
#endif
}
