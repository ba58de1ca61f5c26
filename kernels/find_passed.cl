// One work-item a path. Tells of each hit that the chunk has whether the surface is there: alpha is its share that is.
// passed: CASTOR_PASSED, CASTOR_STOPPED, or CASTOR_AT_PANE of a thin wall that is there, or a solid of index 1; 0 where
// the ray met nothing.
//
// What is there by chance is a function of sample, bounce and dimension. Two surfaces that a ray passes one after the
// other share a dimension, of which each has a coordinate, so that the samples of a pixel are as well spread over what
// two veils let pass as over anything else. `dimension`: see CASTOR_OPACITY_DIMENSION (sample_order.h).
#define CASTOR_SURFACES_HAVE_UVS 1
#include "castor/shared/wave_columns.h"
#include "device/attributes.cl"
#include "device/pixels.x1.cl"
#include "device/queue.x1.cl"
#include "device/texture_lookup.x1.cl"

CASTOR_INLINE float alpha_of_texel(const global uint *restrict texels, const TextureImage image, const uint x,
                                   const uint y)
{
    return convert_float(texels[image.first_texel + y * image.width + x] >> 24u) * 0.003921569f;  // 1 / 255
}

// Returns the alpha of a picture, interpolated between the middles of texels.
CASTOR_INLINE float alpha_of_texture(const Texture texture, const TextureImage image,
                                     const global uint *restrict texels, const float4 uvs)
{
    const float u = texture.coordinate_set == 1u ? uvs.z : uvs.x, v = texture.coordinate_set == 1u ? uvs.w : uvs.y;
    const float width = convert_float(image.width), height = convert_float(image.height);
    const uint wrap_u = CASTOR_WRAP_OF_U(texture.wrap), wrap_v = CASTOR_WRAP_OF_V(texture.wrap);
    const float shift = texture.filter == CASTOR_TEXTURE_NEAREST ? 0.0f : -0.5f;
    const float at_u = fma(texture.transform_u[0], u, fma(texture.transform_u[1], v, texture.transform_u[2]));
    const float at_v = fma(texture.transform_v[0], u, fma(texture.transform_v[1], v, texture.transform_v[2]));
    const float x = wrapped_coordinates(at_u + divide(shift, width), wrap_u) * width;
    const float y = wrapped_coordinates(at_v + divide(shift, height), wrap_v) * height;
    const uint left = min(convert_uint(x), image.width - 1u), upper = min(convert_uint(y), image.height - 1u);
    if (texture.filter == CASTOR_TEXTURE_NEAREST) return alpha_of_texel(texels, image, left, upper);
    const uint right = next_texels(left, image.width, wrap_u), lower = next_texels(upper, image.height, wrap_v);
    const float across = x - convert_float(left), down = y - convert_float(upper);
    const float a = alpha_of_texel(texels, image, left, upper), b = alpha_of_texel(texels, image, right, upper);
    const float c = alpha_of_texel(texels, image, left, lower), d = alpha_of_texel(texels, image, right, lower);
    const float above = fma(across, b - a, a), below = fma(across, d - c, c);
    return fma(down, below - above, above);
}

// Returns whether a ray passes a surface of this share.
CASTOR_INLINE int is_passed(const RenderParams wave, const uint node, const uint dimension,
                            const global uint *restrict pixel_blocks, const uint slot,
                            const PrincipledMaterial material, const float alpha)
{
    if (material.flags & CASTOR_PRINCIPLED_ALPHA_MASK) return alpha < material.alpha_cutoff;
    if (alpha >= 1.0f) return 0;
    const SampleNumbers numbers =
        sample_numbers(wave, pixels_of_any_slots(wave, pixel_blocks, slot), samples_of_slots(wave, slot));
    const uint of_two = dimension & ~CASTOR_SECOND_COORDINATE;
    const Points point = sample_dimension(numbers.pixel, numbers.sample, wave.seed, dimension_of_node(node, of_two));
    return (dimension & CASTOR_SECOND_COORDINATE ? point.y : point.x) >= alpha;
}

kernel void find_passed(const RenderParams wave, const uint node, const uint dimension, CASTOR_SURFACE_PARAMETERS,
                        const global float *restrict vertex_uv,
                        const global VertexAttributes *restrict vertex_attributes,
                        const global Material *restrict materials,
                        const global PrincipledMaterial *restrict principled_materials,
                        const global Texture *restrict textures, const global TextureImage *restrict texture_images,
                        const global uint *restrict texels, CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot),
                        CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits),
                        CASTOR_WRITE(passed))
{
    const uint place = get_global_id(0);
    if (place >= wave.path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) {
        passed[place] = 0;
        return;
    }
    SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    columns.vertex_uv = vertex_uv;
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const uint principled = materials[material_of_hit(columns, primitive, hit)].principled;
    const uint in_part = CASTOR_PRINCIPLED_ALPHA_MASK | CASTOR_PRINCIPLED_ALPHA_BLEND;
    int passes = 0, is_pane = 0;
    if (principled != CASTOR_INVALID_INDEX)
        is_pane = (principled_materials[principled].flags & (CASTOR_PRINCIPLED_THIN | CASTOR_PRINCIPLED_MATCHED)) &&
                  principled_materials[principled].transmission > 0.0f;
    if (principled != CASTOR_INVALID_INDEX && (principled_materials[principled].flags & in_part)) {
        const PrincipledMaterial material = principled_materials[principled];
        const MeshRange mesh = mesh_of_primitive(columns, primitive);
        const VertexAttributes attributes = attributes_of_hit(columns, vertex_attributes, mesh, primitive, hit);
        float alpha = material.alpha * attributes.color[3];
        const uint texture = material.texture[CASTOR_SLOT_BASE_COLOR];
        if (texture != CASTOR_INVALID_INDEX) {
            Surfaces surface =
                surface_in_object(columns, primitive, hit, ray_origin_tmin[place].xyz, ray_direction_tmax[place].xyz);
            add_coordinates_of_spheres(&surface, columns, 1, primitive);
            const float4 uvs = (float4)(surface.uv.x, surface.uv.y, attributes.uv_1[0], attributes.uv_1[1]);
            alpha *= alpha_of_texture(textures[texture], texture_images[textures[texture].image], texels, uvs);
        }
        passes = is_passed(wave, node, dimension, pixel_blocks, slots(wave, path_slot, place, 1), material, alpha);
    }
    passed[place] = passes ? CASTOR_PASSED : (is_pane ? CASTOR_AT_PANE : CASTOR_STOPPED);
}
