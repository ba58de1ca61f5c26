// CASTOR_LANES paths a work-item (see lanes.cl). Adds to the film what the surfaces that their rays met (material
// CASTOR_INVALID_INDEX: none) send without a light ray: the ambient term and what they emit, or at `depth` 0 the
// background. Where the scene has environments, rays that meet nothing see these at any depth. `terms_of_bounce`: of
// this kernel one, and one of each light that is added. CASTOR_RENDER_LIGHTS_ALONE: adds nothing.
#include "castor/shared/wave_columns.h"
#include "device/environment.lanes.cl"
#include "device/film.lanes.cl"
#include "device/hits.lanes.cl"
#include "device/path_states.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/shading.lanes.cl"

#if CASTOR_HAS_DIELECTRICS
// Takes from paths what the dielectrics in which their rays were have absorbed.
CASTOR_INLINE void LANES(absorb)(const RenderParams params, const global Material *restrict materials,
                                 const global Hit *restrict hit, const global float4 *restrict ray_direction,
                                 const Whole slot, const Mask is_path, const global uint4 *restrict path_state,
                                 global float4 *restrict path_throughput)
{
    const Whole medium = LANES(path_states)(params, path_state, slot, is_path).media.medium;
    const Real t = LANES(load_hits)(hit).t;
    const Mask is_inside = is_path & (medium != CASTOR_INVALID_INDEX) & (t <= FLT_MAX);
    if (!LANES(mask_of)(is_inside)) return;
    const LANES(Materials) material = LANES(load_materials)(materials, is_inside ? medium : (Whole)(0));
    const LANES(Vectors) direction = LANES(load_vectors)(ray_direction);
    const Real length = (is_inside ? t : (Real)(0.0f)) * LANES(square_root)(LANES(dot_products)(direction, direction));
    const LANES(Vectors) left = LANES(product_of_vectors)(LANES(throughputs)(params, path_throughput, slot),
                                                          LANES(transmittance)(material.absorption, length));
    LANES(scatter_vectors)(left, slot, is_inside, path_throughput);
}
#endif

#define CASTOR_SHADE_PARAMETERS                                                                              \
    const RenderParams params, const uint depth, const uint terms_of_bounce,                                 \
        const global Material *restrict materials, const global Light *restrict lights,                      \
        const global TextureImage *restrict texture_images, const global uint *restrict texels,              \
        CASTOR_READ(path_slot), CASTOR_READ(path_state), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), \
        CASTOR_READ(surface_normal), CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse),            \
        CASTOR_WRITE(path_throughput), CASTOR_WRITE(path_terms), CASTOR_WRITE(film_sum), CASTOR_WRITE(film_terms)
#define CASTOR_SHADE_ARGUMENTS                                                                                    \
    params, depth, terms_of_bounce, materials, lights, texture_images, texels, path_slot, path_state,             \
        ray_direction_tmax, hits, surface_normal, surface_material, surface_diffuse, path_throughput, path_terms, \
        film_sum, film_terms

CASTOR_ONCE void LANES(shade_slots_of_item)(const uint item, CASTOR_SHADE_PARAMETERS)
{
    const uint place = item * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
#if CASTOR_HAS_DIELECTRICS
    LANES(absorb)
    (params, materials, hits + place, ray_direction_tmax + place, slot, is_path, path_state, path_throughput);
#endif
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Mask counts = CASTOR_HAS_ENVIRONMENT || depth == 0 ? is_path : is_met;
    LANES(Vectors) sent = LANES(same_vectors)(params.background);
#if CASTOR_HAS_TEXTURES && CASTOR_HAS_OTHER_TEXTURES
    if (params.flags & CASTOR_RENDER_BACKGROUND_TEXTURE) sent = LANES(load_vectors)(surface_diffuse + place);
#endif
    if (LANES(mask_of)(is_met)) {
        const LANES(Materials) material = LANES(load_materials)(materials, is_met ? material_number : (Whole)(0));
        LANES(Vectors) own = LANES(product_of_vectors)(material.ambient, LANES(same_vectors)(params.ambient));
#if CASTOR_HAS_DIELECTRICS
        const Real zero = (Real)(0.0f);
        const Mask is_shaded = LANES(is_on_shaded_side)(material, LANES(load_vectors)(surface_normal + place),
                                                        LANES(directions_back)(ray_direction_tmax + place));
        own = LANES(choose_vectors)(is_shaded, own, LANES(vectors)(zero, zero, zero));
#endif
#if CASTOR_HAS_TEXTURES && CASTOR_HAS_OTHER_TEXTURES
        const LANES(Vectors) texel = LANES(load_vectors)(surface_diffuse + place);
        const LANES(Vectors) with_texel =
            params.flags & CASTOR_RULE_TEXEL_IS_DIFFUSE_TERM ? LANES(sum_of_vectors)(own, texel) : texel;
        own = LANES(choose_vectors)(LANES(sends_texel)(surface_diffuse + place), with_texel, own);
#endif
#if CASTOR_HAS_EMISSION
        own = LANES(sum_of_vectors)(own, LANES(load_emissions)(materials, is_met ? material_number : (Whole)(0)));
#endif
        sent = LANES(choose_vectors)(
            is_met, LANES(product_of_vectors)(LANES(throughputs)(params, path_throughput, slot), own), sent);
    }
#if CASTOR_HAS_ENVIRONMENT
    const Mask is_missed = is_path & !is_met;
    if (LANES(mask_of)(is_missed)) {
        const LANES(Vectors) direction = LANES(normalized_vectors)(LANES(load_vectors)(ray_direction_tmax + place));
        const LANES(Vectors) seen =
            LANES(light_of_environments)(params.light_count, lights, texture_images, texels, direction);
        sent = LANES(choose_vectors)(
            is_missed, LANES(product_of_vectors)(LANES(throughputs)(params, path_throughput, slot), seen), sent);
    }
#endif
    if (params.flags & CASTOR_RENDER_LIGHTS_ALONE) sent = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    if (LANES(keeps_terms)(params)) {
        const Whole terms = (Whole)(depth * terms_of_bounce) + (is_met ? (Whole)(terms_of_bounce) : (Whole)(1));
        if (params.flags & CASTOR_RENDER_FIRST_BOUNCE)
            LANES(store_whole_column)(terms, path_terms + place);
        else
            LANES(scatter_wholes)(terms, slot, counts, path_terms);
    }
    LANES(add_terms)(params, place, slot, counts, depth * terms_of_bounce, sent, film_sum, film_terms);
}

kernel CASTOR_IN_LANES void LANES(shade)(CASTOR_SHADE_PARAMETERS)
{
    LANES(shade_slots_of_item)(get_global_id(0), CASTOR_SHADE_ARGUMENTS);
}
