// The lights of traced paths, for CASTOR_LANES lanes (see lanes.cl): which of them is sampled, how, and with what
// density a ray that meets one by chance would have been drawn to it.
#include "device/environment.lanes.cl"
#include "device/light_tree.lanes.cl"
#include "device/lights.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/principled_surface.lanes.cl"
#include "device/resampled_meshes.lanes.cl"

// The far end counts: a light that lies on a surface is hidden. The millionth is for the rounding of t.
#define CASTOR_LIGHT_TMAX 1.000001f
// A light that rays meet does not hide its own points, which lie on it but for rounding.
#define CASTOR_LIGHT_TMAX_TO_SURFACE 0.9999f

// The columns of lights.
typedef struct LightColumns {
    const global Light *lights;
    const global Emitter *emitters;
    const global Instance *instances;
    const global TextureImage *images;
    const global uint *texels;
    const global uint *environment_parts;
    const global PrincipledMaterial *principled_materials;
    const global Texture *textures;
    const global LightNode *nodes;  // of the tree by which lights are chosen
    uint light_count;
    int has_tree;        // else all lights are as probable; needs CASTOR_HAS_LIGHT_TREE
    float pixel_spread;  // see PathParams
    int is_joined;       // rays that surfaces scatter find lights, too, and what both ways find is weighted
} LightColumns;

// A sample of a light, and the end of the ray to it.
typedef struct LANES(LightRays) {
    LANES(LightSamples) sample;
    LANES(Vectors) direction;
    Real t_max;
    Mask is_far;  // the direction is that of all points
} LANES(LightRays);

// Where light is wanted, and how its samples are drawn.
typedef struct LANES(LightQueries) {
    LANES(Vectors) origin;  // above surfaces
    LANES(Vectors) normal;
    Mask has_both_sides;
    Real time;
    LANES(Points) at;     // of the light
    Real choice;          // between its points, in [0, 1)
    Real length;          // of the path so far
    LANES(Points) texel;  // which of those is taken that a filter would mix
} LANES(LightQueries);

#if CASTOR_HAS_ATTRIBUTES
// Returns what the texture of emission leaves of the light of samples of a mesh.
CASTOR_INLINE LANES(Vectors) LANES(emission_textures)(const LightColumns from, const Light light,
                                                      const LANES(LightSamples) sample, const LANES(LightQueries) query)
{
    const PrincipledTextures of_textures = {from.principled_materials, from.textures, from.images, from.texels};
    LANES(TexturePlaces) place;
    place.uvs.x = place.uvs.z = sample.u;
    place.uvs.y = place.uvs.w = sample.v;
    place.uvs_per_length = place.second_per_length = sample.uvs_per_length;
    place.width = (query.length + sample.distance) * from.pixel_spread;
    place.jitter = query.texel;
    const uint texture = from.principled_materials[light.principled].texture[CASTOR_SLOT_EMISSION];
    return LANES(linear_colours)(LANES(random_texels)(of_textures, texture, place));
}
#endif

#if CASTOR_HAS_LIGHT_SHAPES
CASTOR_INLINE LANES(MeshQueries) LANES(mesh_queries)(const LANES(LightQueries) query)
{
    LANES(MeshQueries) of_mesh;
    of_mesh.position = query.origin;
    of_mesh.normal = query.normal;
    of_mesh.has_both_sides = query.has_both_sides;
    of_mesh.time = query.time;
    of_mesh.at = query.at;
    of_mesh.choice = query.choice;
    return of_mesh;
}

// Samples a light that is a mesh.
CASTOR_INLINE LANES(LightSamples)
    LANES(light_of_mesh)(const LightColumns from, const Light light, const LANES(LightQueries) query)
{
    LANES(LightSamples)
    sample = LANES(resample_meshes)(LANES(same_mesh_lights)(light), from.emitters, LANES(mesh_queries)(query));
#if CASTOR_HAS_ATTRIBUTES
    if (light.principled != CASTOR_INVALID_INDEX)
        sample.irradiance =
            LANES(product_of_vectors)(sample.irradiance, LANES(emission_textures)(from, light, sample, query));
#endif
    return sample;
}
#endif

// Samples a light.
CASTOR_INLINE LANES(LightRays)
    LANES(sample_one_light)(const LightColumns from, const uint number, const LANES(LightQueries) query)
{
    const Light light = from.lights[number];
    LANES(LightRays) ray;
#if CASTOR_HAS_ENVIRONMENT
    if (light.kind == CASTOR_LIGHT_ENVIRONMENT)
        ray.sample = LANES(sample_environment)(light, from.images, from.texels, from.environment_parts, from.is_joined,
                                               query.origin, query.normal, query.at);
    else
#endif
#if CASTOR_HAS_LIGHT_SHAPES
        if (light.kind == CASTOR_LIGHT_MESH)
        ray.sample = LANES(light_of_mesh)(from, light, query);
    else if (CASTOR_IS_SAMPLED_LIGHT(light))
        ray.sample =
            LANES(sample_extended_light)(light, from.emitters, from.instances, query.origin, query.time, query.at);
    else
#endif
        ray.sample = LANES(sample_light)(light, query.origin);
    const int is_far = light.kind == CASTOR_LIGHT_DIRECTIONAL || light.kind == CASTOR_LIGHT_ENVIRONMENT;
    const int is_surface = light.kind == CASTOR_LIGHT_MESH || light.kind == CASTOR_LIGHT_SPHERE;
    const Whole one = (Whole)(1);
    ray.is_far = is_far ? one == 1u : one == 0u;
    ray.direction = is_far ? ray.sample.wi : LANES(difference_of_vectors)(ray.sample.point, query.origin);
    ray.t_max = (Real)(is_far ? INFINITY : is_surface ? CASTOR_LIGHT_TMAX_TO_SURFACE : CASTOR_LIGHT_TMAX);
    return ray;
}

CASTOR_INLINE LANES(LightRays)
    LANES(choose_light_rays)(const Mask is_a, const LANES(LightRays) a, const LANES(LightRays) b)
{
    LANES(LightRays) ray;
    ray.sample.wi = LANES(choose_vectors)(is_a, a.sample.wi, b.sample.wi);
    ray.sample.distance = is_a ? a.sample.distance : b.sample.distance;
    ray.sample.irradiance = LANES(choose_vectors)(is_a, a.sample.irradiance, b.sample.irradiance);
    ray.sample.point = LANES(choose_vectors)(is_a, a.sample.point, b.sample.point);
    ray.sample.density = is_a ? a.sample.density : b.sample.density;
    ray.direction = LANES(choose_vectors)(is_a, a.direction, b.direction);
    ray.t_max = is_a ? a.t_max : b.t_max;
    ray.is_far = is_a ? a.is_far : b.is_far;
    return ray;
}

#if CASTOR_HAS_LIGHT_SHAPES
// Tells whether lights with these numbers are all meshes without textures of emission.
CASTOR_INLINE int LANES(are_plain_meshes)(const global Light *lights, const Whole number)
{
    Mask is_other = LANES(gather_wholes)(&lights[0].kind, number, CASTOR_LIGHT_WORDS) != CASTOR_LIGHT_MESH;
#if CASTOR_HAS_ATTRIBUTES
    is_other |= LANES(gather_wholes)(&lights[0].principled, number, CASTOR_LIGHT_WORDS) != CASTOR_INVALID_INDEX;
#endif
    return !LANES(mask_of)(is_other);
}
#endif

// Samples the lights with these numbers, where `counts`, which is so somewhere: meshes side by side, and what else
// there is one light after another.
CASTOR_ONCE LANES(LightRays) LANES(sample_lights)(const LightColumns from, const Whole number, const Mask counts,
                                                  const LANES(LightQueries) query)
{
    const Whole known_number = counts ? number : (Whole)(LANES(largest_of_lanes)(counts ? number : (Whole)(0)));
#if CASTOR_HAS_LIGHT_SHAPES && CASTOR_LANES > 1
    if (!LANES(are_same)(known_number) && LANES(are_plain_meshes)(from.lights, known_number)) {
        LANES(LightRays) ray;
        ray.sample = LANES(resample_meshes)(LANES(gather_mesh_lights)(from.lights, known_number), from.emitters,
                                            LANES(mesh_queries)(query));
        ray.is_far = (Whole)(0) != 0u;
        ray.direction = LANES(difference_of_vectors)(ray.sample.point, query.origin);
        ray.t_max = (Real)(CASTOR_LIGHT_TMAX_TO_SURFACE);
        return ray;
    }
#endif
    uint numbers[CASTOR_LANES];
    LANES(store_wholes)(known_number, numbers);
    const uint first = numbers[0];
    LANES(LightRays) ray = LANES(sample_one_light)(from, first, query);
    Mask is_left = known_number != first;
    while (LANES(mask_of)(is_left)) {
        const uint next = numbers[lowest_bit(LANES(mask_of)(is_left))];
        const Mask is_next = known_number == next;
        ray = LANES(choose_light_rays)(is_next, LANES(sample_one_light)(from, next, query), ray);
        is_left &= !is_next;
    }
    return ray;
}

// Returns the probabilities with which lights with these numbers, where `counts`, are chosen at these points.
CASTOR_INLINE Real LANES(probabilities_of_lights)(const LightColumns from, const Whole number, const Mask counts,
                                                  const LANES(Receivers) receiver)
{
    LANES(Points) unused;
    unused.x = unused.y = (Real)(0.0f);
    const Whole trail = LANES(gather_wholes)(&from.lights[0].trail, counts ? number : (Whole)(0), CASTOR_LIGHT_WORDS);
    return LANES(walk_light_tree)(from.nodes, receiver, counts, 0, trail, unused).probability;
}

// Returns how much the light counts that rays met by chance, where samples of it have the density `of_light`.
CASTOR_INLINE Real LANES(weights_of_chance)(const uint flags, const Real density, const Real of_light)
{
    const Real one = (Real)(1.0f);
    if (!(flags & CASTOR_PATH_LIGHTS)) return one;
    const Mask is_sampled = (density > 0.0f) & (of_light > 0.0f);
    const Real weight = flags & CASTOR_PATH_WEIGHS ? LANES(balance)(density, of_light) : (Real)(0.0f);
    return is_sampled ? weight : one;
}

#if CASTOR_HAS_EMISSION
// Returns the densities with which these lights are sampled at the points that rays from `receiver` met; 0 where
// `number` names none.
CASTOR_INLINE Real LANES(densities_of_lights)(const LightColumns from, const Whole number,
                                              const LANES(Receivers) receiver, const Real time,
                                              const LANES(Vectors) point, const LANES(Vectors) normal)
{
    Real density = (Real)(0.0f);
    uint numbers[CASTOR_LANES];
    LANES(store_wholes)(number, numbers);
    for (uint left = LANES(mask_of)(number != CASTOR_INVALID_INDEX); left;) {
        const uint light = numbers[lowest_bit(left)];
        const Mask is_light = number == light;
        const Real of_light =
            LANES(densities_of_light)(from.lights[light], from.instances, receiver.origin, time, point, normal);
        const float weight = from.lights[light].kind == CASTOR_LIGHT_MESH ? CASTOR_CANDIDATES_WEIGHT : 1.0f;
        density = is_light ? weight * of_light : density;
        left &= ~LANES(mask_of)(is_light);
    }
    const Mask is_named = number != CASTOR_INVALID_INDEX;
    if (CASTOR_HAS_LIGHT_TREE && from.has_tree && LANES(mask_of)(is_named))
        return density * LANES(probabilities_of_lights)(from, number, is_named, receiver);
    return LANES(divide)(density, (Real)(from.light_count ? (float)from.light_count : 1.0f));
}
#endif

#if CASTOR_HAS_ENVIRONMENT || CASTOR_HAS_SUNS
// Returns how much the light from far away counts that rays met by chance, where its directions are drawn with
// `density` once it is chosen. `receiver`: where rays begin whose directions have a density.
CASTOR_INLINE Real LANES(weights_of_far_light)(const LightColumns from, const uint number, const PathParams path,
                                               const Real density_of_ray, const LANES(Receivers) receiver,
                                               const Real density)
{
    Real of_light = density;
    const Mask has_rival = density_of_ray > 0.0f;
    if (!CASTOR_HAS_LIGHT_TREE || !from.has_tree)
        of_light = LANES(divide)(of_light, (Real)((float)from.light_count));
    else if (LANES(mask_of)(has_rival))
        of_light *= LANES(probabilities_of_lights)(from, (Whole)(number), has_rival, receiver);
    return LANES(weights_of_chance)(path.flags, density_of_ray, of_light);
}
#endif

#if CASTOR_HAS_SUNS
// Returns the light of the disk of a sun in the directions of rays that met nothing, by its weight. `receiver`: as of
// weights_of_far_light.
CASTOR_INLINE LANES(Vectors)
    LANES(weighed_sun)(const LightColumns from, const uint number, const PathParams path,
                       const LANES(PathRecords) record, const LANES(Receivers) receiver, const LANES(Vectors) direction)
{
    const Light light = from.lights[number];
    const Real zero = (Real)(0.0f), density = (Real)(density_of_sun(light));
    const Mask is_seen = LANES(lead_to_sun)(light, direction);
    const LANES(Vectors) black = LANES(vectors)(zero, zero, zero);
    if (!LANES(mask_of)(is_seen)) return black;
    const Real weight = LANES(weights_of_far_light)(from, number, path, record.density, receiver, density);
    const LANES(Vectors) radiance = LANES(limited_light)(LANES(same_vectors)(light.intensity), density);
    return LANES(choose_vectors)(is_seen, LANES(scaled_vectors)(radiance, weight), black);
}
#endif

#if CASTOR_HAS_ENVIRONMENT
// Returns the light of an environment in the directions of rays that met nothing, by its weight. `receiver`: as of
// weights_of_far_light.
CASTOR_INLINE LANES(Vectors) LANES(weighed_environment)(const LightColumns from, const uint number,
                                                        const PathParams path, const LANES(PathRecords) record,
                                                        const LANES(Receivers) receiver, const LANES(Vectors) direction)
{
    const Real cosine = from.has_tree ? LANES(dot_products)(receiver.normal, direction) : record.cosine;
    const Light light = from.lights[number];
    const Real density =
        LANES(density_of_environment)(light, from.images, from.environment_parts, from.is_joined, direction, cosine);
    const Real weight = LANES(weights_of_far_light)(from, number, path, record.density, receiver, density);
    return LANES(scaled_vectors)(LANES(environment_light)(light, from.images, from.texels, direction), weight);
}
#endif
