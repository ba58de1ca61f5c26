// CASTOR_LANES paths a work-item (see lanes.cl). Adds to the sums of their slots the light that their rays met: what
// surfaces emit, environments, and for eye rays the background. Where lights are sampled too, such light counts by its
// weight. Takes from paths what the dielectrics in which their rays were have absorbed.
#include "castor/shared/wave_columns.h"
#include "device/environment.lanes.cl"
#include "device/film.lanes.cl"
#include "device/hits.lanes.cl"
#include "device/lights.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/shading.lanes.cl"

// Words of a Material (types.h asserts its size), and the one that is `light`.
#define CASTOR_MATERIAL_WORDS (4u * CASTOR_MATERIAL_ROWS)
#define CASTOR_WORD_OF_LIGHT 26u

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
// Returns the densities with which these lights are sampled at the points that rays met; 0 where `number` names none.
CASTOR_INLINE Real LANES(densities_of_lights)(const RenderParams params, const global Light *restrict lights,
                                              const global Instance *restrict instances, const Whole number,
                                              const LANES(Vectors) origin, const Real time, const LANES(Vectors) point,
                                              const LANES(Vectors) normal)
{
    Real density = (Real)(0.0f);
    uint numbers[CASTOR_LANES];
    LANES(store_wholes)(number, numbers);
    for (uint left = LANES(mask_of)(number != CASTOR_INVALID_INDEX); left;) {
        const uint light = numbers[lowest_bit(left)];
        const Mask is_light = number == light;
        const Real of_light = LANES(densities_of_light)(lights[light], instances, origin, time, point, normal);
        density = is_light ? of_light : density;
        left &= ~LANES(mask_of)(is_light);
    }
    return LANES(divide)(density, (Real)(params.light_count ? (float)params.light_count : 1.0f));
}
#endif

kernel CASTOR_IN_LANES void LANES(add_emission)(
    const RenderParams params, const PathParams path, const global Material *restrict materials,
    const global Light *restrict lights, const global Instance *restrict instances,
    const global TextureImage *restrict texture_images, const global uint *restrict texels, CASTOR_READ(path_slot),
    CASTOR_READ(path_state), CASTOR_READ(ray_time), CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax),
    CASTOR_READ(hits), CASTOR_READ(surface_position), CASTOR_READ(surface_normal), CASTOR_READ(surface_material),
    CASTOR_READ(surface_diffuse), CASTOR_WRITE(path_throughput), CASTOR_WRITE(film_terms), CASTOR_WRITE(surface_wo))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    const Real zero = (Real)(0.0f);
    const LANES(PathRecords) record = LANES(path_records)(params, path_state, slot);
    LANES(Vectors) throughput = LANES(throughputs)(params, path_throughput, slot);
    const LANES(Vectors) along = LANES(load_vectors)(ray_direction_tmax + place);
    const LANES(Vectors) direction = LANES(normalized_vectors)(along);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Whole known_number = is_met ? material_number : (Whole)(0);
#if CASTOR_HAS_DIELECTRICS
    const Mask is_inside = is_met & (record.medium != CASTOR_INVALID_INDEX);
    if (LANES(mask_of)(is_inside)) {
        const Real t = LANES(load_hits)(hits + place).t;
        const LANES(Materials) medium = LANES(load_materials)(materials, is_inside ? record.medium : (Whole)(0));
        const Real length = (is_inside ? t : zero) * LANES(square_root)(LANES(dot_products)(along, along));
        throughput = LANES(choose_vectors)(
            is_inside, LANES(product_of_vectors)(throughput, LANES(transmittance)(medium.absorption, length)),
            throughput);
        LANES(scatter_vectors)(throughput, slot, is_inside, path_throughput);
    }
#endif
    LANES(Vectors) sent = LANES(vectors)(zero, zero, zero);
    if (path.depth == 0) {
        sent = LANES(same_vectors)(params.background);
#if CASTOR_HAS_TEXTURES && CASTOR_HAS_OTHER_TEXTURES
        if (params.flags & CASTOR_RENDER_BACKGROUND_TEXTURE) sent = LANES(load_vectors)(surface_diffuse + place);
#endif
        sent = LANES(choose_vectors)(is_met, LANES(vectors)(zero, zero, zero), sent);
    }
    if (LANES(mask_of)(is_met)) {
        LANES(store_vectors)(LANES(scaled_vectors)(direction, (Real)(-1.0f)), surface_wo + place);
#if CASTOR_HAS_TEXTURES && CASTOR_HAS_OTHER_TEXTURES
        sent = LANES(choose_vectors)(is_met & LANES(sends_texel)(surface_diffuse + place),
                                     LANES(load_vectors)(surface_diffuse + place), sent);
#endif
#if CASTOR_HAS_EMISSION
        const LANES(Vectors) emission = LANES(load_emissions)(materials, known_number);
        const Mask shines = is_met & ((emission.x != 0.0f) | (emission.y != 0.0f) | (emission.z != 0.0f));
        if (LANES(mask_of)(shines)) {
            const Mask has_rival = shines & (record.density > 0.0f);
            Real of_light = zero;
            if (LANES(mask_of)(has_rival)) {
                const Whole light = LANES(gather_wholes)((const global uint *)materials + CASTOR_WORD_OF_LIGHT,
                                                         known_number, CASTOR_MATERIAL_WORDS);
                of_light = LANES(densities_of_lights)(
                    params, lights, instances, has_rival ? light : (Whole)(CASTOR_INVALID_INDEX),
                    LANES(load_vectors)(ray_origin_tmin + place),
                    CASTOR_HAS_MOTION ? LANES(load_real_column)(ray_time + place) : zero,
                    LANES(load_vectors)(surface_position + place), LANES(load_vectors)(surface_normal + place));
            }
            const Real weight = LANES(weights_of_chance)(path.flags, record.density, of_light);
            sent = LANES(choose_vectors)(shines, LANES(scaled_vectors)(emission, weight), sent);
        }
#endif
    }
#if CASTOR_HAS_ENVIRONMENT
    const Mask is_missed = is_path & !is_met;
    if (LANES(mask_of)(is_missed)) {
        LANES(Vectors) seen = LANES(vectors)(zero, zero, zero);
        for (uint i = 0; i < params.light_count; ++i) {
            if (lights[i].kind != CASTOR_LIGHT_ENVIRONMENT) continue;
            const Real of_light = LANES(divide)(LANES(density_of_environment)(lights[i], record.cosine),
                                                (Real)((float)params.light_count));
            const Real weight = LANES(weights_of_chance)(path.flags, record.density, of_light);
            seen = LANES(sum_of_vectors)(
                seen,
                LANES(scaled_vectors)(LANES(environment_light)(lights[i], texture_images, texels, direction), weight));
        }
        sent = LANES(choose_vectors)(is_missed, seen, sent);
    }
#endif
    LANES(add_to_slots)(params, place, slot, is_path, LANES(product_of_vectors)(throughput, sent), film_terms);
}
