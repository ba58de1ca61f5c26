// CASTOR_LANES paths a work-item (see lanes.cl). Writes the mirror rays of their surfaces, and next_rank 0;
// CASTOR_PATH_ENDED where there is none.
#include "castor/shared/wave_columns.h"
#include "device/queue.lanes.cl"
#include "device/shading.lanes.cl"

kernel CASTOR_IN_LANES void LANES(scatter)(const RenderParams params, const global Material *restrict materials,
                                           CASTOR_READ(path_slot), CASTOR_READ(surface_position),
                                           CASTOR_READ(surface_normal), CASTOR_READ(surface_wo),
                                           CASTOR_READ(surface_material), CASTOR_WRITE(path_throughput),
                                           CASTOR_WRITE(next_slot), CASTOR_WRITE(next_origin_tmin),
                                           CASTOR_WRITE(next_direction_tmax), CASTOR_WRITE(next_rank),
                                           CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    Mask goes_on = is_met;
    if (LANES(mask_of)(is_met)) {
        const LANES(Materials) material = LANES(load_materials)(materials, is_met ? material_number : (Whole)(0));
        const LANES(Vectors) normal = LANES(load_vectors)(surface_normal + place);
        const LANES(Vectors) wo = LANES(load_vectors)(surface_wo + place);
        const Real cos_wo = LANES(dot_products)(normal, wo);
        const Whole slot = LANES(slots)(params, path_slot, place, is_path);
        const LANES(Vectors) throughput = LANES(product_of_vectors)(
            LANES(throughputs)(params, path_throughput, slot), LANES(mirror_factor)(material, params.flags, cos_wo));
        goes_on &= (throughput.x != 0.0f) | (throughput.y != 0.0f) | (throughput.z != 0.0f);
        if (LANES(mask_of)(goes_on)) {
            LANES(PathRays) ray;
            ray.direction = LANES(difference_of_vectors)(LANES(scaled_vectors)(normal, 2.0f * cos_wo), wo);
            const LANES(Vectors) offset = params.flags & CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY ? ray.direction : normal;
            ray.origin = LANES(points_on_rays)(LANES(load_vectors)(surface_position + place),
                                               (Real)(params.shadow_epsilon), offset);
            ray.t_min = (Real)(CASTOR_SMALLEST_T);
            ray.t_max = (Real)(INFINITY);
            LANES(store_path_rays)(ray, next_origin_tmin + place, next_direction_tmax + place);
            LANES(store_whole_column)(slot, next_slot + place);
            LANES(scatter_vectors)(throughput, slot, goes_on, path_throughput);
            ray_counts[get_global_id(0)] += popcount(LANES(mask_of)(goes_on));
        }
    }
    LANES(store_bytes)(goes_on ? (Whole)(0) : (Whole)(CASTOR_PATH_ENDED), next_rank + place);
}
