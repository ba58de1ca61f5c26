// CASTOR_LANES paths a work-item (see lanes.cl). Writes the rays that go on from their surfaces, and next_rank 0;
// CASTOR_PATH_ENDED where there is none. `node`: of all paths, where the scene has no dielectrics. Where it has, each
// path has two rays, the reflected one at its place and the refracted one row_length places later, and all places
// below row_length are written.
#include "castor/shared/wave_columns.h"
#include "device/scattering.lanes.cl"

#define CASTOR_SCATTER_PARAMETERS                                                                                  \
    const RenderParams params, const uint node, const uint row_length, const global Material *restrict materials,  \
        CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(path_state), CASTOR_READ(surface_position), \
        CASTOR_READ(surface_normal), CASTOR_READ(ray_direction_tmax), CASTOR_READ(surface_material),               \
        CASTOR_READ(surface_diffuse), CASTOR_READ(surface_specular), CASTOR_WRITE(path_throughput),                \
        CASTOR_WRITE(next_slot), CASTOR_WRITE(next_origin_tmin), CASTOR_WRITE(next_direction_tmax),                \
        CASTOR_WRITE(next_throughput), CASTOR_WRITE(next_state), CASTOR_WRITE(next_rank), CASTOR_WRITE(ray_counts)
#define CASTOR_SCATTER_ARGUMENTS                                                                                \
    params, node, row_length, materials, pixel_blocks, path_slot, path_state, surface_position, surface_normal, \
        ray_direction_tmax, surface_material, surface_diffuse, surface_specular, path_throughput, next_slot,    \
        next_origin_tmin, next_direction_tmax, next_throughput, next_state, next_rank, ray_counts

CASTOR_ONCE void LANES(scatter_paths_of_item)(const uint item, CASTOR_SCATTER_PARAMETERS)
{
    const uint place = item * CASTOR_LANES;
    if (place >= (CASTOR_HAS_DIELECTRICS ? row_length : params.path_count)) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask goes_on = is_path & (material_number != CASTOR_INVALID_INDEX);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    LANES(Branches) next = LANES(no_branches)();
#if CASTOR_HAS_DIELECTRICS
    const LANES(PathStates) state = LANES(path_states)(params, path_state, slot, is_path);
    LANES(Branches) refracted = LANES(no_branches)();
#endif
    if (LANES(mask_of)(goes_on)) {
        LANES(Incidences) at;
        at.slot = slot;
        at.node = (Whole)(node);
        at.media.medium = at.media.outer = (Whole)(0);
        at.is_inside = (Whole)(0) != 0u;
        at.material_number = goes_on ? material_number : (Whole)(0);
        at.material = LANES(load_materials)(materials, at.material_number);
#if CASTOR_HAS_TEXTURES
        at.material =
            LANES(textured_materials)(at.material, params.flags, surface_diffuse + place, surface_specular + place);
#endif
        at.position = LANES(load_vectors)(surface_position + place);
        at.normal = LANES(load_vectors)(surface_normal + place);
        at.wo = LANES(directions_back)(ray_direction_tmax + place);
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
        at.slot = state.slot;
        at.node = state.node;
        at.media = state.media;
        at.is_inside = is_dielectric & !(at.cos_wo > 0.0f);
        const Real reflectance = refraction.reflectance;
        factor = LANES(choose_vectors)(is_dielectric, LANES(vectors)(reflectance, reflectance, reflectance), factor);
#endif
        next = LANES(reflected_branches)(params, pixel_blocks, at, factor, goes_on);
#if CASTOR_HAS_DIELECTRICS
        next.exists &= !is_dielectric | LANES(are_bright)(next);
        if (LANES(mask_of)(is_dielectric))
            refracted = LANES(refracted_branches)(params, pixel_blocks, at, refraction, is_dielectric);
#endif
    }
    LANES(store_rays_of_branches)(next, place, next_origin_tmin, next_direction_tmax, next_rank);
    uint rays = popcount(LANES(mask_of)(next.exists));
#if CASTOR_HAS_DIELECTRICS
    LANES(store_states_of_branches)(next, state.slot, place, next_throughput, next_state);
    LANES(store_rays_of_branches)(refracted, row_length + place, next_origin_tmin, next_direction_tmax, next_rank);
    LANES(store_states_of_branches)(refracted, state.slot, row_length + place, next_throughput, next_state);
    rays += popcount(LANES(mask_of)(refracted.exists));
#else
    if (rays) {
        LANES(store_whole_column)(slot, next_slot + place);
        LANES(scatter_vectors)(next.throughput, slot, next.exists, path_throughput);
    }
#endif
    if (rays) ray_counts[item] += rays;
}

kernel CASTOR_IN_LANES void LANES(scatter)(CASTOR_SCATTER_PARAMETERS)
{
    LANES(scatter_paths_of_item)(get_global_id(0), CASTOR_SCATTER_ARGUMENTS);
}
