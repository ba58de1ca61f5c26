// Light from all directions, a picture of radiances, for CASTOR_LANES lanes (see lanes.cl). Between the middles of
// texels it is interpolated linearly.
#include "device/elementary.lanes.cl"
#include "device/environment_sampling.lanes.cl"
#include "device/frame.lanes.cl"
#include "device/random.lanes.cl"
#include "device/shading.lanes.cl"
#include "device/texture_lookup.lanes.cl"

// Returns the places in the picture, in [0, 1], of unit directions: see EnvironmentMapping (scene.h).
CASTOR_ONCE LANES(Points) LANES(environment_places)(const uint mapping, const LANES(Vectors) direction)
{
    const Real one = (Real)(1.0f), inverse_pi = (Real)(0.31830987f);
    LANES(Points) place;
    if (mapping == CASTOR_ENVIRONMENT_LATLONG) {
        place.x = 0.5f * fma(LANES(arc_tangent2)(direction.x, -direction.z), inverse_pi, one);
        place.y = LANES(arc_cosine)(clamp(direction.y, -one, one)) * inverse_pi;
        return place;
    }
    const Real squared = fma(direction.x, direction.x, direction.y * direction.y);
    const Mask is_on_axis = !(squared > 0.0f);  // in the middle of the picture or all around it
    const Real off_axis = LANES(square_root)(is_on_axis ? one : squared);
    const Real angle = LANES(arc_cosine)(clamp(-direction.z, -one, one)) * inverse_pi;
    const Real radius = is_on_axis ? (Real)(0.0f) : LANES(divide)(angle, off_axis);
    place.x = 0.5f * fma(radius, direction.x, one);
    place.y = 0.5f * fma(-radius, direction.y, one);
    return place;
}

typedef struct LANES(PictureTexels) {
    Whole x, y;
} LANES(PictureTexels);

// Returns the texels that unit directions lie in.
CASTOR_INLINE LANES(PictureTexels)
    LANES(texels_of_directions)(const uint mapping, const TextureImage image, const LANES(Vectors) direction)
{
    const LANES(Points) at = LANES(environment_places)(mapping, direction);
    LANES(PictureTexels) texel;
    // Limited as whole numbers: lanes whose answer is not used may have NaN here.
    texel.x = min(LANES(convert_uint)(at.x * (float)image.width), (Whole)(image.width - 1u));
    texel.y = min(LANES(convert_uint)(at.y * (float)image.height), (Whole)(image.height - 1u));
    return texel;
}

// Returns the radiance from unit directions.
CASTOR_ONCE LANES(Vectors) LANES(environment_light)(const Light light, const global TextureImage *restrict images,
                                                    const global uint *restrict texels, const LANES(Vectors) direction)
{
    const TextureImage image = images[light.first];
    const int is_latlong = light.mapping == CASTOR_ENVIRONMENT_LATLONG;
    const float width = (float)image.width, height = (float)image.height;
    const LANES(Points) at = LANES(environment_places)(light.mapping, direction);
    const Real zero = (Real)(0.0f), half_texel = (Real)(0.5f);
    const Real x = fma(at.x, (Real)(width), -half_texel), y = fma(at.y, (Real)(height), -half_texel);
    const Real before_first = is_latlong ? x + width : zero;
    const uint wrap = (is_latlong ? CASTOR_WRAP_REPEAT : CASTOR_WRAP_CLAMP) | (CASTOR_WRAP_CLAMP << CASTOR_WRAP_BITS);
    return LANES(bilinear_texels_anywhere)(texels + image.first_texel, image.format, image.width, image.height, wrap,
                                           x < 0.0f ? before_first : x, LANES(larger)(y, zero));
}

// Returns what rays that meet nothing see: the sum of all environments.
CASTOR_INLINE LANES(Vectors)
    LANES(light_of_environments)(const uint light_count, const global Light *restrict lights,
                                 const global TextureImage *restrict images, const global uint *restrict texels,
                                 const LANES(Vectors) direction)
{
    const Real zero = (Real)(0.0f);
    LANES(Vectors) sum = LANES(vectors)(zero, zero, zero);
    for (uint i = 0; i < light_count; ++i)
        if (lights[i].kind == CASTOR_LIGHT_ENVIRONMENT)
            sum = LANES(sum_of_vectors)(sum, LANES(environment_light)(lights[i], images, texels, direction));
    return sum;
}

#if CASTOR_TRACES_PATHS
// Returns the density with which sample_environment draws unit directions, by solid angle. `cos_angle`: of the
// direction with the normal; `is_joined`: as there.
CASTOR_ONCE Real LANES(density_of_environment)(const Light light, const global TextureImage *restrict images,
                                               const global uint *restrict environment_parts, const int is_joined,
                                               const LANES(Vectors) direction, const Real cos_angle)
{
    if (light.sampling == CASTOR_ENVIRONMENT_COSINE) return 0.31830987f * LANES(larger)(cos_angle, (Real)(0.0f));
    if (light.sampling == CASTOR_ENVIRONMENT_UNIFORM) return cos_angle > 0.0f ? (Real)(0.15915494f) : (Real)(0.0f);
    const TextureImage image = images[light.first];
    const LANES(PictureTexels) texel = LANES(texels_of_directions)(light.mapping, image, direction);
    return LANES(density_of_texels)(environment_table(environment_parts, light.count, is_joined), light.mapping, image,
                                    texel.x, texel.y, direction);
}
#endif

// Draws a direction as the picture's light is distributed.
CASTOR_ONCE LANES(LightSamples)
    LANES(sample_picture)(const Light light, const global TextureImage *restrict images,
                          const global uint *restrict texels, const global uint *restrict environment_parts,
                          const int is_joined, const LANES(Vectors) position, const LANES(Points) at)
{
    const TextureImage image = images[light.first];
    const LANES(PictureDirections) drawn =
        LANES(draw_directions)(environment_table(environment_parts, light.count, is_joined), light.mapping, image, at);
    const Mask is_drawn = drawn.density > 0.0f;
    const Real weight = LANES(divide)((Real)(1.0f), is_drawn ? drawn.density : (Real)(1.0f));
    const LANES(Vectors) there = LANES(environment_light)(light, images, texels, drawn.direction);
    LANES(LightSamples) sample;
    sample.wi = drawn.direction;
    sample.distance = (Real)(INFINITY);
    sample.point = position;
    sample.irradiance = LANES(scaled_vectors)(there, is_drawn ? weight : (Real)(0.0f));
#if CASTOR_TRACES_PATHS
    sample.density = drawn.density;
#endif
    return sample;
}

// Draws a direction, above surfaces unless it is drawn by the picture. `at`: of the unit square. `is_joined`: rays that
// surfaces scatter find the environment, too, and what both find is weighted.
CASTOR_INLINE LANES(LightSamples)
    LANES(sample_environment)(const Light light, const global TextureImage *restrict images,
                              const global uint *restrict texels, const global uint *restrict environment_parts,
                              const int is_joined, const LANES(Vectors) position, const LANES(Vectors) normal,
                              const LANES(Points) at)
{
    if (light.sampling == CASTOR_ENVIRONMENT_PICTURE)
        return LANES(sample_picture)(light, images, texels, environment_parts, is_joined, position, at);
    const int is_cosine = light.sampling == CASTOR_ENVIRONMENT_COSINE;
    const Real cos_angle = is_cosine ? LANES(square_root)(1.0f - at.x) : at.x;
    const Real sin_angle = LANES(square_root)(is_cosine ? at.x : fma(-at.x, at.x, (Real)(1.0f)));
    LANES(LightSamples) sample;
    sample.wi = LANES(directions_around)(normal, cos_angle, sin_angle, at.y);
    sample.distance = (Real)(INFINITY);
    sample.point = position;
    // The density: 1 / (2 pi), or cosine / pi
    const Real weight = is_cosine ? LANES(divide)((Real)(3.1415927f), cos_angle) : (Real)(6.2831855f);
    const LANES(Vectors) light_there = LANES(environment_light)(light, images, texels, sample.wi);
    sample.irradiance = LANES(scaled_vectors)(light_there, weight);
#if CASTOR_TRACES_PATHS
    sample.density = is_cosine ? 0.31830987f * cos_angle : (Real)(0.15915494f);
#endif
    return sample;
}
