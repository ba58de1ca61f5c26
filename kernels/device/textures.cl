// The textures of a scene (see Texture, types.h): colours and changed normals at points of surfaces.
#include "device/textured_point.cl"

typedef struct TextureColumns {
    const global Texture *textures;
    const global TextureImage *images;
    const global uint *texels;
} TextureColumns;

// Tells whether a texture is a function of texture coordinates alone.
CASTOR_INLINE int is_plain_picture(const global Texture *texture)
{
    return texture->kind == CASTOR_TEXTURE_IMAGE && texture->filter != CASTOR_TEXTURE_TRILINEAR &&
           texture->target < CASTOR_TARGET_NORMAL_MAP;
}

// Returns a checkerboard's colour: coordinates are rounded towards zero, so that the cells at zero are twice as long.
CASTOR_INLINE float3 checker_colour(const global Texture *texture, const float3 position)
{
    const float3 cell = (position + texture->checker_offset) * texture->checker_scale;
    uint parity = 0;
    // From 2^24 on all floats are even.
    parity ^= fabs(cell.x) < 16777216.0f ? as_uint(convert_int(cell.x)) : 0u;
    parity ^= fabs(cell.y) < 16777216.0f ? as_uint(convert_int(cell.y)) : 0u;
    parity ^= fabs(cell.z) < 16777216.0f ? as_uint(convert_int(cell.z)) : 0u;
    return vload3(0, parity & 1u ? texture->black : texture->white);
}

// Returns a texture's noise in [0, 1] (w), and its slope.
CASTOR_INLINE float4 noise_value(const global Texture *texture, const float3 position)
{
    float4 noise = noise_of_octaves(position * texture->noise_scale, texture->noise_octaves);
    noise.xyz *= texture->noise_scale;
    if (texture->noise_conversion == CASTOR_NOISE_ABSOLUTE) return noise.w < 0.0f ? -noise : noise;
    noise *= 0.5f;
    noise.w += 0.5f;
    return noise;
}

// Returns the coordinates in a picture of a surface's texture coordinates.
CASTOR_INLINE float2 picture_coordinates(const global Texture *texture, const float2 uv)
{
    const global float *to_u = texture->transform_u, *to_v = texture->transform_v;
    return (float2)(fma(to_u[0], uv.x, fma(to_u[1], uv.y, to_u[2])), fma(to_v[0], uv.x, fma(to_v[1], uv.y, to_v[2])));
}

// Returns the texel of a picture, as the file has it.
CASTOR_INLINE float3 picture_texel(const TextureColumns columns, const global Texture *texture, const float2 uv,
                                   const float level)
{
    const float2 at = picture_coordinates(texture, uv);
    return filtered_texel(columns.texels, columns.images[texture->image], texture->filter, texture->wrap, at.x, at.y,
                          level);
}

// Returns a colour of which 1 reflects all light. `level`: of trilinear pictures.
CASTOR_INLINE float3 texture_colour(const TextureColumns columns, const global Texture *texture,
                                    const TexturedPoint point, const float level)
{
    if (texture->kind == CASTOR_TEXTURE_PERLIN) return (float3)(noise_value(texture, point.position).w);
    if (texture->kind == CASTOR_TEXTURE_CHECKERBOARD) return checker_colour(texture, point.position);
    return picture_texel(columns, texture, point.uv, level) * divide(1.0f, texture->normalizer);
}

// Returns what a surface sends that sends the texture itself: 255 is white.
CASTOR_INLINE float3 texture_light(const TextureColumns columns, const global Texture *texture,
                                   const TexturedPoint point, const float level)
{
    if (texture->kind == CASTOR_TEXTURE_IMAGE) return picture_texel(columns, texture, point.uv, level);
    return 255.0f * texture_colour(columns, texture, point, level);
}

CASTOR_INLINE float3 unit_vector(const float3 v) { return float3_of(normalized_vectors(vectors_of(v))); }

// Returns a normal from a normal map: texel / 127.5 - 1 along dp/du, dp/dv and the normal.
CASTOR_INLINE float3 mapped_normal(const float3 texel, const TexturedPoint point)
{
    const float3 c = fma(texel, (float3)(0.007843138f), (float3)(-1.0f));  // 1 / 127.5
    const float3 changed = fma((float3)(c.x), unit_vector(point.along_u),
                               fma((float3)(c.y), unit_vector(point.along_v), c.z * point.normal));
    return unit_vector(changed);
}

CASTOR_INLINE float bump_height(const TextureColumns columns, const global Texture *texture, const float2 uv,
                                const float level)
{
    const float3 texel = picture_texel(columns, texture, uv, level);
    return (texel.x + texel.y + texel.z) * 0.33333334f * texture->bump_factor;
}

// Returns the normal of the surface that heights of a picture displace (Blinn 1978, "Simulation of Wrinkled Surfaces"):
// (dp/du + du n) x (dp/dv + dv n), where du and dv are the heights' differences from a texel to the next.
CASTOR_INLINE float3 bumped_normal(const TextureColumns columns, const global Texture *texture,
                                   const TexturedPoint point, const float level)
{
    const TextureImage image = columns.images[texture->image];
    const float2 step = (float2)(divide(1.0f, convert_float(image.width)), divide(1.0f, convert_float(image.height)));
    const float here = bump_height(columns, texture, point.uv, level);
    const float du = bump_height(columns, texture, point.uv + (float2)(step.x, 0.0f), level) - here;
    const float dv = bump_height(columns, texture, point.uv + (float2)(0.0f, step.y), level) - here;
    const float3 changed = unit_vector(
        cross_product(fma((float3)(du), point.normal, point.along_u), fma((float3)(dv), point.normal, point.along_v)));
    return dot_product(changed, point.normal) < 0.0f ? -changed : changed;
}

// Returns the normal of the surface that noise displaces: n less the slope within the surface (Perlin 1985, "An Image
// Synthesizer").
CASTOR_INLINE float3 noisy_normal(const global Texture *texture, const TexturedPoint point)
{
    const float3 slope = noise_value(texture, point.position).xyz;
    const float3 within = slope - dot_product(slope, point.normal) * point.normal;
    return unit_vector(fma((float3)(-texture->bump_factor), within, point.normal));
}

// Returns the normal that a normal map or a bump map gives; the point's own where there is none to give.
CASTOR_INLINE float3 changed_normal(const TextureColumns columns, const global Texture *texture,
                                    const TexturedPoint point, const float level)
{
    float3 normal = point.normal;
    const int has_axes = point.along_v.x != 0.0f || point.along_v.y != 0.0f || point.along_v.z != 0.0f;
    if (texture->kind == CASTOR_TEXTURE_PERLIN && texture->target == CASTOR_TARGET_BUMP_MAP)
        normal = noisy_normal(texture, point);
    else if (texture->kind == CASTOR_TEXTURE_IMAGE && has_axes)
        normal = texture->target == CASTOR_TARGET_BUMP_MAP
                     ? bumped_normal(columns, texture, point, level)
                     : mapped_normal(picture_texel(columns, texture, point.uv, level), point);
    const float length_squared = dot_product(normal, normal);
    return length_squared > 0.5f ? normal : point.normal;  // NaN and (0,0,0) are no directions
}

// Returns the level of a picture whose texels are as large as a pixel's cone (Amanatides 1984, "Ray Tracing with
// Cones") where it meets the surface: with a the area of the cone's cut through the surface, and b that of a texel,
// log2(a / b) / 2. The cone begins at the ray's origin. `direction`: in the object's space.
CASTOR_INLINE float level_of_cone(const TextureImage image, const TexturedPoint point, const float t,
                                  const float3 direction, const float pixel_spread)
{
    const float3 across = cross_product(point.along_u, point.along_v);
    const float surface_area = vector_length(across);  // of a picture
    const float width = t * vector_length(direction) * pixel_spread;
    const float cosine = fabs(dot_product(point.normal, unit_vector(direction)));
    const float texels = convert_float(image.width) * convert_float(image.height);
    const float ratio = divide(width * width * texels, larger(surface_area * cosine, FLT_MIN));
    if (!(ratio > 1.0f)) return 0.0f;
    return 0.5f * logarithm2(smaller(ratio, FLT_MAX));
}
