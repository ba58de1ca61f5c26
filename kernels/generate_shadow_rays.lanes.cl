// CASTOR_LANES paths a work-item (see lanes.cl), for one light. Writes the rays from the surfaces to the light, and
// what the light adds to the film unless these are stopped: as a term of the path where terms are kept, else as a
// contribution. Where it adds nothing: a ray that hits nothing, and zero.
#include "castor/shared/wave_columns.h"
#include "device/film.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/shading.lanes.cl"

// The far end counts: a light that lies on a surface is hidden. The millionth is for the rounding of t.
#define CASTOR_SHADOW_TMAX 1.000001f

kernel CASTOR_IN_LANES void LANES(generate_shadow_rays)(
    const RenderParams params, const uint light_index, const uint term, const global Light *restrict lights,
    const global Material *restrict materials, CASTOR_READ(path_slot), CASTOR_READ(surface_position),
    CASTOR_READ(surface_normal), CASTOR_READ(surface_wo), CASTOR_READ(surface_material), CASTOR_READ(path_throughput),
    CASTOR_WRITE(shadow_origin_tmin), CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution),
    CASTOR_WRITE(film_terms), CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    LANES(PathRays) ray = LANES(dead_rays)();
    LANES(Vectors) contribution = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    if (LANES(mask_of)(is_met)) {
        const Light light = lights[light_index];
        const LANES(Materials) material = LANES(load_materials)(materials, is_met ? material_number : (Whole)(0));
        const LANES(Vectors) position = LANES(load_vectors)(surface_position + place);
        const LANES(Vectors) normal = LANES(load_vectors)(surface_normal + place);
        const LANES(Vectors) wo = LANES(load_vectors)(surface_wo + place);
        const LANES(LightSamples) sample = LANES(sample_light)(light, position);
        const LANES(Vectors) throughput = LANES(throughputs)(params, path_throughput, slot);
        contribution = LANES(choose_vectors)(
            is_met,
            LANES(product_of_vectors)(throughput, LANES(blinn_phong)(material, params.flags, normal, wo, sample)),
            contribution);
        const Mask is_lit = (contribution.x != 0.0f) | (contribution.y != 0.0f) | (contribution.z != 0.0f);
        const LANES(Vectors) offset = params.flags & CASTOR_RULE_SHADOW_ORIGIN_ALONG_RAY ? sample.wi : normal;
        LANES(PathRays) to_light;
        to_light.origin = LANES(points_on_rays)(position, (Real)(params.shadow_epsilon), offset);
        to_light.t_min = (Real)(CASTOR_SMALLEST_T);
        if (light.kind == CASTOR_LIGHT_DIRECTIONAL) {
            to_light.direction = sample.wi;
            to_light.t_max = (Real)(INFINITY);
        } else {
            to_light.direction = LANES(difference_of_vectors)(LANES(same_vectors)(light.position), to_light.origin);
            to_light.t_max = (Real)(CASTOR_SHADOW_TMAX);
        }
        ray = LANES(choose_rays)(is_lit, to_light, ray);
        ray_counts[get_global_id(0)] += popcount(LANES(mask_of)(is_lit));
    }
    LANES(store_path_rays)(ray, shadow_origin_tmin + place, shadow_direction_tmax + place);
    if (params.sample_shift > 0)
        LANES(keep_terms)(params, place, slot, is_path, term, contribution, film_terms);
    else
        LANES(store_vectors)(contribution, shadow_contribution + place);
}
