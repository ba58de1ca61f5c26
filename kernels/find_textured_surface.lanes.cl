// CASTOR_LANES paths a work-item (see lanes.cl). Stands in for find_surface where the scene has textures: writes the
// surfaces that rays met, if the chunk has them, with the reflectances and normals that the textures of their materials
// give them. surface_diffuse.w: 1 where a surface sends surface_diffuse itself.
#include "device/find_surfaces.lanes.cl"
#include "device/textures.lanes.cl"

// How surfaces look: their reflectances, and whether they send `diffuse` itself, without shading. What one texture
// after another changes is in memory, not in registers that calls have to save.
typedef struct LANES(Appearances) {
    LANES(Vectors) diffuse;
    LANES(Vectors) specular;
    int sends_texel;
    int changes_normal;
} LANES(Appearances);

CASTOR_INLINE LANES(Appearances) LANES(appearance_of_material)(const Material material)
{
    LANES(Appearances) appearance;
    appearance.diffuse = LANES(same_vectors)(material.diffuse);
    appearance.specular = LANES(same_vectors)(material.specular);
    appearance.sends_texel = appearance.changes_normal = 0;
    return appearance;
}

// Adds colours of a texture. `colour`: 1 reflects all light; `texel`: as the file has it.
CASTOR_INLINE void LANES(add_colours)(LANES(Appearances) * appearance, const uint target, const LANES(Vectors) colour,
                                      const LANES(Vectors) texel)
{
    if (target == CASTOR_TARGET_REPLACE_ALL) {
        appearance->diffuse = texel;
        appearance->sends_texel = 1;
    } else if (target == CASTOR_TARGET_REPLACE_SPECULAR) {
        appearance->specular = colour;
    } else if (target == CASTOR_TARGET_BLEND_DIFFUSE && !appearance->sends_texel) {
        appearance->diffuse = LANES(scaled_vectors)(LANES(sum_of_vectors)(appearance->diffuse, colour), (Real)(0.5f));
    } else if (target == CASTOR_TARGET_REPLACE_DIFFUSE && !appearance->sends_texel) {
        appearance->diffuse = colour;
    }
}

CASTOR_INLINE void LANES(add_texels)(LANES(Appearances) * appearance, const global Texture *texture,
                                     const LANES(Vectors) texel)
{
    const Real factor = (Real)(divide(1.0f, texture->normalizer));
    LANES(add_colours)(appearance, texture->target, LANES(scaled_vectors)(texel, factor), texel);
}

// Adds a texture that is no picture, where `counts`.
CASTOR_ONCE void LANES(add_pattern)(LANES(Appearances) * appearance, LANES(Surfaces) * surface,
                                    const global Texture *texture, const Mask counts)
{
#if CASTOR_SURFACES_HAVE_AXES
    if (texture->target >= CASTOR_TARGET_NORMAL_MAP) {
        if (texture->kind == CASTOR_TEXTURE_PERLIN && texture->target == CASTOR_TARGET_BUMP_MAP)
            surface->normal = LANES(noisy_normals)(texture, counts, *surface);
        appearance->changes_normal = 1;
        return;
    }
#endif
    const LANES(Vectors) colour = LANES(pattern_colours)(texture, counts, surface->position);
    LANES(add_colours)(appearance, texture->target, colour, LANES(scaled_vectors)(colour, (Real)(255.0f)));
}

#if CASTOR_SURFACES_HAVE_AXES
// Adds a picture that is trilinear or changes normals. `instance`: of the surfaces; 0: none.
CASTOR_ONCE void LANES(add_picture_with_axes)(LANES(Appearances) * appearance, LANES(Surfaces) * surface,
                                              const global TextureImage *images, const global uint *texels,
                                              const global Texture *texture, const Real t,
                                              const global float4 *ray_direction, const global Instance *instance,
                                              const float pixel_spread)
{
    const TextureColumns columns = {texture, images, texels};
    Real level = (Real)(0.0f);
    if (texture->filter == CASTOR_TEXTURE_TRILINEAR) {
        LANES(Vectors) direction = LANES(load_vectors)(ray_direction);
        if (instance) direction = LANES(rows_times)(instance->to_object, direction, 0.0f);
        level = LANES(levels_of_cones)(columns.images[texture->image], *surface, t, direction, pixel_spread);
    }
    const LANES(Vectors) texel = LANES(picture_texels)(columns, texture, surface->uv, level);
    if (texture->target < CASTOR_TARGET_NORMAL_MAP) {
        LANES(add_texels)(appearance, texture, texel);
        return;
    }
    surface->normal = LANES(changed_normals)(columns, texture, *surface, texel, level);
    appearance->changes_normal = 1;
}
#endif

// Adds the textures of a material, where `counts`.
CASTOR_ONCE void LANES(add_textures)(LANES(Appearances) * appearance, LANES(Surfaces) * surface,
                                     const TextureColumns columns, const global uint *uses, const uint use_count,
                                     const Mask counts, const Real t, const global float4 *ray_direction,
                                     const global Instance *instance, const float pixel_spread)
{
    for (uint i = 0; i < use_count; ++i) {
        const global Texture *texture = columns.textures + uses[i];
        if (is_plain_picture(texture)) {
            LANES(add_texels)(appearance, texture, LANES(picture_texels)(columns, texture, surface->uv, (Real)(0.0f)));
#if CASTOR_SURFACES_HAVE_AXES
        } else if (texture->kind == CASTOR_TEXTURE_IMAGE) {
            LANES(add_picture_with_axes)
            (appearance, surface, columns.images, columns.texels, texture, t, ray_direction, instance, pixel_spread);
#endif
        } else {
            LANES(add_pattern)(appearance, surface, texture, counts);
        }
    }
}

// Tells what the textures of a material need beside texture coordinates.
typedef struct TextureNeeds {
    int points;  // of the object's space: some texture is a pattern
    int more;    // points, or axes
} TextureNeeds;

CASTOR_INLINE TextureNeeds needs_of_textures(const global Texture *textures, const global uint *uses,
                                             const uint use_count)
{
    TextureNeeds needs = {0, 0};
    for (uint i = 0; i < use_count; ++i) {
        needs.points |= textures[uses[i]].kind != CASTOR_TEXTURE_IMAGE;
        needs.more |= !is_plain_picture(textures + uses[i]);
    }
    return needs;
}

// Returns what textures are functions of, where `counts`. `instance`: of the surfaces; 0: none. `is_plain`: textures
// are functions of texture coordinates alone.
CASTOR_ONCE LANES(Surfaces)
    LANES(textured_points)(const SurfaceColumns columns, const LANES(FoundSurfaces) found, const Mask counts,
                           const global Instance *instance, const int is_plain, const global float4 *ray_origin,
                           const global float4 *ray_direction)
{
    const LANES(Hits) hit = found.hit;
    const LANES(Vectors) origin = LANES(load_vectors)(ray_origin), direction = LANES(load_vectors)(ray_direction);
    const Mask is_triangle = found.primitive < columns.params.triangle_count;
    LANES(Surfaces) surface = found.surface;
    if (instance && (!is_plain || LANES(mask_of)(counts & !is_triangle)))
        surface = LANES(surfaces_in_instance)(columns, instance, counts, found.primitive, hit.t, hit.u, hit.v, origin,
                                              direction);
#if CASTOR_SURFACES_HAVE_AXES
    if (!instance && !is_plain)
        surface.edge =
            LANES(surfaces_in_place)(columns, counts, found.primitive, hit.t, hit.u, hit.v, origin, direction).edge;
#endif
    LANES(add_coordinates_of_spheres)(&surface, columns, counts, found.primitive);
    return surface;
}

// Stores (v, w) where `is_new`. `is_all`: whatever becomes of the others.
CASTOR_INLINE void LANES(store_new_rows)(const LANES(Vectors) v, const float w, const Mask is_new, const int is_all,
                                         global float4 *rows)
{
    if (is_all) {
        LANES(store_rows)(v.x, v.y, v.z, (Real)(w), rows);
        return;
    }
    const LANES(Rows) before = LANES(load_rows)(rows);
    LANES(store_rows)
    (is_new ? v.x : before.x, is_new ? v.y : before.y, is_new ? v.z : before.z, is_new ? (Real)(w) : before.w, rows);
}

#if CASTOR_LANES > 1
// find_textured_surfaces where every ray met a triangle in no instance but 0, or nothing, in a scene that is not cut,
// and these triangles have one material, with no patterns. Returns 0, and has done nothing, where that is not so.
// Apart, so that what is rare takes it no registers, and with pointers one by one: a struct goes through memory to a
// function.
CASTOR_ONCE int LANES(find_usual_surfaces)(
    const uint place, const uint path_count, const float pixel_spread, const uint flags, const uint mesh_count,
    const global MeshRange *mesh_ranges, const global uint *triangle_vertices, const global float *vertex_position,
    const global float *vertex_normal, const global float *vertex_uv, const global Geometry *geometries,
    const global Material *materials, const global Texture *textures, const global uint *texture_uses,
    const global TextureImage *texture_images, const global uint *texels, CASTOR_READ(ray_direction_tmax),
    CASTOR_READ(hits), CASTOR_WRITE(surface_position), CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material),
    CASTOR_WRITE(surface_diffuse), CASTOR_WRITE(surface_specular))
{
    const LANES(Hits) hit = LANES(load_hits)(hits + place);
    const Mask is_found = LANES(is_place)(place, path_count) & (hit.primitive != CASTOR_INVALID_INDEX);
    const Mask is_triangle = (hit.instance == 0u) & (hit.primitive < geometries[0].triangle_count);
    if (LANES(mask_of)(is_found & !is_triangle)) return 0;
    if (!LANES(mask_of)(is_found)) {
        const LANES(Surfaces) none = LANES(no_surfaces)();
        LANES(store_vectors)(none.position, surface_position + place);
        LANES(store_vectors)(none.normal, surface_normal + place);
        LANES(store_whole_column)(none.material, surface_material + place);
        return 1;
    }
    LANES(Surfaces)
    surface =
        LANES(surfaces_of_corners)(mesh_count, mesh_ranges, triangle_vertices, vertex_position, vertex_normal,
                                   vertex_uv, is_found, geometries[0].first_triangle + hit.primitive, hit.u, hit.v,
                                   flags & CASTOR_TRACE_BENDS_NORMALS, LANES(load_vectors)(ray_direction_tmax + place));
    const uint number = LANES(largest_of_lanes)(is_found ? surface.material : (Whole)(0));
    if (LANES(mask_of)(is_found & (surface.material != number))) return 0;
    const Material material = materials[number];
    const global uint *uses = texture_uses + material.first_texture;
    if (needs_of_textures(textures, uses, material.texture_count).points) return 0;
    LANES(store_vectors)(surface.position, surface_position + place);
    LANES(store_whole_column)
    (is_found ? (Whole)(number) : (Whole)(CASTOR_INVALID_INDEX), surface_material + place);
    LANES(Appearances) appearance = LANES(appearance_of_material)(material);
    for (uint i = 0; i < material.texture_count; ++i) {
        const global Texture *texture = textures + uses[i];
        const TextureColumns columns = {textures, texture_images, texels};
#if CASTOR_SURFACES_HAVE_AXES
        if (!is_plain_picture(texture)) {
            LANES(add_picture_with_axes)
            (&appearance, &surface, texture_images, texels, texture, hit.t, ray_direction_tmax + place, 0,
             pixel_spread);
            continue;
        }
#endif
        LANES(add_texels)(&appearance, texture, LANES(picture_texels)(columns, texture, surface.uv, (Real)(0.0f)));
    }
    LANES(store_vectors)(surface.normal, surface_normal + place);
    const Real w = (Real)(appearance.sends_texel ? 1.0f : 0.0f);
    LANES(store_rows)
    (appearance.diffuse.x, appearance.diffuse.y, appearance.diffuse.z, w, surface_diffuse + place);
#if CASTOR_HAS_OTHER_TEXTURES
    LANES(store_vectors)(appearance.specular, surface_specular + place);
#endif
    return 1;
}
#endif

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
    int is_all = found.is_usual;
    // Surfaces of one material in one instance go side by side. Neighbours are mostly alike.
    while (LANES(mask_of)(is_left)) {
        const Whole none = (Whole)(0);
        const uint number = LANES(largest_of_lanes)(is_left ? found.surface.material : none);
        Mask is_alike = is_left & (found.surface.material == number);
        const global Instance *instance = 0;
        if (!found.is_usual) {
            const uint in_instance = LANES(largest_of_lanes)(is_alike ? found.hit.instance : none);
            is_alike &= found.hit.instance == in_instance;
            if (in_instance != 0) instance = columns.instances + in_instance;
        }
        is_left &= !is_alike;
        is_all &= !LANES(mask_of)(is_left);
        const Material material = materials[number];
        const global uint *uses = texture_uses + material.first_texture;
        const TextureNeeds needs = needs_of_textures(textures, uses, material.texture_count);
        LANES(Surfaces) surface;
        if (found.is_usual && !needs.points) {
            surface.uv = found.surface.uv;
#if CASTOR_SURFACES_HAVE_AXES
            surface.normal = found.surface.normal;
            surface.edge = found.surface.edge;
#endif
        } else {
            surface = LANES(textured_points)(columns, found, is_alike, instance, !needs.more, ray_origin_tmin + place,
                                             ray_direction_tmax + place);
        }
        LANES(Appearances) appearance = LANES(appearance_of_material)(material);
        LANES(add_textures)
        (&appearance, &surface, of_textures, uses, material.texture_count, is_alike, found.hit.t,
         ray_direction_tmax + place, instance, texture_params.pixel_spread);
        const float w = appearance.sends_texel ? 1.0f : 0.0f;
        LANES(store_new_rows)(appearance.diffuse, w, is_alike, is_all, surface_diffuse + place);
#if CASTOR_HAS_OTHER_TEXTURES
        LANES(store_new_rows)(appearance.specular, 0.0f, is_alike, is_all, surface_specular + place);
#endif
#if CASTOR_SURFACES_HAVE_AXES
        if (appearance.changes_normal) {
            const LANES(Vectors) normal = instance ? LANES(world_normals)(instance, surface.normal) : surface.normal;
            LANES(store_new_rows)(normal, 0.0f, is_alike, is_all, surface_normal + place);
        }
#endif
    }
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
#if CASTOR_LANES > 1
    if (params.number_count == 0 &&
        LANES(find_usual_surfaces)(place, texture_params.path_count, texture_params.pixel_spread, params.flags,
                                   params.mesh_count, mesh_ranges, triangle_vertices, vertex_position, vertex_normal,
                                   vertex_uv, geometries, materials, textures, texture_uses, texture_images, texels,
                                   ray_direction_tmax, hits, surface_position, surface_normal, surface_material,
                                   surface_diffuse, surface_specular))
        return;
#endif
    LANES(find_textured_surfaces)
    (place, texture_params, CASTOR_SURFACE_ARGUMENTS, vertex_uv, materials, textures, texture_uses, texture_images,
     texels, ray_origin_tmin, ray_direction_tmax, hits, surface_position, surface_normal, surface_material,
     surface_diffuse, surface_specular);
}
