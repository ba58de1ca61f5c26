// CASTOR_LANES paths a work-item (see lanes.cl). Makes shadow rays of the lights that scatter_within has kept: what
// they bring stands for all lights that it saw on the paths' ways, so it is multiplied by the sum of their weights.
//
// shadow_origin_tmin has these sums for t_min; where they are 0 there is no light, and the ray will hit nothing.
#include "castor/shared/wave_columns.h"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"

kernel CASTOR_IN_LANES void LANES(light_within)(const RenderParams params, CASTOR_READ(path_slot),
                                                CASTOR_READ(path_state), CASTOR_WRITE(shadow_origin_tmin),
                                                CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution),
                                                CASTOR_WRITE(shadow_length), CASTOR_WRITE(ray_counts))
{
    const uint item = get_global_id(0), place = item * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const LANES(Rows) begin = LANES(load_rows)(shadow_origin_tmin + place);
    const LANES(Rows) end = LANES(load_rows)(shadow_direction_tmax + place);
    const LANES(Rows) light = LANES(load_rows)(shadow_contribution + place);
    const Mask is_lit = is_path & (begin.w > 0.0f) & (begin.w <= FLT_MAX);
    const Real zero = (Real)(0.0f);
    LANES(PathRays) ray;
    ray.origin = LANES(vectors_of_rows)(begin);
    ray.t_min = (Real)(CASTOR_SMALLEST_T);
    ray.direction = LANES(vectors_of_rows)(end);
    ray.t_max = end.w;
    LANES(store_path_rays)
    (LANES(choose_rays)(is_lit, ray, LANES(dead_rays)()), shadow_origin_tmin + place, shadow_direction_tmax + place);
    LANES(store_rows)
    (is_lit ? light.x * begin.w : zero, is_lit ? light.y * begin.w : zero, is_lit ? light.z * begin.w : zero,
     is_lit ? light.w : zero, shadow_contribution + place);
    ray_counts[item] += popcount(LANES(mask_of)(is_lit));
#if CASTOR_HAS_PANES
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    LANES(store_real_column)
    (LANES(gather_rows)((const global float4 *)path_state, is_lit ? slot : (Whole)(0)).w, shadow_length + place);
#endif
}
