// CASTOR_LANES paths and one light a work-item (see lanes.cl), for light_count lights from first_light on. Writes the
// rays from the surfaces to the lights, a row of row_length places for each light, and what the lights add to the film
// unless these are stopped: as a term of the path where terms are kept, first_term for the first light, else as a
// contribution. Where a light adds nothing: a ray that hits nothing, and zero.
#include "castor/shared/wave_columns.h"
#include "device/environment.lanes.cl"
#include "device/film.lanes.cl"
#include "device/lights.lanes.cl"
#include "device/path_states.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/shading.lanes.cl"

// The far end counts: a light that lies on a surface is hidden. The millionth is for the rounding of t.
#define CASTOR_SHADOW_TMAX 1.000001f
// A light that rays meet does not hide its own points, which lie on it but for rounding.
#define CASTOR_SHADOW_TMAX_TO_SURFACE 0.9999f

#define CASTOR_GENERATE_SHADOW_RAYS_PARAMETERS                                                                         \
    const RenderParams params, const uint node, const uint first_light, const uint light_count, const uint row_length, \
        const uint first_term, const global Light *restrict lights, const global Emitter *restrict emitters,           \
        const global Instance *restrict instances, const global TextureImage *restrict texture_images,                 \
        const global uint *restrict texels, const global uint *restrict environment_parts, CASTOR_READ(pixel_blocks),  \
        const global Material *restrict materials, CASTOR_READ(path_slot), CASTOR_READ(path_state),                    \
        CASTOR_READ(ray_time), CASTOR_READ(surface_position), CASTOR_READ(surface_normal),                             \
        CASTOR_READ(ray_direction_tmax), CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse),                  \
        CASTOR_READ(surface_specular), CASTOR_READ(path_throughput), CASTOR_WRITE(shadow_origin_tmin),                 \
        CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution), CASTOR_WRITE(film_terms),              \
        CASTOR_WRITE(ray_counts)
#define CASTOR_GENERATE_SHADOW_RAYS_ARGUMENTS                                                                     \
    params, node, first_light, light_count, row_length, first_term, lights, emitters, instances, texture_images,  \
        texels, environment_parts, pixel_blocks, materials, path_slot, path_state, ray_time, surface_position,    \
        surface_normal, ray_direction_tmax, surface_material, surface_diffuse, surface_specular, path_throughput, \
        shadow_origin_tmin, shadow_direction_tmax, shadow_contribution, film_terms, ray_counts

CASTOR_ONCE void LANES(generate_shadow_rays_of_item)(const uint item, CASTOR_GENERATE_SHADOW_RAYS_PARAMETERS)
{
    const uint at_place = item * CASTOR_LANES;
    const uint row = at_place / row_length, place = at_place % row_length;
    if (row >= light_count) return;
    const uint light_index = first_light + row;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    LANES(PathRays) ray = LANES(dead_rays)();
    LANES(Vectors) contribution = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    if (LANES(mask_of)(is_met)) {
        const Light light = lights[light_index];
        LANES(Materials) material = LANES(load_materials)(materials, is_met ? material_number : (Whole)(0));
#if CASTOR_HAS_TEXTURES
        material = LANES(textured_materials)(material, params.flags, surface_diffuse + place, surface_specular + place);
#endif
        const LANES(Vectors) position = LANES(load_vectors)(surface_position + place);
        LANES(Vectors) normal = LANES(load_vectors)(surface_normal + place);
        const LANES(Vectors) wo = LANES(directions_back)(ray_direction_tmax + place);
        if (params.flags & CASTOR_RENDER_BOTH_SIDES)
            normal =
                LANES(scaled_vectors)(normal, LANES(dot_products)(normal, wo) < 0.0f ? (Real)(-1.0f) : (Real)(1.0f));
        LANES(LightSamples) sample;
#if CASTOR_HAS_SAMPLED_LIGHTS
        if (CASTOR_IS_SAMPLED_LIGHT(light)) {
            const Whole hit = LANES(nodes_of_paths)(params, node, path_state, slot, is_path);
            Whole dimension = LANES(dimension_of_node)(hit, CASTOR_DIMENSION_FIRST_LIGHT + light_index);
            if ((params.flags & CASTOR_RULE_LAMP_AT_PIXEL_POINT) && light.kind == CASTOR_LIGHT_AREA)
                dimension = hit == CASTOR_NODE_EYE ? (Whole)(CASTOR_DIMENSION_PIXEL) : dimension;
            const LANES(Points) at = LANES(points_of_slots)(
                params, pixel_blocks, LANES(slots_of_samples)(params, path_state, slot, is_path), dimension);
            const Real time = CASTOR_HAS_MOTION ? LANES(load_real_column)(ray_time + place) : (Real)(0.0f);
#if CASTOR_HAS_ENVIRONMENT
            if (light.kind == CASTOR_LIGHT_ENVIRONMENT)
                sample = LANES(sample_environment)(light, texture_images, texels, environment_parts, 0, position,
                                                   normal, at);
            else
#endif
                sample = LANES(sample_extended_light)(light, emitters, instances, position, time, at);
        } else
#endif
            sample = LANES(sample_light)(light, position);
        const LANES(Vectors) throughput = LANES(throughputs)(params, path_throughput, slot);
        Mask is_shaded = is_met;
#if CASTOR_HAS_DIELECTRICS
        is_shaded &= LANES(is_on_shaded_side)(material, normal, wo);
#endif
        contribution = LANES(choose_vectors)(
            is_shaded,
            LANES(product_of_vectors)(throughput, LANES(reflected_light)(material, params.flags, normal, wo, sample)),
            contribution);
        const Mask is_lit = (contribution.x != 0.0f) | (contribution.y != 0.0f) | (contribution.z != 0.0f);
        const LANES(Vectors) offset = params.flags & CASTOR_RULE_SHADOW_ORIGIN_ALONG_RAY ? sample.wi : normal;
        LANES(PathRays) to_light;
        to_light.origin = LANES(points_on_rays)(position, (Real)(params.shadow_epsilon), offset);
        to_light.t_min = (Real)(CASTOR_SMALLEST_T);
        if (light.kind == CASTOR_LIGHT_DIRECTIONAL || light.kind == CASTOR_LIGHT_ENVIRONMENT) {
            to_light.direction = sample.wi;
            to_light.t_max = (Real)(INFINITY);
        } else {
            to_light.direction = LANES(difference_of_vectors)(sample.point, to_light.origin);
            const int is_surface = light.kind == CASTOR_LIGHT_MESH || light.kind == CASTOR_LIGHT_SPHERE;
            to_light.t_max = (Real)(is_surface ? CASTOR_SHADOW_TMAX_TO_SURFACE : CASTOR_SHADOW_TMAX);
        }
        ray = LANES(choose_rays)(is_lit, to_light, ray);
        ray_counts[item] += popcount(LANES(mask_of)(is_lit));
    }
    LANES(store_path_rays)(ray, shadow_origin_tmin + at_place, shadow_direction_tmax + at_place);
    if (LANES(keeps_terms)(params))
        LANES(keep_terms)(params, place, slot, is_path, first_term + row, contribution, film_terms);
    else
        LANES(store_vectors)(contribution, shadow_contribution + at_place);
}

kernel CASTOR_IN_LANES void LANES(generate_shadow_rays)(CASTOR_GENERATE_SHADOW_RAYS_PARAMETERS)
{
    LANES(generate_shadow_rays_of_item)(get_global_id(0), CASTOR_GENERATE_SHADOW_RAYS_ARGUMENTS);
}
