// CASTOR_LANES paths a work-item (see lanes.cl). The light of lights that no ray meets, at points where paths were
// scattered within solids: one of a path's points since it was at a surface, which scatter_within has kept, stands for
// all of them.
//
// shadow_origin_tmin: that point, and for how many it stands; 0: for none. shadow_direction_tmax: the unit direction in
// which the path got there, and the anisotropy of scattering. shadow_contribution: what the path carries from there on,
// and the solid's material. What is written in their place is as shade_paths writes it: a ray to a random light, and
// what arrives unless the ray is stopped.
//
// The surfaces of solids stop such rays, but of those of index 1: no others reach a light that is infinitely far away.
#include "castor/shared/wave_columns.h"
#include "device/path_lights.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/refraction.lanes.cl"

// Returns the phase function of Henyey and Greenstein (1941): the density, by solid angle, of directions to which light
// is turned by an angle with this cosine.
CASTOR_INLINE Real LANES(phase_function)(const Real g, const Real cosine)
{
    const Real one = (Real)(1.0f);
    const Real nearest = one - fabs(g);
    const Real base = LANES(larger)(fma(g, g, one) - 2.0f * g * cosine, nearest * nearest);  // whatever is rounded
    return LANES(divide)(0.07957747f * fma(-g, g, one), base * LANES(square_root)(base));    // 1 / (4 pi)
}

kernel CASTOR_IN_LANES void LANES(light_within)(
    const RenderParams params, const PathParams path, const global Material *restrict materials,
    const global Light *restrict lights, CASTOR_READ(light_groups), CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot),
    CASTOR_READ(path_throughput), CASTOR_READ(path_state), CASTOR_WRITE(shadow_origin_tmin),
    CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution), CASTOR_WRITE(shadow_length),
    CASTOR_WRITE(shadow_medium), CASTOR_WRITE(shadow_outer), CASTOR_WRITE(ray_counts))
{
    const uint item = get_global_id(0), place = item * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const LANES(Rows) kept = LANES(load_rows)(shadow_origin_tmin + place);
    const LANES(Rows) before = LANES(load_rows)(shadow_direction_tmax + place);
    const LANES(Rows) carried = LANES(load_rows)(shadow_contribution + place);
    const Mask counts = is_path & (kept.w > 0.0f);
    const Real zero = (Real)(0.0f);
    LANES(PathRays) ray = LANES(dead_rays)();
    LANES(Vectors) contribution = LANES(vectors)(zero, zero, zero);
    Real group = zero;
    if (LANES(mask_of)(counts)) {
        const Whole slot = LANES(slots)(params, path_slot, place, is_path);
        const LANES(Points) choice = LANES(points_of_slots)(
            params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_LIGHT_WITHIN));
        const LANES(Points) at = LANES(points_of_slots)(
            params, pixel_blocks, slot, LANES(dimension_of_node)((Whole)(path.node), CASTOR_DIMENSION_LIGHT_POINT));
        const uint light_count = path.unmet_end - path.first_unmet;
        const Whole number =
            path.first_unmet + min(LANES(convert_uint)(choice.x * (float)light_count), (Whole)(light_count - 1u));
        const LANES(Vectors) origin = LANES(vectors_of_rows)(kept);
        LANES(LightSamples) sample = LANES(no_light_samples)();
        uint numbers[CASTOR_LANES];
        LANES(store_wholes)(number, numbers);
        for (uint left = LANES(mask_of)(counts); left;) {
            const uint next = numbers[lowest_bit(left)];
            const Mask is_next = number == next;
            const uint kind = lights[next].kind;
            if (kind < CASTOR_LIGHT_AREA && !CASTOR_IS_SUN(lights[next]))
                sample = LANES(choose_light_samples)(is_next, LANES(sample_light)(lights[next], origin), sample);
            if (kind == CASTOR_LIGHT_AREA)
                sample = LANES(choose_light_samples)(is_next, LANES(sample_area)(lights[next], origin, at), sample);
            left &= ~LANES(mask_of)(is_next);
        }
        const Real phase =
            LANES(phase_function)(before.w, LANES(dot_products)(LANES(vectors_of_rows)(before), sample.wi));
        const Whole medium = counts ? LANES(as_uint)(carried.w) : (Whole)(0);
        const Mask is_far = sample.distance > FLT_MAX;
        LANES(Vectors)
        arriving =
            LANES(product_of_vectors)(LANES(vectors_of_rows)(carried),
                                      LANES(scaled_vectors)(sample.irradiance, phase * kept.w * (float)light_count));
#if CASTOR_HAS_MATCHED_SOLIDS
        // What is left on the way is found there.
        LANES(store_whole_column)(medium, shadow_medium + place);
        const Whole outer = LANES(as_uint)(LANES(gather_rows)(path_throughput, slot).w);
        LANES(store_whole_column)(outer, shadow_outer + place);
#else
        const LANES(Vectors) absorption = LANES(load_materials)(materials, medium).absorption;
        arriving =
            LANES(product_of_vectors)(arriving, LANES(transmittance)(absorption, is_far ? zero : sample.distance));
#endif
        contribution = LANES(choose_vectors)(counts, arriving, contribution);
        const Mask is_lit = LANES(largest_of)(contribution) > 0.0f;
        LANES(PathRays) to_light;
        to_light.origin = origin;
        to_light.t_min = (Real)(CASTOR_SMALLEST_T);
        to_light.direction =
            LANES(choose_vectors)(is_far, sample.wi, LANES(difference_of_vectors)(sample.point, origin));
        to_light.t_max = is_far ? (Real)(INFINITY) : (Real)(CASTOR_LIGHT_TMAX);
        ray = LANES(choose_rays)(is_lit, to_light, ray);
        ray_counts[item] += popcount(LANES(mask_of)(is_lit));
#if CASTOR_HAS_LIGHT_GROUPS
        group = LANES(convert_float)(LANES(gather_wholes)(light_groups, counts ? number : (Whole)(0), 1));
#endif
#if CASTOR_HAS_PANES
        LANES(store_real_column)(LANES(gather_rows)((const global float4 *)path_state, slot).w, shadow_length + place);
#endif
    }
    LANES(store_path_rays)(ray, shadow_origin_tmin + place, shadow_direction_tmax + place);
    LANES(store_rows)(contribution.x, contribution.y, contribution.z, group, shadow_contribution + place);
}
