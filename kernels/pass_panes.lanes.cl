// CASTOR_LANES paths a work-item (see lanes.cl). Lets shadow rays that find_passed left at panes pass them: what they
// bring is multiplied by what a pane lets pass straight. A pane that lets nothing pass, or scatters it, stops a ray.
// Surfaces of solids of index 1 are such panes for rays to lights that no other ray meets. What is within takes its
// part of the light: shadow_medium says in which solid a ray is, and its t_min how far that has been counted. The
// surfaces are those that shadow rays met. `dimension`: that of the texels, see CASTOR_OPACITY_DIMENSION. `has_places`:
// the rays are those at passing_places; else all.
#include "castor/shared/wave_columns.h"
#include "device/hits.lanes.cl"
#include "device/media.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/scatterers.lanes.cl"

kernel CASTOR_IN_LANES void LANES(pass_panes)(
    const RenderParams params, const PathParams path, const uint dimension, const uint has_places,
    const global Material *restrict materials, const global PrincipledMaterial *restrict principled_materials,
    const global Texture *restrict textures, const global TextureImage *restrict texture_images,
    const global uint *restrict texels, CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(passing_places),
    CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_READ(surface_normal),
    CASTOR_READ(surface_material), CASTOR_READ(surface_uvs), CASTOR_READ(surface_tangent), CASTOR_READ(surface_color),
    CASTOR_READ(shadow_length), CASTOR_WRITE(shadow_medium), CASTOR_WRITE(shadow_outer),
    CASTOR_WRITE(shadow_contribution), CASTOR_WRITE(passed))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Whole state = LANES(load_bytes)(passed + place);
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_at_pane = LANES(is_place)(place, params.path_count) & (state == CASTOR_AT_PANE) &
                            (material_number != CASTOR_INVALID_INDEX);
    const Whole of_queue =
        has_places ? LANES(load_whole_column)(passing_places + place) : LANES(lane_numbers)() + place;
#if CASTOR_HAS_MATCHED_SOLIDS
    // What solids leave between the surface before and this one, or the light.
    const LANES(Hits) hit = LANES(load_hits)(hits + place);
    const LANES(Rows) begin = LANES(load_rows)(ray_origin_tmin + place),
                      end = LANES(load_rows)(ray_direction_tmax + place);
    const Mask is_ray = LANES(is_place)(place, params.path_count) & (state != CASTOR_STOPPED) & (end.w > begin.w);
    if (!LANES(mask_of)(is_ray)) return;
    const Whole of_ray = is_ray ? of_queue : (Whole)(0);
    LANES(Media) media;
    media.medium = LANES(gather_wholes)(shadow_medium, of_ray, 1);
    media.outer = LANES(gather_wholes)(shadow_outer, of_ray, 1);
    const Mask is_stopped_by_solids = media.medium == CASTOR_STOPPED_BY_SOLIDS;
    const Real way = (hit.primitive != CASTOR_INVALID_INDEX ? hit.t : end.w) - begin.w;
    // A ray without an end that meets nothing is in no closed solid.
    const Mask is_within =
        is_ray & !is_stopped_by_solids & (media.medium != CASTOR_INVALID_INDEX) & (way > 0.0f) & (way <= FLT_MAX);
    if (LANES(mask_of)(is_within)) {
        const LANES(Vectors) ray = LANES(vectors_of_rows)(end);
        const Real length = way * LANES(square_root)(LANES(dot_products)(ray, ray));
        const LANES(Materials) material = LANES(load_materials)(materials, is_within ? media.medium : (Whole)(0));
        const LANES(Vectors) left = LANES(transmittance)(material.absorption, is_within ? length : (Real)(0.0f));
        const LANES(Rows) whole = LANES(gather_rows)(shadow_contribution, of_ray);
        LANES(scatter_rows)
        (whole.x * left.x, whole.y * left.y, whole.z * left.z, whole.w, of_ray, is_within, shadow_contribution);
    }
#endif
    if (!LANES(mask_of)(is_at_pane)) return;
    const Whole known_number =
        is_at_pane ? material_number : (Whole)(LANES(largest_of_lanes)(is_at_pane ? material_number : (Whole)(0)));
    const Whole number = LANES(principled_numbers)(materials, known_number);
    const LANES(Vectors) normal = LANES(load_vectors)(surface_normal + place);
    const LANES(Vectors) along = LANES(load_vectors)(ray_direction_tmax + place);
    const LANES(Vectors) wo = LANES(scaled_vectors)(LANES(normalized_vectors)(along), (Real)(-1.0f));
#if CASTOR_HAS_ATTRIBUTES
    const PrincipledTextures of_textures = {principled_materials, textures, texture_images, texels};
    const LANES(Rows) tangent = LANES(load_rows)(surface_tangent + place),
                      of_vertices = LANES(load_rows)(surface_color + place);
    // The cone is that of a path that gets here: what textures say, such as whether a pane is smooth, is said to both.
    const Real before_ray = LANES(as_float)(
        LANES(gather_wholes)((const global uint *)shadow_length, is_at_pane ? of_queue : (Whole)(0), 1));
    const Real t = is_at_pane ? LANES(load_hits)(hits + place).t : (Real)(0.0f);
    const Real width = fma(t, LANES(square_root)(LANES(dot_products)(along, along)), before_ray) * path.pixel_spread;
    const LANES(TexturePlaces) at = LANES(texture_places)(
        LANES(load_rows)(surface_uvs + place), tangent, of_vertices, width,
        LANES(points_of_slots)(params, pixel_blocks, LANES(slots)(params, path_slot, place, is_at_pane),
                               LANES(dimension_of_node)((Whole)(path.node), dimension)));
    LANES(PrincipledSurfaces)
    surface = LANES(principled_surfaces)(of_textures, number, is_at_pane, normal, tangent, wo,
                                         LANES(vectors_of_rows)(of_vertices), at);
#else
    LANES(PrincipledSurfaces) surface = LANES(plain_principled_surfaces)(principled_materials, number, normal);
#endif
    LANES(Scatterers) scatterer;
    scatterer.normal = normal;
    scatterer.is_solid = scatterer.is_inside = scatterer.is_rough = scatterer.is_principled = (Whole)(0) != 0u;
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    LANES(set_principled)(&scatterer, &surface, is_at_pane, normal, wo, LANES(vectors)(one, one, one));
    const LANES(Vectors) share =
        LANES(choose_vectors)(surface.is_unlit, LANES(vectors)(zero, zero, zero),
                              LANES(passed_panes)(&scatterer.principled, scatterer.wo_in_frame));
    Mask passes = is_at_pane & (LANES(largest_of)(share) > 0.0f);
#if CASTOR_HAS_MATCHED_SOLIDS
    const Mask is_solid = is_at_pane & scatterer.is_solid;
    passes &= !(is_solid & is_stopped_by_solids);
    const LANES(Media) beyond = LANES(media_beyond)(media, known_number, scatterer.is_inside);
    LANES(scatter_wholes)(beyond.medium, of_ray, is_solid & passes, shadow_medium);
    LANES(scatter_wholes)(beyond.outer, of_ray, is_solid & passes, shadow_outer);
#endif
    const LANES(Rows) before = LANES(gather_rows)(shadow_contribution, passes ? of_queue : (Whole)(0));
    LANES(scatter_rows)
    (before.x * share.x, before.y * share.y, before.z * share.z, before.w, of_queue, passes, shadow_contribution);
    LANES(store_bytes)
    (passes ? (Whole)(CASTOR_PASSED) : (is_at_pane ? (Whole)(CASTOR_STOPPED) : state), passed + place);
}
