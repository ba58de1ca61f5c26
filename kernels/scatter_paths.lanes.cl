// CASTOR_LANES paths a work-item (see lanes.cl). Draws the directions in which paths go on from their surfaces, and
// which of them go on; writes their rays, and next_rank 0, or CASTOR_PATH_ENDED where there is none.
#include "castor/shared/wave_columns.h"
#include "device/bsdf.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"

// No path is sure to go on where roulette is played, so that each has an end.
#define CASTOR_LARGEST_SURVIVAL 0.95f

kernel CASTOR_IN_LANES void LANES(scatter_paths)(
    const RenderParams params, const PathParams path, const global Material *restrict materials,
    CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(surface_position), CASTOR_READ(surface_normal),
    CASTOR_READ(surface_wo), CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse), CASTOR_READ(surface_specular),
    CASTOR_WRITE(path_throughput), CASTOR_WRITE(path_state), CASTOR_WRITE(next_slot), CASTOR_WRITE(next_origin_tmin),
    CASTOR_WRITE(next_direction_tmax), CASTOR_WRITE(next_rank), CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    Mask goes_on = is_met;
    if (LANES(mask_of)(is_met)) {
        const Whole slot = LANES(slots)(params, path_slot, place, is_path);
        const Whole known_number = is_met ? material_number : (Whole)(0);
        LANES(Materials) material = LANES(load_materials)(materials, known_number);
#if CASTOR_HAS_TEXTURES
        material = LANES(textured_materials)(material, 0u, surface_diffuse + place, surface_specular + place);
#endif
        const LANES(Bsdfs) bsdf = LANES(bsdfs)(params, path, material, LANES(load_vectors)(surface_normal + place),
                                               LANES(load_vectors)(surface_wo + place));
        const LANES(Points) choice = LANES(points_of_slots)(
            params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_CHOICE));
        const LANES(Points) at = LANES(points_of_slots)(
            params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_DIRECTION));
        const LANES(BsdfSamples) next = LANES(sample_bsdf)(bsdf, choice.x, at);
        LANES(Vectors)
        throughput = LANES(product_of_vectors)(LANES(throughputs)(params, path_throughput, slot), next.weight);
        const Real largest = LANES(largest_of)(throughput);
        goes_on &= (largest > 0.0f) & (largest <= FLT_MAX);
        // Light that rays meet after the last bounce counts only where no sample of the light has counted.
        const uint sampling = path.flags & (CASTOR_PATH_LAST | CASTOR_PATH_LIGHTS | CASTOR_PATH_WEIGHS);
        if (sampling == (CASTOR_PATH_LAST | CASTOR_PATH_LIGHTS)) goes_on &= next.density == 0.0f;
        if (path.flags & CASTOR_PATH_ROULETTE) {
            const LANES(Points) end = LANES(points_of_slots)(
                params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_END));
            const Real survival = LANES(smaller)(goes_on ? largest : (Real)(1.0f), (Real)(CASTOR_LARGEST_SURVIVAL));
            goes_on &= end.x < survival;
            throughput = LANES(scaled_vectors)(throughput, LANES(divide)((Real)(1.0f), survival));
        }
        if (LANES(mask_of)(goes_on)) {
            LANES(PathRays) ray;
            const Real epsilon = (Real)(params.shadow_epsilon);
            ray.origin = LANES(points_on_rays)(LANES(load_vectors)(surface_position + place),
                                               next.is_refracted ? -epsilon : epsilon, bsdf.normal);
            ray.t_min = (Real)(CASTOR_SMALLEST_T);
            ray.direction = next.direction;
            ray.t_max = (Real)(INFINITY);
            LANES(store_path_rays)(ray, next_origin_tmin + place, next_direction_tmax + place);
            LANES(store_whole_column)(slot, next_slot + place);
            LANES(scatter_vectors)(throughput, slot, goes_on, path_throughput);
            LANES(PathRecords) record = LANES(path_records)(params, path_state, slot);
            record.density = next.density;
            record.cosine = LANES(dot_products)(bsdf.normal, next.direction);
#if CASTOR_HAS_DIELECTRICS
            // Refraction enters or leaves. What is reflected within stays within, also where the eye was there.
            const Whole beyond = bsdf.is_inside ? (Whole)(CASTOR_INVALID_INDEX) : known_number;
            const Whole here = bsdf.is_inside ? known_number : record.medium;
            record.medium = next.is_refracted ? beyond : here;
#endif
            LANES(store_path_records)(record, slot, goes_on, path_state);
            ray_counts[get_global_id(0)] += popcount(LANES(mask_of)(goes_on));
        }
    }
    LANES(store_bytes)(goes_on ? (Whole)(0) : (Whole)(CASTOR_PATH_ENDED), next_rank + place);
}
