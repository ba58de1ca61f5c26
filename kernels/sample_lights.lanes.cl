// CASTOR_LANES paths a work-item (see lanes.cl). Chooses one of the scene's lights for each path, and writes a ray to a
// random point of it and what arrives unless the ray is stopped, divided by the density of all that. Where there is
// nothing: a ray that hits nothing, and zero.
#include "castor/shared/wave_columns.h"
#include "device/bsdf.lanes.cl"
#include "device/environment.lanes.cl"
#include "device/lights.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"

// The far end counts: a light that lies on a surface is hidden. The millionth is for the rounding of t.
#define CASTOR_LIGHT_TMAX 1.000001f
// A light that rays meet does not hide its own points, which lie on it but for rounding.
#define CASTOR_LIGHT_TMAX_TO_SURFACE 0.9999f

// A sample of a light, and the end of the ray to it.
typedef struct LANES(LightRays) {
    LANES(LightSamples) sample;
    LANES(Vectors) direction;
    Real t_max;
} LANES(LightRays);

// Samples a light from points above surfaces.
CASTOR_INLINE LANES(LightRays)
    LANES(sample_any_light)(const Light light, const global Emitter *restrict emitters,
                            const global Instance *restrict instances,
                            const global TextureImage *restrict texture_images, const global uint *restrict texels,
                            const LANES(Vectors) origin, const LANES(Vectors) normal, const Real time,
                            const LANES(Points) at)
{
    LANES(LightRays) ray;
#if CASTOR_HAS_SAMPLED_LIGHTS
    if (light.kind >= CASTOR_LIGHT_AREA) {
#if CASTOR_HAS_ENVIRONMENT
        if (light.kind == CASTOR_LIGHT_ENVIRONMENT)
            ray.sample = LANES(sample_environment)(light, texture_images, texels, origin, normal, at);
        else
#endif
            ray.sample = LANES(sample_extended_light)(light, emitters, instances, origin, time, at);
    } else
#endif
        ray.sample = LANES(sample_light)(light, origin);
    const int is_far = light.kind == CASTOR_LIGHT_DIRECTIONAL || light.kind == CASTOR_LIGHT_ENVIRONMENT;
    const int is_surface = light.kind == CASTOR_LIGHT_MESH || light.kind == CASTOR_LIGHT_SPHERE;
    ray.direction = is_far ? ray.sample.wi : LANES(difference_of_vectors)(ray.sample.point, origin);
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
    return ray;
}

kernel CASTOR_IN_LANES void LANES(sample_lights)(
    const RenderParams params, const PathParams path, const global Material *restrict materials,
    const global Light *restrict lights, const global Emitter *restrict emitters,
    const global Instance *restrict instances, const global TextureImage *restrict texture_images,
    const global uint *restrict texels, CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(ray_time),
    CASTOR_READ(surface_position), CASTOR_READ(surface_normal), CASTOR_READ(surface_wo), CASTOR_READ(surface_material),
    CASTOR_READ(surface_diffuse), CASTOR_READ(surface_specular), CASTOR_READ(path_throughput),
    CASTOR_WRITE(shadow_origin_tmin), CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution),
    CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    LANES(PathRays) ray = LANES(dead_rays)();
    LANES(Vectors) contribution = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    LANES(Materials) material;
    if (LANES(mask_of)(is_met)) {
        material = LANES(load_materials)(materials, is_met ? material_number : (Whole)(0));
#if CASTOR_HAS_TEXTURES
        material = LANES(textured_materials)(material, 0u, surface_diffuse + place, surface_specular + place);
#endif
        const LANES(Bsdfs) bsdf = LANES(bsdfs)(params, path, material, LANES(load_vectors)(surface_normal + place),
                                               LANES(load_vectors)(surface_wo + place));
        const Mask is_matt = is_met & LANES(are_matt)(bsdf);
        if (LANES(mask_of)(is_matt)) {
            const Whole slot = LANES(slots)(params, path_slot, place, is_path);
            const LANES(Vectors) origin = LANES(points_on_rays)(LANES(load_vectors)(surface_position + place),
                                                                (Real)(params.shadow_epsilon), bsdf.normal);
            Whole number = (Whole)(0);
            if (params.light_count > 1) {
                const LANES(Points) choice = LANES(points_of_slots)(
                    params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_CHOICE));
                number =
                    min(LANES(convert_uint)(choice.y * (float)params.light_count), (Whole)(params.light_count - 1u));
            }
            const LANES(Points) at = LANES(points_of_slots)(
                params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_LIGHT_POINT));
            const Real time = CASTOR_HAS_MOTION ? LANES(load_real_column)(ray_time + place) : (Real)(0.0f);
            uint numbers[CASTOR_LANES];
            LANES(store_wholes)(number, numbers);
            LANES(LightRays)
            to_light = LANES(sample_any_light)(lights[numbers[lowest_bit(LANES(mask_of)(is_matt))]], emitters,
                                               instances, texture_images, texels, origin, bsdf.normal, time, at);
            Mask is_left = is_matt & (number != numbers[lowest_bit(LANES(mask_of)(is_matt))]);
            while (LANES(mask_of)(is_left)) {
                const uint next = numbers[lowest_bit(LANES(mask_of)(is_left))];
                const Mask is_next = number == next;
                to_light =
                    LANES(choose_light_rays)(is_next,
                                             LANES(sample_any_light)(lights[next], emitters, instances, texture_images,
                                                                     texels, origin, bsdf.normal, time, at),
                                             to_light);
                is_left &= !is_next;
            }
            // Rays meet the light, too: then both ways share what it gives.
            const Mask has_rival = to_light.sample.density > 0.0f;
            const Real own = LANES(divide)(to_light.sample.density, (Real)((float)params.light_count));
            Real weight = (Real)(1.0f);
            if ((path.flags & CASTOR_PATH_WEIGHS) && LANES(mask_of)(has_rival))
                weight = has_rival ? LANES(balance)(own, LANES(bsdf_densities)(bsdf, to_light.sample.wi)) : weight;
            const LANES(Vectors) arriving = LANES(product_of_vectors)(
                LANES(throughputs)(params, path_throughput, slot),
                LANES(scaled_vectors)(to_light.sample.irradiance, weight * (float)params.light_count));
            contribution = LANES(choose_vectors)(
                is_matt, LANES(product_of_vectors)(arriving, LANES(bsdf_values)(bsdf, to_light.sample.wi)),
                contribution);
            const Mask is_lit = (contribution.x != 0.0f) | (contribution.y != 0.0f) | (contribution.z != 0.0f);
            LANES(PathRays) shadow;
            shadow.origin = origin;
            shadow.t_min = (Real)(CASTOR_SMALLEST_T);
            shadow.direction = to_light.direction;
            shadow.t_max = to_light.t_max;
            ray = LANES(choose_rays)(is_lit, shadow, ray);
            ray_counts[get_global_id(0)] += popcount(LANES(mask_of)(is_lit));
        }
    }
    LANES(store_path_rays)(ray, shadow_origin_tmin + place, shadow_direction_tmax + place);
    LANES(store_vectors)(contribution, shadow_contribution + place);
}
