// The textures of a scene (see Texture, types.h): colours and changed normals at points of surfaces, for CASTOR_LANES
// lanes (see lanes.cl), which all have the same texture.
#include "device/sphere_coordinates.lanes.cl"
#include "device/texture_lookup.lanes.cl"
#include "device/textures.cl"

// Returns the colours of a checkerboard: coordinates are rounded towards zero, so that the cells at zero are twice as
// long.
CASTOR_INLINE Whole LANES(checker_cells)(const global Texture *texture, const Real position)
{
    const Real cell = (position + texture->checker_offset) * texture->checker_scale;
    const Mask is_small = fabs(cell) < 16777216.0f;  // from 2^24 on all floats are even
    return LANES(as_uint)(LANES(convert_int)(is_small ? cell : (Real)(0.0f)));
}

CASTOR_INLINE LANES(Vectors) LANES(checker_colours)(const global Texture *texture, const LANES(Vectors) position)
{
    const Whole parity = LANES(checker_cells)(texture, position.x) ^ LANES(checker_cells)(texture, position.y) ^
                         LANES(checker_cells)(texture, position.z);
    const Mask is_odd = (parity & 1u) != 0u;
    const Texture of = *texture;
    return LANES(choose_vectors)(is_odd, LANES(same_vectors)(of.black), LANES(same_vectors)(of.white));
}

// Noise in [0, 1], and its slope.
typedef struct LANES(Noises) {
    LANES(Vectors) slope;
    Real value;
} LANES(Noises);

// Noise takes so many steps that it is computed for one point after another, where `counts`.
CASTOR_INLINE LANES(Noises)
    LANES(noise_values)(const global Texture *texture, const Mask counts, const LANES(Vectors) position)
{
    LANES(Noises) noise;
#if CASTOR_LANES == 1
    const float4 found = noise_value(texture, (float3)(position.x, position.y, position.z));
    noise.slope = vectors(found.x, found.y, found.z);
    noise.value = found.w;
#else
    float4 points[CASTOR_LANES];
    float x[CASTOR_LANES], y[CASTOR_LANES], z[CASTOR_LANES], w[CASTOR_LANES];
    const Real zero = (Real)(0.0f);
    LANES(store_private_rows)(position.x, position.y, position.z, zero, points);
    LANES(store_reals)(zero, x);
    LANES(store_reals)(zero, y);
    LANES(store_reals)(zero, z);
    LANES(store_reals)(zero, w);
    for (uint left = LANES(mask_of)(counts); left; left &= left - 1) {
        const uint lane = lowest_bit(left);
        const float4 found = noise_value(texture, points[lane].xyz);
        x[lane] = found.x;
        y[lane] = found.y;
        z[lane] = found.z;
        w[lane] = found.w;
    }
    noise.slope = LANES(vectors)(LANES(vload)(0, x), LANES(vload)(0, y), LANES(vload)(0, z));
    noise.value = LANES(vload)(0, w);
#endif
    return noise;
}

// Returns the coordinates in a picture of surfaces' texture coordinates.
CASTOR_INLINE LANES(Twos) LANES(picture_coordinates)(const global Texture *texture, const LANES(Twos) uv)
{
    const global float *to_u = texture->transform_u, *to_v = texture->transform_v;
    const LANES(Twos) at = {fma((Real)(to_u[0]), uv.x, fma((Real)(to_u[1]), uv.y, (Real)(to_u[2]))),
                            fma((Real)(to_v[0]), uv.x, fma((Real)(to_v[1]), uv.y, (Real)(to_v[2])))};
    return at;
}

// Returns the texels of a picture, as the file has them. `level`: of trilinear pictures.
CASTOR_INLINE LANES(Vectors) LANES(picture_texels)(const TextureColumns columns, const global Texture *texture,
                                                   const LANES(Twos) uv, const Real level)
{
    const LANES(Twos) at = LANES(picture_coordinates)(texture, uv);
    return LANES(filtered_texels)(columns.texels, columns.images + texture->image, texture->filter, texture->wrap, at.x,
                                  at.y, level);
}

// Returns the colours, of which 1 reflects all light, of a texture that is no picture.
CASTOR_ONCE LANES(Vectors)
    LANES(pattern_colours)(const global Texture *texture, const Mask counts, const LANES(Vectors) position)
{
    if (texture->kind == CASTOR_TEXTURE_CHECKERBOARD) return LANES(checker_colours)(texture, position);
    const Real noise = LANES(noise_values)(texture, counts, position).value;
    return LANES(vectors)(noise, noise, noise);
}

#if CASTOR_SURFACES_HAVE_AXES
// Returns normals from a normal map: texel / 127.5 - 1 along dp/du, dp/dv and the normal.
CASTOR_INLINE LANES(Vectors)
    LANES(mapped_normals)(const LANES(Vectors) texel, const LANES(Axes) axis, const LANES(Vectors) n)
{
    const Real scale = (Real)(0.007843138f), shift = (Real)(-1.0f);  // 1 / 127.5
    const Real x = fma(texel.x, scale, shift), y = fma(texel.y, scale, shift), z = fma(texel.z, scale, shift);
    const LANES(Vectors) a = LANES(normalized_vectors)(axis.along_u);
    const LANES(Vectors) b = LANES(normalized_vectors)(axis.along_v);
    return LANES(normalized_vectors)(LANES(vectors)(
        fma(x, a.x, fma(y, b.x, z * n.x)), fma(x, a.y, fma(y, b.y, z * n.y)), fma(x, a.z, fma(y, b.z, z * n.z))));
}

CASTOR_INLINE Real LANES(bump_heights)(const global Texture *texture, const LANES(Vectors) texel)
{
    return (texel.x + texel.y + texel.z) * 0.33333334f * texture->bump_factor;
}

// Returns the normals of the surface that heights of a picture displace (Blinn 1978, "Simulation of Wrinkled
// Surfaces"): (dp/du + du n) x (dp/dv + dv n), where du and dv are the heights' differences from a texel to the next.
CASTOR_INLINE LANES(Vectors)
    LANES(bumped_normals)(const TextureColumns columns, const global Texture *texture, const LANES(Surfaces) surface,
                          const LANES(Axes) axis, const LANES(Vectors) texel, const Real level)
{
    const TextureImage image = columns.images[texture->image];
    const LANES(Twos) uv = surface.uv;
    const LANES(Twos) after_u = {uv.x + divide(1.0f, convert_float(image.width)), uv.y + 0.0f};
    const LANES(Twos) after_v = {uv.x + 0.0f, uv.y + divide(1.0f, convert_float(image.height))};
    const Real here = LANES(bump_heights)(texture, texel);
    const Real du = LANES(bump_heights)(texture, LANES(picture_texels)(columns, texture, after_u, level)) - here;
    const Real dv = LANES(bump_heights)(texture, LANES(picture_texels)(columns, texture, after_v, level)) - here;
    const LANES(Vectors) changed =
        LANES(normalized_vectors)(LANES(cross_products)(LANES(points_on_rays)(axis.along_u, du, surface.normal),
                                                        LANES(points_on_rays)(axis.along_v, dv, surface.normal)));
    const Mask is_turned = LANES(dot_products)(changed, surface.normal) < 0.0f;
    return LANES(choose_vectors)(is_turned, LANES(vectors)(-changed.x, -changed.y, -changed.z), changed);
}

// Returns `changed` where it is a direction, and not NaN or (0,0,0).
CASTOR_INLINE LANES(Vectors) LANES(directions_or)(const LANES(Vectors) changed, const LANES(Vectors) normal)
{
    const Mask is_direction = LANES(dot_products)(changed, changed) > 0.5f;
    return LANES(choose_vectors)(is_direction, changed, normal);
}

// Returns the normals of the surface that noise displaces: n less the slope within the surface (Perlin 1985, "An Image
// Synthesizer").
CASTOR_INLINE LANES(Vectors)
    LANES(noisy_normals)(const global Texture *texture, const Mask counts, const LANES(Surfaces) surface)
{
    const LANES(Vectors) slope = LANES(noise_values)(texture, counts, surface.position).slope;
    const LANES(Vectors) within = LANES(difference_of_vectors)(
        slope, LANES(scaled_vectors)(surface.normal, LANES(dot_products)(slope, surface.normal)));
    const LANES(Vectors) changed =
        LANES(normalized_vectors)(LANES(points_on_rays)(surface.normal, (Real)(-texture->bump_factor), within));
    return LANES(directions_or)(changed, surface.normal);
}

// Returns the normals that a normal map or a bump map gives, whose texels are `texel`; the surfaces' own where there is
// none to give.
CASTOR_INLINE LANES(Vectors)
    LANES(changed_normals)(const TextureColumns columns, const global Texture *texture, const LANES(Surfaces) surface,
                           const LANES(Vectors) texel, const Real level)
{
    const LANES(Axes) axis = LANES(axes_of_edges)(surface.edge);
    const LANES(Vectors) along_v = axis.along_v;
    const Mask has_axes = (along_v.x != 0.0f) | (along_v.y != 0.0f) | (along_v.z != 0.0f);
    const LANES(Vectors) changed = texture->target == CASTOR_TARGET_BUMP_MAP
                                       ? LANES(bumped_normals)(columns, texture, surface, axis, texel, level)
                                       : LANES(mapped_normals)(texel, axis, surface.normal);
    return LANES(directions_or)(LANES(choose_vectors)(has_axes, changed, surface.normal), surface.normal);
}

// Returns the levels of a picture whose texels are as large as a pixel's cone (Amanatides 1984, "Ray Tracing with
// Cones") where it meets the surface: with a the area of the cone's cut through the surface, and b that of a texel,
// log2(a / b) / 2, to 1e-4; below 0 where texels are larger. The cone begins at the ray's origin. `direction`: in the
// object's space.
//
// With l the direction's length, w = t l spread the cone's width, c the product of direction and normal, and D the
// determinant of the edges, which span |e1 x e2| of the surface: a = w^2 l / |c| and b = |e1 x e2| / (|D| texels). A
// sum of logarithms takes neither roots nor a division.
CASTOR_INLINE Real LANES(levels_of_cones)(const TextureImage image, const LANES(Surfaces) surface, const Real t,
                                          const LANES(Vectors) direction, const float pixel_spread)
{
    const LANES(Vectors) across = LANES(cross_products)(surface.edge.e1, surface.edge.e2);
    const Real determinant = LANES(determinants_of_edges)(surface.edge);
    const Real length_squared = LANES(dot_products)(direction, direction);
    const Real cosine = LANES(dot_products)(surface.normal, direction);  // times the length
    const float texels = convert_float(image.width) * convert_float(image.height);
    const Real cone = (t * t) * length_squared * (pixel_spread * pixel_spread * texels) * fabs(determinant);
    const Real twice = LANES(rough_logarithm2)(cone) - LANES(rough_logarithm2)(fabs(cosine));
    const Real four_times =
        LANES(rough_logarithm2)(length_squared) - LANES(rough_logarithm2)(LANES(dot_products)(across, across));
    const Real level = fma((Real)(0.5f), twice, 0.25f * four_times);
    return LANES(have_axes)(determinant) ? level : (Real)(convert_float(image.level_count));
}
#endif
