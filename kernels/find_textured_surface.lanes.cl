// CASTOR_LANES paths a work-item (see lanes.cl). Stands in for find_surface where the scene has textures: writes the
// surfaces that rays met, if the chunk has them, with the reflectances and normals that the textures of their materials
// give them. surface_diffuse.w: 1 where a surface sends surface_diffuse itself.
#include "device/features.cl"
#include "device/find_surfaces.lanes.cl"
#include "device/textures.lanes.cl"

// How surfaces look: their reflectances and normals, and whether they send `diffuse` itself, without shading.
typedef struct LANES(Appearances) {
    LANES(Vectors) diffuse;
    LANES(Vectors) specular;
    LANES(Vectors) normal;  // in the object's space
    int sends_texel;
    int changes_normal;
} LANES(Appearances);

// Returns how surfaces look with one more texture, where `counts`. `direction`: of the rays, in the object's space.
CASTOR_INLINE LANES(Appearances)
    LANES(appearances_with)(const TextureColumns columns, const global Texture *texture, const float pixel_spread,
                            LANES(Appearances) appearance, const Mask counts, LANES(TexturedPoints) point, const Real t,
                            const LANES(Vectors) direction)
{
    const int is_picture = texture->kind == CASTOR_TEXTURE_IMAGE;
    const uint target = texture->target;
    const Real zero = (Real)(0.0f);
    Real level = zero;
    LANES(Vectors) texel = LANES(vectors)(zero, zero, zero);
    point.normal = appearance.normal;
    if (is_picture) {
        if (texture->filter == CASTOR_TEXTURE_TRILINEAR)
            level = LANES(levels_of_cones)(columns.images[texture->image], point, t, direction, pixel_spread);
        texel = LANES(picture_texels)(columns, texture, point.uv, level);
    }
    if (target >= CASTOR_TARGET_NORMAL_MAP) {
        appearance.normal = LANES(changed_normals)(columns, texture, counts, point, texel, level);
        appearance.changes_normal = 1;
        return appearance;
    }
    const LANES(Vectors) colour = is_picture ? LANES(scaled_vectors)(texel, (Real)(divide(1.0f, texture->normalizer)))
                                             : LANES(pattern_colours)(texture, counts, point.position);
    if (target == CASTOR_TARGET_REPLACE_ALL) {
        appearance.diffuse = is_picture ? texel : LANES(scaled_vectors)(colour, (Real)(255.0f));
        appearance.sends_texel = 1;
    } else if (target == CASTOR_TARGET_REPLACE_SPECULAR) {
        appearance.specular = colour;
    } else if (target == CASTOR_TARGET_BLEND_DIFFUSE && !appearance.sends_texel) {
        appearance.diffuse = LANES(scaled_vectors)(LANES(sum_of_vectors)(appearance.diffuse, colour), (Real)(0.5f));
    } else if (target == CASTOR_TARGET_REPLACE_DIFFUSE && !appearance.sends_texel) {
        appearance.diffuse = colour;
    }
    return appearance;
}

// Returns what other chunks may have written.
CASTOR_INLINE LANES(Rows) LANES(rows_before)(const SurfaceColumns columns, const global float4 *rows)
{
    if (columns.params.number_count > 0) return LANES(load_rows)(rows);
    const Real zero = (Real)(0.0f);
    const LANES(Rows) black = {zero, zero, zero, zero};
    return black;
}

CASTOR_INLINE LANES(Rows)
    LANES(replaced_rows)(LANES(Rows) rows, const Mask is_new, const LANES(Vectors) v, const float w)
{
    rows.x = is_new ? v.x : rows.x;
    rows.y = is_new ? v.y : rows.y;
    rows.z = is_new ? v.z : rows.z;
    rows.w = is_new ? (Real)(w) : rows.w;
    return rows;
}

// A function, since PoCL keeps what a kernel has in memory once for each work-item of a group.
CASTOR_ONCE void LANES(find_textured_surfaces)(
    const uint place, const TextureParams texture_params, CASTOR_SURFACE_PARAMETERS,
    const global float *restrict vertex_uv, const global Material *restrict materials,
    const global Texture *restrict textures, const global uint *restrict texture_uses,
    const global TextureImage *restrict texture_images, const global uint *restrict texels,
    CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_WRITE(surface_position),
    CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material), CASTOR_WRITE(surface_diffuse),
    CASTOR_WRITE(surface_specular))
{
    SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    columns.vertex_uv = vertex_uv;
    const TextureColumns of_textures = {textures, texture_images, texels};
    const LANES(FoundSurfaces) found =
        LANES(find_surfaces)(columns, place, texture_params.path_count, ray_origin_tmin, ray_direction_tmax, hits,
                             surface_position, surface_normal, surface_material);
    Mask is_left = found.is_found;
    if (!LANES(mask_of)(is_left)) return;
    LANES(Rows) diffuse = LANES(rows_before)(columns, surface_diffuse + place);
#if CASTOR_HAS_OTHER_TEXTURES
    LANES(Rows) specular = LANES(rows_before)(columns, surface_specular + place);
#endif
    // Surfaces of one material in one instance go side by side. Neighbours are mostly alike.
    while (LANES(mask_of)(is_left)) {
        const Whole none = (Whole)(0);
        const uint number = LANES(largest_of_lanes)(is_left ? found.surface.material : none);
        const Mask has_material = is_left & (found.surface.material == number);
        const uint in_instance = LANES(largest_of_lanes)(has_material ? found.hit.instance : none);
        const Mask is_alike = has_material & (found.hit.instance == in_instance);
        is_left &= !is_alike;
        const Material material = materials[number];
        const global uint *uses = texture_uses + material.first_texture;
        int is_plain = 1;
        for (uint i = 0; i < material.texture_count; ++i) is_plain &= is_plain_picture(textures + uses[i]);
        const global Instance *instance = columns.instances + in_instance;
        LANES(Surfaces) surface = found.surface;
        LANES(Vectors) direction = LANES(load_vectors)(ray_direction_tmax + place);
        const Mask is_triangle = found.primitive < columns.params.triangle_count;
        if (in_instance != 0 && (!is_plain || LANES(mask_of)(is_alike & !is_triangle))) {
            surface =
                LANES(surfaces_in_instance)(columns, instance, is_alike, found.primitive, found.hit.t, found.hit.u,
                                            found.hit.v, LANES(load_vectors)(ray_origin_tmin + place), direction);
            direction = LANES(rows_times)(&instance->to_object[0][0], direction, 0.0f);
        }
        const LANES(TexturedPoints) point =
            LANES(textured_points)(columns, is_alike, found.primitive, surface, !is_plain);
        LANES(Appearances) appearance;
        appearance.diffuse = LANES(same_vectors)(material.diffuse);
        appearance.specular = LANES(same_vectors)(material.specular);
        appearance.normal = point.normal;
        appearance.sends_texel = appearance.changes_normal = 0;
        for (uint i = 0; i < material.texture_count; ++i)
            appearance = LANES(appearances_with)(of_textures, textures + uses[i], texture_params.pixel_spread,
                                                 appearance, is_alike, point, found.hit.t, direction);
        diffuse = LANES(replaced_rows)(diffuse, is_alike, appearance.diffuse, appearance.sends_texel ? 1.0f : 0.0f);
#if CASTOR_HAS_OTHER_TEXTURES
        specular = LANES(replaced_rows)(specular, is_alike, appearance.specular, 0.0f);
#endif
        if (appearance.changes_normal) {
            const LANES(Vectors) before = LANES(load_vectors)(surface_normal + place);
            const LANES(Vectors) normal =
                in_instance != 0 ? LANES(world_normals)(instance, appearance.normal) : appearance.normal;
            LANES(store_vectors)(LANES(choose_vectors)(is_alike, normal, before), surface_normal + place);
        }
    }
    LANES(store_rows)(diffuse.x, diffuse.y, diffuse.z, diffuse.w, surface_diffuse + place);
#if CASTOR_HAS_OTHER_TEXTURES
    LANES(store_rows)(specular.x, specular.y, specular.z, specular.w, surface_specular + place);
#endif
}

kernel CASTOR_IN_LANES void LANES(find_textured_surface)(
    const TextureParams texture_params, CASTOR_SURFACE_PARAMETERS, const global float *restrict vertex_uv,
    const global Material *restrict materials, const global Texture *restrict textures,
    const global uint *restrict texture_uses, const global TextureImage *restrict texture_images,
    const global uint *restrict texels, CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax),
    CASTOR_READ(hits), CASTOR_WRITE(surface_position), CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material),
    CASTOR_WRITE(surface_diffuse), CASTOR_WRITE(surface_specular))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= texture_params.path_count) return;
    LANES(find_textured_surfaces)
    (place, texture_params, CASTOR_SURFACE_ARGUMENTS, vertex_uv, materials, textures, texture_uses, texture_images,
     texels, ray_origin_tmin, ray_direction_tmax, hits, surface_position, surface_normal, surface_material,
     surface_diffuse, surface_specular);
}
