// Principled surfaces where rays met them: their parameters after textures and vertex colours, and the frame in which
// they scatter, for CASTOR_LANES lanes (see lanes.cl).
//
// A texture gives one texel, at random, of those that a filter would take the mean of (Pharr and others 2024,
// "Filtering After Shading With Stochastic Texture Filtering"). The level is that of the path's cone, which widens with
// the length of the path (Amanatides 1984, "Ray Tracing with Cones").
#include "castor/shared/wave_columns.h"
#include "device/features.cl"
#include "device/frame.lanes.cl"
#include "device/principled_bsdf.lanes.cl"
#include "device/random.lanes.cl"
#include "device/srgb_table.cl"
#include "device/texture_lookup.lanes.cl"

typedef struct LANES(PrincipledSurfaces) {
    LANES(PrincipledMaterials) material;
    LANES(Frames) frame;         // z: the normal after normal maps, outward; x: the direction of anisotropy
    LANES(Vectors) coat_normal;  // outward; of the clear coat, where material.has_coat_normal
    LANES(Vectors) emission;     // what multiplies the material's
    Mask is_unlit;               // nothing is scattered
} LANES(PrincipledSurfaces);

#if CASTOR_HAS_ATTRIBUTES
// What textures are read by.
typedef struct PrincipledTextures {
    const global PrincipledMaterial *materials;
    const global Texture *textures;
    const global TextureImage *images;
    const global uint *texels;
} PrincipledTextures;

// Where surfaces are in their textures.
typedef struct LANES(TexturePlaces) {
    LANES(Rows) uvs;  // (x, y): the first coordinates, (z, w): the second
    // The square root of the area, in the first coordinates and in the second, of an area 1 in the world.
    Real uvs_per_length, second_per_length;
    Real width;            // of the path's cone
    LANES(Points) jitter;  // which texel is taken
} LANES(TexturePlaces);

// `tangent`, `of_vertices`: what find_attributes wrote to surface_tangent and surface_color.
CASTOR_INLINE LANES(TexturePlaces)
    LANES(texture_places)(const LANES(Rows) uvs, const LANES(Rows) tangent, const LANES(Rows) of_vertices,
                          const Real width, const LANES(Points) jitter)
{
    LANES(TexturePlaces) at;
    at.uvs = uvs;
    at.uvs_per_length = fabs(tangent.w);
    at.second_per_length = of_vertices.w;
    at.width = width;
    at.jitter = jitter;
    return at;
}

// Levels of a picture, each lane's own.
typedef struct LANES(Levels) {
    Whole width;
    Whole height;
    Whole first_texel;
} LANES(Levels);

CASTOR_INLINE LANES(Levels) LANES(picture_itself)(const TextureImage image)
{
    LANES(Levels) level;
    level.width = (Whole)(image.width);
    level.height = (Whole)(image.height);
    level.first_texel = (Whole)(image.first_texel);
    return level;
}

// Returns levels `by` below these.
CASTOR_INLINE LANES(Levels) LANES(levels_below)(LANES(Levels) level, const TextureImage image, const Whole by)
{
    const uint words = image.format == CASTOR_TEXELS_FLOATS ? 3u : 1u;
    for (uint i = 0; LANES(mask_of)(by > i); ++i) {
        const Mask goes_on = by > i;
        const Whole after = level.first_texel + level.width * level.height * words;
        level.first_texel = goes_on ? after : level.first_texel;
        level.width = goes_on ? max(level.width / 2u, (Whole)(1)) : level.width;
        level.height = goes_on ? max(level.height / 2u, (Whole)(1)) : level.height;
    }
    return level;
}

// Returns the bits of texels of a picture of bytes; of all lanes one texture.
CASTOR_ONCE Whole LANES(random_texels)(const PrincipledTextures from, const uint number,
                                       const LANES(TexturePlaces) place)
{
    const global Texture *const texture = from.textures + number;
    const TextureImage image = from.images[texture->image];
    const int is_second = texture->coordinate_set == 1u;
    const Real u = is_second ? place.uvs.z : place.uvs.x, v = is_second ? place.uvs.w : place.uvs.y;
    const global float *const to_u = texture->transform_u, *const to_v = texture->transform_v;
    const Real at_u = fma((Real)(to_u[0]), u, fma((Real)(to_u[1]), v, (Real)(to_u[2])));
    const Real at_v = fma((Real)(to_v[0]), u, fma((Real)(to_v[1]), v, (Real)(to_v[2])));
    LANES(Levels) level = LANES(picture_itself)(image);
    Real jitter_x = place.jitter.x - 0.5f, jitter_y = place.jitter.y - 0.5f;
    if (texture->filter == CASTOR_TEXTURE_NEAREST) {
        jitter_x = jitter_y = (Real)(0.0f);
    } else if (texture->filter == CASTOR_TEXTURE_TRILINEAR) {
        const float area = fabs(fma(to_u[0], to_v[1], -(to_u[1] * to_v[0])));
        const Real scale = LANES(square_root)((Real)(area * convert_float(image.width) * convert_float(image.height)));
        const Real texels = place.width * (is_second ? place.second_per_length : place.uvs_per_length) * scale;
        const Mask is_far = texels > 1.0f;
        if (LANES(mask_of)(is_far)) {
            // The lower half of the bits of the jitter is as good as another random number.
            const Real low = place.jitter.x * 4096.0f;
            const Real rest = low - LANES(rounded_down)(low);
            const Real last = (Real)(convert_float(image.level_count - 1u));
            const Real wanted = LANES(logarithm2)(LANES(smaller)(is_far ? texels : (Real)(1.0f), (Real)(FLT_MAX)));
            const Whole by = LANES(convert_uint)(LANES(smaller)(wanted + rest, last));
            level = LANES(levels_below)(level, image, is_far ? by : (Whole)(0));
        }
    }
    const Real width = LANES(convert_float)(level.width), height = LANES(convert_float)(level.height);
    const Real moved_u = at_u + LANES(divide)(jitter_x, width), moved_v = at_v + LANES(divide)(jitter_y, height);
    const Whole x = LANES(convert_uint)(LANES(wrapped_coordinates)(moved_u, CASTOR_WRAP_OF_U(texture->wrap)) * width);
    const Whole y = LANES(convert_uint)(LANES(wrapped_coordinates)(moved_v, CASTOR_WRAP_OF_V(texture->wrap)) * height);
    return LANES(gather_wholes)(
        from.texels, level.first_texel + min(y, level.height - 1u) * level.width + min(x, level.width - 1u), 1);
}

CASTOR_INLINE Real LANES(linear_channels)(const Whole texel, const uint shift)
{
    return LANES(as_float)(LANES(gather_entries)(linear_of_srgb, (texel >> shift) & 255u));
}
CASTOR_INLINE LANES(Vectors) LANES(linear_colours)(const Whole texel)
{
    return LANES(vectors)(LANES(linear_channels)(texel, 0u), LANES(linear_channels)(texel, 8u),
                          LANES(linear_channels)(texel, 16u));
}
// Returns a channel of texels, in [0, 1]; 1 where not `counts`.
CASTOR_INLINE Real LANES(channels)(const Whole texel, const uint shift, const Mask counts)
{
    return counts ? LANES(convert_float)((texel >> shift) & 255u) * (Real)(0.003921569f) : (Real)(1.0f);  // 1 / 255
}

// Multiplies colours by linear ones where `counts`.
CASTOR_INLINE LANES(Vectors) LANES(times_colours)(const LANES(Vectors) colour, const Whole texel, const Mask counts)
{
    return LANES(choose_vectors)(counts, LANES(product_of_vectors)(colour, LANES(linear_colours)(texel)), colour);
}

// Returns what texels of normal maps say, in the tangents' frame; not of length 1.
CASTOR_INLINE LANES(Vectors) LANES(mapped_normals)(const Whole texel, const float normal_scale)
{
    const Real scale = (Real)(0.007843138f), shift = (Real)(-1.0f);  // 1 / 127.5
    const LANES(Vectors) bytes = LANES(colours_of_bytes)(texel);
    return LANES(vectors)(normal_scale * fma(bytes.x, scale, shift), normal_scale * fma(bytes.y, scale, shift),
                          fma(bytes.z, scale, shift));
}

#define CASTOR_RED 0u
#define CASTOR_GREEN 8u
#define CASTOR_BLUE 16u
#define CASTOR_ALPHA 24u

// Applies the textures of one material where `counts`. `texture`: CASTOR_INVALID_INDEX where there is none. `normal`,
// `coat_normal`: in the tangents' frame. `turn`: cosine and sine of the direction of anisotropy.
CASTOR_INLINE void LANES(apply_textures)(const PrincipledTextures from, const uint number, const Mask counts,
                                         const LANES(TexturePlaces) place, LANES(PrincipledSurfaces) * surface,
                                         LANES(Vectors) * normal, LANES(Vectors) * coat_normal, LANES(Twos) * turn)
{
    const global PrincipledMaterial *const m = from.materials + number;
    LANES(PrincipledMaterials) *const material = &surface->material;
    for (uint slot = 0; slot < CASTOR_TEXTURE_SLOTS; ++slot) {
        const uint texture = m->texture[slot];
        if (texture == CASTOR_INVALID_INDEX) continue;
        const Whole texel = LANES(random_texels)(from, texture, place);
        switch (slot) {
            case CASTOR_SLOT_BASE_COLOR:
                material->base_color = LANES(times_colours)(material->base_color, texel, counts);
                break;
            case CASTOR_SLOT_METALLIC_ROUGHNESS:
                material->roughness *= LANES(channels)(texel, CASTOR_GREEN, counts);
                material->metallic *= LANES(channels)(texel, CASTOR_BLUE, counts);
                break;
            case CASTOR_SLOT_NORMAL:
                *normal = LANES(choose_vectors)(counts, LANES(mapped_normals)(texel, m->normal_scale), *normal);
                break;
            case CASTOR_SLOT_CLEARCOAT_NORMAL:
                *coat_normal = LANES(choose_vectors)(counts, LANES(mapped_normals)(texel, m->clearcoat_normal_scale),
                                                     *coat_normal);
                break;
            case CASTOR_SLOT_IRIDESCENCE:
                material->film.share *= LANES(channels)(texel, CASTOR_RED, counts);
                break;
            case CASTOR_SLOT_IRIDESCENCE_THICKNESS: {
                const Real between = LANES(channels)(texel, CASTOR_GREEN, counts);
                const Real least = (Real)(m->iridescence_thickness_minimum);
                material->film.thickness =
                    counts ? fma(between, m->iridescence_thickness_maximum - least, least) : material->film.thickness;
                break;
            }
            case CASTOR_SLOT_EMISSION:
                surface->emission = LANES(times_colours)(surface->emission, texel, counts);
                break;
            case CASTOR_SLOT_SPECULAR:
                material->specular *= LANES(channels)(texel, CASTOR_ALPHA, counts);
                break;
            case CASTOR_SLOT_SPECULAR_COLOR:
                material->specular_color = LANES(times_colours)(material->specular_color, texel, counts);
                break;
            case CASTOR_SLOT_TRANSMISSION:
                material->transmission *= LANES(channels)(texel, CASTOR_RED, counts);
                break;
            case CASTOR_SLOT_DIFFUSE_TRANSMISSION:
                material->diffuse_transmission *= LANES(channels)(texel, CASTOR_ALPHA, counts);
                break;
            case CASTOR_SLOT_DIFFUSE_TRANSMISSION_COLOR:
                material->diffuse_transmission_color =
                    LANES(times_colours)(material->diffuse_transmission_color, texel, counts);
                break;
            case CASTOR_SLOT_DIFFUSE_ROUGHNESS:
                material->diffuse_roughness *= LANES(channels)(texel, CASTOR_RED, counts);
                break;
            case CASTOR_SLOT_CLEARCOAT:
                material->clearcoat *= LANES(channels)(texel, CASTOR_RED, counts);
                break;
            case CASTOR_SLOT_CLEARCOAT_ROUGHNESS:
                material->clearcoat_roughness *= LANES(channels)(texel, CASTOR_GREEN, counts);
                break;
            case CASTOR_SLOT_SHEEN_COLOR:
                material->sheen_color = LANES(times_colours)(material->sheen_color, texel, counts);
                break;
            case CASTOR_SLOT_SHEEN_ROUGHNESS:
                material->sheen_roughness *= LANES(channels)(texel, CASTOR_ALPHA, counts);
                break;
            case CASTOR_SLOT_ANISOTROPY: {
                // The direction, turned by the material's own angle: the product of two turns.
                const Real scale = (Real)(0.007843138f), shift = (Real)(-1.0f);  // 1 / 127.5
                const LANES(Vectors) bytes = LANES(colours_of_bytes)(texel);
                const Real x = fma(bytes.x, scale, shift), y = fma(bytes.y, scale, shift);
                const Real cosine = turn->x, sine = turn->y;
                turn->x = counts ? fma(cosine, x, -(sine * y)) : cosine;
                turn->y = counts ? fma(cosine, y, sine * x) : sine;
                material->anisotropy *= LANES(channels)(texel, CASTOR_BLUE, counts);
                break;
            }
        }
    }
}
#endif

// Returns the parameters of principled surfaces with these numbers, without textures.
CASTOR_INLINE LANES(PrincipledSurfaces)
    LANES(plain_principled_surfaces)(const global PrincipledMaterial *restrict materials, const Whole number,
                                     const LANES(Vectors) normal)
{
    const Real one = (Real)(1.0f);
    LANES(PrincipledSurfaces) surface;
    surface.material = LANES(load_principled_materials)(materials, number);
    surface.frame = LANES(frames)(normal);
    surface.coat_normal = normal;
    surface.emission = LANES(vectors)(one, one, one);
    surface.is_unlit = (surface.material.flags & CASTOR_PRINCIPLED_UNLIT) != (Whole)(0);
    return surface;
}

#if CASTOR_HAS_ATTRIBUTES
// Returns unit normals, of which `mapped` says where they are among tangents and normals.
CASTOR_INLINE LANES(Vectors) LANES(bent_normals)(const LANES(Vectors) mapped, const LANES(Vectors) along_x,
                                                 const LANES(Vectors) along_y, const LANES(Vectors) normal)
{
    return LANES(normalized_vectors)(LANES(points_on_rays)(
        LANES(points_on_rays)(LANES(scaled_vectors)(normal, mapped.z), mapped.x, along_x), mapped.y, along_y));
}

// Returns them after textures and vertex colours. `tangent`: what surface_tangent says; `wo`: unit, back along the
// rays; `color`: that of vertices.
CASTOR_ONCE LANES(PrincipledSurfaces)
    LANES(principled_surfaces)(const PrincipledTextures from, const Whole number, const Mask counts,
                               const LANES(Vectors) normal, const LANES(Rows) tangent, const LANES(Vectors) wo,
                               const LANES(Vectors) color, const LANES(TexturePlaces) place)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    LANES(PrincipledSurfaces) surface = LANES(plain_principled_surfaces)(from.materials, number, normal);
    surface.material.base_color = LANES(product_of_vectors)(surface.material.base_color, color);
    surface.emission = LANES(choose_vectors)(surface.is_unlit, color, surface.emission);

    // Tangents are made perpendicular to the normal.
    const LANES(Vectors) given = LANES(vectors_of_rows)(tangent);
    const LANES(Vectors) within =
        LANES(normalized_vectors)(LANES(points_on_rays)(given, -LANES(dot_products)(given, normal), normal));
    const Mask has_tangent = LANES(dot_products)(within, within) > 0.5f;
    const LANES(Vectors) along_x = LANES(choose_vectors)(has_tangent, within, surface.frame.x);
    const Real side = tangent.w < 0.0f ? (Real)(-1.0f) : one;
    const LANES(Vectors) along_y = LANES(scaled_vectors)(LANES(cross_products)(normal, along_x), side);

    LANES(Vectors) mapped = LANES(vectors)(zero, zero, one), mapped_coat = mapped;
    LANES(Twos) turn = {surface.material.anisotropy_cosine, surface.material.anisotropy_sine};
    Mask is_left = counts;
    while (LANES(mask_of)(is_left)) {
        const uint next = LANES(largest_of_lanes)(is_left ? number : (Whole)(0));
        const Mask is_alike = is_left & (number == next);
        is_left &= !is_alike;
        LANES(apply_textures)(from, next, is_alike, place, &surface, &mapped, &mapped_coat, &turn);
    }

    const LANES(Vectors) bent = LANES(bent_normals)(mapped, along_x, along_y, normal);
    // A normal that is turned away from the viewer, although the surface is not, is no use.
    const Mask is_kept = LANES(dot_products)(bent, wo) * LANES(dot_products)(normal, wo) > 0.0f;
    surface.frame.z = LANES(choose_vectors)(is_kept, bent, normal);
    const Mask is_other = (mapped.x != mapped_coat.x) | (mapped.y != mapped_coat.y) | (mapped.z != mapped_coat.z);
    surface.material.has_coat_normal = counts & is_other & (surface.material.clearcoat > 0.0f);
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(surface.material.has_coat_normal)) {
        const LANES(Vectors) of_coat = LANES(bent_normals)(mapped_coat, along_x, along_y, normal);
        const Mask is_seen = LANES(dot_products)(of_coat, wo) * LANES(dot_products)(normal, wo) > 0.0f;
        surface.coat_normal = LANES(choose_vectors)(is_seen, of_coat, normal);
    }
    const LANES(Vectors) grain = LANES(points_on_rays)(LANES(scaled_vectors)(along_y, turn.y), turn.x, along_x);
    const LANES(Vectors) x = LANES(normalized_vectors)(
        LANES(points_on_rays)(grain, -LANES(dot_products)(grain, surface.frame.z), surface.frame.z));
    const Mask has_x = LANES(dot_products)(x, x) > 0.5f;
    const LANES(Frames) other = LANES(frames)(surface.frame.z);
    surface.frame.x = LANES(choose_vectors)(has_x, x, other.x);
    surface.frame.y = LANES(cross_products)(surface.frame.z, surface.frame.x);
    return surface;
}
#endif
