// CASTOR_LANES paths a work-item (see lanes.cl). Writes the rays that go on from their surfaces, and next_rank 0;
// CASTOR_PATH_ENDED where there is none. `node`: of all paths, and all are less deep than max_depth, where the scene
// has no dielectrics; where it has, each path knows its own, and a slot whose path ends goes on with a ray that waits.
#include "castor/shared/wave_columns.h"
#include "device/scattering.lanes.cl"

kernel CASTOR_IN_LANES void LANES(scatter)(
    const RenderParams params, const uint max_depth, const uint node, const global Material *restrict materials,
    CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(surface_position), CASTOR_READ(surface_normal),
    CASTOR_READ(surface_wo), CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse), CASTOR_READ(surface_specular),
    CASTOR_WRITE(path_throughput), CASTOR_WRITE(path_state), CASTOR_WRITE(path_outer),
    CASTOR_WRITE(stack_origin_medium), CASTOR_WRITE(stack_direction_depth), CASTOR_WRITE(stack_throughput_node),
    CASTOR_WRITE(stack_outer), CASTOR_WRITE(next_slot), CASTOR_WRITE(next_origin_tmin),
    CASTOR_WRITE(next_direction_tmax), CASTOR_WRITE(next_rank), CASTOR_WRITE(ray_counts))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    Mask goes_on = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    LANES(Branches) next = LANES(no_branches)();
#if CASTOR_HAS_DIELECTRICS
    LANES(PathStates) state = LANES(path_states)(params, path_state, slot);
    goes_on &= state.depth < max_depth;
#endif
    if (LANES(mask_of)(goes_on)) {
        LANES(Incidences) at;
        at.slot = slot;
        at.node = (Whole)(node);
        at.depth = at.medium = at.outer = (Whole)(0);
        at.is_inside = (Whole)(0) != 0u;
        at.material_number = goes_on ? material_number : (Whole)(0);
        at.material = LANES(load_materials)(materials, at.material_number);
#if CASTOR_HAS_TEXTURES
        at.material =
            LANES(textured_materials)(at.material, params.flags, surface_diffuse + place, surface_specular + place);
#endif
        at.position = LANES(load_vectors)(surface_position + place);
        at.normal = LANES(load_vectors)(surface_normal + place);
        at.wo = LANES(load_vectors)(surface_wo + place);
        at.cos_wo = LANES(dot_products)(at.normal, at.wo);
        at.throughput = LANES(throughputs)(params, path_throughput, slot);
        LANES(Vectors) factor = LANES(mirror_factor)(at.material, params.flags, at.cos_wo);
#if CASTOR_HAS_DIELECTRICS
        const Mask is_dielectric = goes_on & (at.material.kind == CASTOR_MATERIAL_DIELECTRIC);
        LANES(Refractions) refraction;
        refraction.reflectance = (Real)(0.0f);
        refraction.direction = at.wo;
        if (LANES(mask_of)(is_dielectric))
            refraction = LANES(refract)(at.material.refraction_index, at.normal, at.wo, at.cos_wo);
        at.node = state.node;
        at.depth = state.depth;
        at.medium = state.medium;
        at.outer = (Whole)(CASTOR_INVALID_INDEX);
        if (!(params.flags & CASTOR_RENDER_FIRST_BOUNCE)) at.outer = LANES(gather_wholes)(path_outer, slot, 1);
        at.is_inside = is_dielectric & !(at.cos_wo > 0.0f);
        const Real reflectance = refraction.reflectance;
        factor = LANES(choose_vectors)(is_dielectric, LANES(vectors)(reflectance, reflectance, reflectance), factor);
#endif
        next = LANES(reflected_branches)(params, pixel_blocks, at, factor, goes_on);
#if CASTOR_HAS_DIELECTRICS
        next.exists &= !is_dielectric | LANES(are_bright)(next);
        if (LANES(mask_of)(is_dielectric)) {
            const LANES(Branches) refracted =
                LANES(refracted_branches)(params, pixel_blocks, at, refraction, is_dielectric);
            const Mask waits = next.exists & refracted.exists;
            LANES(push_branches)
            (params, refracted, state.waiting, slot, waits, stack_origin_medium, stack_direction_depth,
             stack_throughput_node, stack_outer);
            state.waiting += waits ? (Whole)(1) : (Whole)(0);
            next = LANES(choose_branches)(refracted.exists & !waits, refracted, next);
        }
#endif
    }
#if CASTOR_HAS_DIELECTRICS
    const Mask takes = is_path & !next.exists & (state.waiting != 0u);
    if (LANES(mask_of)(takes)) {
        state.waiting -= takes ? (Whole)(1) : (Whole)(0);
        const LANES(Branches) waiting =
            LANES(waiting_branches)(params, state.waiting, slot, takes, stack_origin_medium, stack_direction_depth,
                                    stack_throughput_node, stack_outer);
        next = LANES(choose_branches)(takes, waiting, next);
    }
    state.depth = next.depth;
    state.node = next.node;
    state.medium = next.medium;
#endif
    if (LANES(mask_of)(next.exists)) {
        LANES(PathRays) ray;
        ray.origin = next.origin;
        ray.t_min = (Real)(CASTOR_SMALLEST_T);
        ray.direction = next.direction;
        ray.t_max = (Real)(INFINITY);
        LANES(store_path_rays)(ray, next_origin_tmin + place, next_direction_tmax + place);
        LANES(store_whole_column)(slot, next_slot + place);
        LANES(scatter_vectors)(next.throughput, slot, next.exists, path_throughput);
#if CASTOR_HAS_DIELECTRICS
        LANES(store_path_states)(state, slot, next.exists, path_state);
        LANES(scatter_wholes)(next.outer, slot, next.exists, path_outer);
#endif
        ray_counts[get_global_id(0)] += popcount(LANES(mask_of)(next.exists));
    }
    LANES(store_bytes)(next.exists ? (Whole)(0) : (Whole)(CASTOR_PATH_ENDED), next_rank + place);
}
