// CASTOR_LANES paths a work-item (see lanes.cl). One step of paths through solids that scatter light: draws how far
// each goes before it is scattered, and in which direction it goes on; or it meets what inside_hits names.
//
// passed: CASTOR_PASSED where a path was scattered, and has a new ray to be traced; 0 elsewhere. What a path carries is
// multiplied by what absorbing and scattering leave on the way, so that shade_paths takes nothing more for it. A path
// that was scattered counts the light that it meets in full: rays are sent to those lights alone that no ray meets.
//
// sees_lights: wherever a path is scattered it sees some of these lights, and one of all that it saw is kept for
// light_within (Talbot and others 2005, "Importance Resampling for Global Illumination"; one after another, as Chao
// 1982 draws samples): shadow_origin_tmin and shadow_direction_tmax have the ray to it, and for t_min the sum of all
// weights; shadow_contribution has what it brings for a weight of 1.
//
// The distance is drawn for one of red, green and blue, which is chosen by what the path would bring in it, and weighed
// against all three (Wilkie and others 2014, "Hero Wavelength Spectral Sampling"); the direction by the phase function
// of Henyey and Greenstein (1941). A ray that meets nothing is in no closed solid, and is not scattered.
//
// step: how often paths have been scattered since they were at a surface. At 0 all of the queue is looked at, with what
// its rays met in inside_hits; then the rays in passing_origin_tmin and passing_direction_tmax, of the paths at
// passing_places. A new ray is written there and to the queue. A path that goes no further has its last ray and hit in
// the queue, and a ray that hits nothing in the list, so that several steps can be taken before the list is made anew.
// is_last: what is scattered once more ends. Where eye rays begin in a solid, the first step stores the records of all
// paths.
#include "castor/shared/wave_columns.h"
#include "device/frame.lanes.cl"
#include "device/hits.lanes.cl"
#include "device/light_within.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/shading.lanes.cl"

// A path that carries less than this ends with a probability, as others do that bounce (CASTOR_SURVIVAL).
#define CASTOR_LEAST_WITHIN 0.5f

// Returns the cosines of angles by which the phase function with mean cosine g turns light. `u`: in [0, 1).
CASTOR_INLINE Real LANES(turning_cosines)(const Real g, const Real u)
{
    const Real one = (Real)(1.0f);
    const Mask is_even = fabs(g) < 1e-3f;  // and g is not divided by
    const Real known_g = is_even ? one : g;
    const Real square = known_g * known_g;
    const Real ratio =
        LANES(divide)(is_even ? one : one - square, is_even ? one : fma(2.0f * known_g, u, one - known_g));
    const Real turned = LANES(divide)(one + square - ratio * ratio, 2.0f * known_g);
    return clamp(is_even ? fma((Real)(2.0f), u, (Real)(-1.0f)) : turned, (Real)(-1.0f), one);
}

kernel CASTOR_IN_LANES void LANES(scatter_within)(
    const RenderParams params, const PathParams path, const uint step, const uint is_last, const uint has_roulette,
    const uint sees_lights, const global Material *restrict materials,
    const global PrincipledMaterial *restrict principled_materials, const global Light *restrict lights,
    CASTOR_READ(light_groups), CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(passing_places),
    CASTOR_READ(inside_hits), CASTOR_WRITE(hits), CASTOR_WRITE(ray_origin_tmin), CASTOR_WRITE(ray_direction_tmax),
    CASTOR_WRITE(passing_origin_tmin), CASTOR_WRITE(passing_direction_tmax), CASTOR_WRITE(path_throughput),
    CASTOR_WRITE(path_state), CASTOR_WRITE(passed), CASTOR_WRITE(shadow_origin_tmin),
    CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution), CASTOR_WRITE(shadow_medium),
    CASTOR_WRITE(shadow_outer))
{
    const uint first = get_global_id(0) * CASTOR_LANES;
    if (first >= params.path_count) return;
    if (sees_lights && step == 0) {
        const Real none = (Real)(0.0f);
        LANES(store_rows)(none, none, none, none, shadow_origin_tmin + first);
    }
    Mask is_path = LANES(is_place)(first, params.path_count);
    if (step > 0) is_path &= LANES(load_rows)(passing_direction_tmax + first).w > 0.0f;  // t_max
    if (!LANES(mask_of)(is_path)) {
        LANES(store_bytes)((Whole)(0), passed + first);
        return;
    }
    const Whole slot = LANES(slots)(params, path_slot, first, is_path);
    LANES(PathRecords) record = LANES(path_records)(params, path, path_throughput, path_state, slot);
    const LANES(Hits) hit = LANES(load_hits)(inside_hits + first);
    const Mask is_met = is_path & (hit.primitive != CASTOR_INVALID_INDEX);
    const Mask is_in_solid = is_met & (record.media.medium != CASTOR_INVALID_INDEX);
    // Lanes that are in none have a solid that another has: materials that are all the same are loaded once.
    const Whole of_solids = is_in_solid ? record.media.medium : (Whole)(0);
    const Whole medium = is_in_solid ? of_solids : (Whole)(LANES(largest_of_lanes)(of_solids));
    const Mask is_here = is_in_solid & LANES(scatter_light)(materials, medium);
    const int are_eye_rays = params.flags & CASTOR_RENDER_FIRST_BOUNCE;
    if (step == 0 && !LANES(mask_of)(is_here) && !are_eye_rays) {
        LANES(store_bytes)((Whole)(0), passed + first);
        return;
    }
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const uint first_place = step == 0 ? first : passing_places[first];
    const Whole of_lanes = step == 0 ? first + LANES(lane_numbers)() : LANES(load_whole_column)(passing_places + first);
    const Whole place = is_path ? of_lanes : (Whole)(first_place);
    const LANES(Vectors) along = LANES(gather_vectors)(ray_direction_tmax, place);
    const LANES(Vectors) direction = LANES(normalized_vectors)(along);
    const LANES(Rows) begin = LANES(gather_rows)(ray_origin_tmin, place);
    const Real per_t = LANES(square_root)(LANES(dot_products)(along, along));
    // A ray that has passed panes begins beyond them: what is before has been counted.
    const Real passed_length = begin.w * per_t, length = (is_here ? hit.t : zero) * per_t;
    const Real rest_length = LANES(larger)(length - passed_length, zero);
    const LANES(Vectors) extinction = LANES(load_materials)(materials, medium).absorption;
    const LANES(Vectors) albedo = LANES(load_scattering_albedos)(materials, medium);

    // Which colour says how far, and how far.
    const Whole node = (Whole)(path.node);
    const LANES(Points) point = LANES(points_of_slots)(
        params, pixel_blocks, slot,
        LANES(dimension_of_node)(node, CASTOR_OPACITY_DIMENSION(CASTOR_DIMENSION_FREE_PATH, step)));
    const LANES(Vectors) brought = LANES(product_of_vectors)(record.throughput, albedo);
    const Real sum = brought.x + brought.y + brought.z;
    const Mask has_sum = (sum > 0.0f) & (sum <= FLT_MAX);
    const Real per_sum = LANES(divide)(one, has_sum ? sum : one);
    const Real third = (Real)(0.33333334f);
    const LANES(Vectors) share =
        LANES(choose_vectors)(has_sum, LANES(scaled_vectors)(brought, per_sum), LANES(vectors)(third, third, third));
    const Mask is_red = point.y < share.x, is_green = !is_red & (point.y < share.x + share.y);
    const Real below = is_red ? zero : is_green ? share.x : share.x + share.y;
    const Real chosen_share = is_red ? share.x : is_green ? share.y : share.z;
    const Real rest = LANES(divide)(point.y - below, chosen_share > 0.0f ? chosen_share : one);  // in [0, 1) again
    const Real chosen = is_red ? extinction.x : is_green ? extinction.y : extinction.z;
    const Mask can_scatter = chosen > 0.0f;
    const Real free_path = LANES(divide)(-LANES(logarithm)(one - point.x), can_scatter ? chosen : one);
    Mask is_scattered = is_here & can_scatter & (free_path < rest_length);
    const LANES(Vectors) left = LANES(transmittance)(extinction, is_scattered ? free_path : rest_length);
    const LANES(Vectors) ending =
        LANES(choose_vectors)(is_scattered, LANES(product_of_vectors)(extinction, left), left);
    const Real density = LANES(dot_products)(share, ending);
    const Mask is_known = density > 0.0f;
    const Real weight = is_known ? LANES(divide)(one, is_known ? density : one) : zero;
    const LANES(Vectors) carried = LANES(product_of_vectors)(
        record.throughput, LANES(choose_vectors)(is_scattered, LANES(product_of_vectors)(ending, albedo), ending));
    record.throughput = LANES(choose_vectors)(is_here, LANES(scaled_vectors)(carried, weight), record.throughput);

    // What carries little ends, and then counts as what met the surface with nothing.
    const LANES(Vectors) black = LANES(vectors)(zero, zero, zero);
    const Real largest = LANES(largest_of)(record.throughput);
    Mask ends = is_scattered & !((largest > 0.0f) & (largest <= FLT_MAX));
    const Mask is_weak = is_scattered & !ends & (largest < CASTOR_LEAST_WITHIN);
    if (has_roulette && LANES(mask_of)(is_weak)) {
        const Real survival = is_weak ? LANES(divide)(largest, (Real)(CASTOR_LEAST_WITHIN)) : one;
        ends |= is_weak & (rest >= survival);
        record.throughput = LANES(scaled_vectors)(record.throughput, LANES(divide)(one, survival));
    }
    is_scattered &= !ends;
    if (is_last) ends |= is_scattered;
    record.throughput = LANES(choose_vectors)(ends, black, record.throughput);
    LANES(store_bytes)(is_scattered ? (Whole)(CASTOR_PASSED) : (Whole)(0), passed + first);

    if (is_last) is_scattered = (Whole)(0) != 0u;
    LANES(PathRays) ray = LANES(dead_rays)();
    if (LANES(mask_of)(is_scattered)) {
        const Whole principled = LANES(principled_numbers)(materials, medium);
        const Real g =
            LANES(gather_reals)(&principled_materials->scattering_anisotropy, is_scattered ? principled : (Whole)(0),
                                (uint)(sizeof(PrincipledMaterial) / sizeof(float)));
        const LANES(Points) turn = LANES(points_of_slots)(
            params, pixel_blocks, slot,
            LANES(dimension_of_node)(node, CASTOR_OPACITY_DIMENSION(CASTOR_DIMENSION_TURN, step)));
        const Real cosine = LANES(turning_cosines)(g, turn.x);
        const Real sine = LANES(square_root)(LANES(larger)(one - cosine * cosine, zero));
        // Rounding must not put the point outside of the solid.
        const Real most = LANES(larger)(rest_length - params.shadow_epsilon, 0.5f * rest_length);
        const Real way = passed_length + LANES(smaller)(free_path, most);
        LANES(PathRays) next;
        next.origin = LANES(points_on_rays)(LANES(vectors_of_rows)(begin), way, direction);
        next.t_min = (Real)(CASTOR_SMALLEST_T);
        next.direction = LANES(directions_around)(direction, cosine, sine, turn.y);
        next.t_max = (Real)(INFINITY);
        LANES(scatter_rows)
        (next.origin.x, next.origin.y, next.origin.z, next.t_min, place, is_scattered, ray_origin_tmin);
        LANES(scatter_rows)
        (next.direction.x, next.direction.y, next.direction.z, next.t_max, place, is_scattered, ray_direction_tmax);
        ray = LANES(choose_rays)(is_scattered, next, ray);
        if (sees_lights) {
            LANES(LightViews) view;
            view.origin = next.origin;
            view.direction = direction;
            view.g = g;
            view.carried = record.throughput;
            view.extinction = extinction;
            view.drawn = LANES(points_of_slots)(
                params, pixel_blocks, slot,
                LANES(dimension_of_node)(node, CASTOR_OPACITY_DIMENSION(CASTOR_DIMENSION_LIGHT_WITHIN, step)));
            view.on_area = LANES(points_of_slots)(params, pixel_blocks, slot,
                                                  LANES(dimension_of_node)(node, CASTOR_DIMENSION_LIGHT_WITHIN));
            const Real weights_before =
                LANES(gather_rows)(shadow_origin_tmin, is_scattered ? place : (Whole)(first_place)).w;
            const LANES(KeptLights) kept =
                LANES(keep_lights)(lights, light_groups, path, view, is_scattered, weights_before);
            LANES(scatter_wholes)
            (LANES(as_uint)(kept.all_weights), 4u * place + 3u, is_scattered, (global uint *)shadow_origin_tmin);
            LANES(scatter_rows)
            (next.origin.x, next.origin.y, next.origin.z, kept.all_weights, place, kept.is_new, shadow_origin_tmin);
            LANES(scatter_rows)
            (kept.direction.x, kept.direction.y, kept.direction.z, kept.t_max, place, kept.is_new,
             shadow_direction_tmax);
            LANES(scatter_rows)
            (kept.color.x, kept.color.y, kept.color.z, kept.group, place, kept.is_new, shadow_contribution);
#if CASTOR_HAS_MATCHED_SOLIDS
            LANES(scatter_wholes)(medium, place, kept.is_new, shadow_medium);
            LANES(scatter_wholes)(record.media.outer, place, kept.is_new, shadow_outer);
#endif
        }
        record.density = is_scattered ? zero : record.density;
        record.length += is_scattered ? way : zero;
    }
    LANES(store_path_records)(record, slot, are_eye_rays ? is_path : is_here, path_throughput, path_state);
    if (step == 0) return;
    LANES(store_path_rays)(ray, passing_origin_tmin + first, passing_direction_tmax + first);
    LANES(scatter_hits)(inside_hits + first, place, is_path & !is_scattered, hits);
}
