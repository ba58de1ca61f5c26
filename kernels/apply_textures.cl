// A work-item a path, after find_surface. Writes the reflectances of the surfaces that rays met, if the chunk has them,
// and changes their normals, as the textures of their materials say. surface_diffuse.w: 1 where a surface sends
// surface_diffuse itself.
#include "castor/shared/wave_columns.h"
#include "device/textures.cl"

typedef struct Appearance {
    float4 diffuse;
    float3 specular;
} Appearance;

CASTOR_INLINE void apply_texture(Appearance *appearance, TexturedPoint *point, const TextureColumns columns,
                                 const global Texture *texture, const float level)
{
    const uint target = texture->target;
    const int sends_texel = appearance->diffuse.w != 0.0f;
    if (target == CASTOR_TARGET_NORMAL_MAP || target == CASTOR_TARGET_BUMP_MAP) {
        point->normal = changed_normal(columns, texture, *point, level);
    } else if (target == CASTOR_TARGET_REPLACE_ALL) {
        appearance->diffuse = (float4)(texture_light(columns, texture, *point, level), 1.0f);
    } else {
        const float3 colour = texture_colour(columns, texture, *point, level);
        if (target == CASTOR_TARGET_REPLACE_SPECULAR)
            appearance->specular = colour;
        else if (target == CASTOR_TARGET_BLEND_DIFFUSE && !sends_texel)
            appearance->diffuse = (float4)(0.5f * (appearance->diffuse.xyz + colour), 0.0f);
        else if (target == CASTOR_TARGET_REPLACE_DIFFUSE && !sends_texel)
            appearance->diffuse = (float4)(colour, 0.0f);
    }
}

kernel void apply_textures(const TextureParams texture_params, CASTOR_SURFACE_PARAMETERS,
                           const global Material *restrict materials, const global float *restrict vertex_uv,
                           const global Texture *restrict textures, const global uint *restrict texture_uses,
                           const global TextureImage *restrict texture_images, const global uint *restrict texels,
                           CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits),
                           CASTOR_READ(surface_material), CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_diffuse),
                           CASTOR_WRITE(surface_specular))
{
    const uint place = get_global_id(0);
    if (place >= texture_params.path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const global Material *material = materials + surface_material[place];
    Appearance appearance;
    appearance.diffuse = (float4)(vload3(0, material->diffuse), 0.0f);
    appearance.specular = vload3(0, material->specular);
    if (material->texture_count > 0) {
        const global uint *uses = texture_uses + material->first_texture;
        int needs_all = 0, changes_normal = 0;
        for (uint i = 0; i < material->texture_count; ++i) {
            needs_all |= !is_plain_picture(textures + uses[i]);
            changes_normal |= textures[uses[i]].target >= CASTOR_TARGET_NORMAL_MAP;
        }
        float3 direction = ray_direction_tmax[place].xyz;
        TexturedPoint point =
            textured_point(columns, vertex_uv, primitive, hit, ray_origin_tmin[place].xyz, direction, needs_all);
        const global Instance *instance = columns.instances + hit.instance;
        if (hit.instance != 0) direction = rows_times(&instance->to_object[0][0], direction, 0.0f);
        const TextureColumns of_scene = {textures, texture_images, texels};
        for (uint i = 0; i < material->texture_count; ++i) {
            const global Texture *texture = textures + uses[i];
            const float level = texture->filter == CASTOR_TEXTURE_TRILINEAR && texture->kind == CASTOR_TEXTURE_IMAGE
                                    ? level_of_cone(texture_images[texture->image], point, hit.t, direction,
                                                    texture_params.pixel_spread)
                                    : 0.0f;
            apply_texture(&appearance, &point, of_scene, texture, level);
        }
        if (changes_normal)
            surface_normal[place] =
                (float4)(hit.instance == 0 ? point.normal : world_normal(instance, point.normal), 0.0f);
    }
    surface_diffuse[place] = appearance.diffuse;
    surface_specular[place] = (float4)(appearance.specular, 0.0f);
}
