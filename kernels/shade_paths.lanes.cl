// CASTOR_LANES paths a work-item (see lanes.cl). One bounce of traced paths, after their rays and surfaces are found:
//
// - takes from paths what the solids in which their rays were have absorbed
// - adds to the sums of their slots the light that their rays met: what surfaces emit, environments, disks of suns, and
//   for eye rays the background. Where lights are sampled too, such light counts by its weight
//   Where a picture has groups of lights, light is added to the sums of its group as well
// - chooses one light for each path, and writes a ray to a random point of it and what arrives unless the ray is
//   stopped, divided by the density of all that; a ray that hits nothing, and zero, where there is nothing
// - draws the directions in which paths go on, and which of them go on; writes their rays, and next_rank 0, or
//   CASTOR_PATH_ENDED where there is none. Of what passes a pane the ray goes on as it was, beyond the pane: the path
//   still has the origin of its ray and its density, with which a light beyond is weighed against rays to it, which
//   pass panes too (pass_panes). So paths go on through panes after their last bounce, too.
#include "castor/shared/wave_columns.h"
#include "device/film.lanes.cl"
#include "device/hits.lanes.cl"
#include "device/path_lights.lanes.cl"
#include "device/path_records.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/scatterers.lanes.cl"

// No path is sure to go on where roulette is played, so that each has an end.
#define CASTOR_LARGEST_SURVIVAL 0.95f
// Rays to lights are all sent whose light is more than this share of what the path has gathered; of weaker light in
// proportion, and so much stronger where it is sent. A fifth leaves the noise as it is; a half is worth more, since a
// third of the rays is not traced.
#define CASTOR_LEAST_SHARE 0.5f
// The probability of going on, of what a path carries. Of 1, 2 and more, and of the square root of what is carried, 2
// leaves the least variance for as many rays where light comes from a window into a white room.
#define CASTOR_SURVIVAL 2.0f

CASTOR_INLINE Mask LANES(are_black)(const LANES(Vectors) v) { return (v.x == 0.0f) & (v.y == 0.0f) & (v.z == 0.0f); }

// The points of the unit square by which paths go on from where they are: see CASTOR_DIMENSION_CHOICE.
typedef struct LANES(BouncePoints) {
    LANES(Points) choice, direction, light_point, end;
#if CASTOR_HAS_ATTRIBUTES
    LANES(Points) texel, light_texel;
#endif
} LANES(BouncePoints);

CASTOR_ONCE LANES(BouncePoints) LANES(points_of_bounce)(const RenderParams params, const uint node,
                                                        const global uint *restrict pixel_blocks, const Whole slot)
{
    const LANES(SampleNumbers) numbers = LANES(numbers_of_slots)(params, pixel_blocks, slot);
    const Whole dimension[] = {
        LANES(dimension_of_node)((Whole)(node), CASTOR_DIMENSION_CHOICE),
        LANES(dimension_of_node)((Whole)(node), CASTOR_DIMENSION_DIRECTION),
        LANES(dimension_of_node)((Whole)(node), CASTOR_DIMENSION_LIGHT_POINT),
        LANES(dimension_of_node)((Whole)(node), CASTOR_DIMENSION_END),
#if CASTOR_HAS_ATTRIBUTES
        LANES(dimension_of_node)((Whole)(node), CASTOR_DIMENSION_TEXEL),
        LANES(dimension_of_node)((Whole)(node), CASTOR_DIMENSION_LIGHT_TEXEL),
#endif
    };
    LANES(Points) point[sizeof(dimension) / sizeof(Whole)];
    LANES(sample_dimensions)
    (numbers.pixel, numbers.sample, params.seed, dimension, sizeof(dimension) / sizeof(Whole), point);
    LANES(BouncePoints) drawn;
    drawn.choice = point[0];
    drawn.direction = point[1];
    drawn.light_point = point[2];
    drawn.end = point[3];
#if CASTOR_HAS_ATTRIBUTES
    drawn.texel = point[4];
    drawn.light_texel = point[5];
#endif
    return drawn;
}

#if CASTOR_HAS_DIELECTRICS
// Returns what media with these materials leave of light after a way in them, where `counts`; else all.
CASTOR_INLINE LANES(Vectors) LANES(left_by_media)(const global Material *restrict materials, const Whole medium,
                                                  const Mask counts, const Real length)
{
    const LANES(Materials) material = LANES(load_materials)(materials, counts ? medium : (Whole)(0));
    return LANES(transmittance)(material.absorption, counts ? length : (Real)(0.0f));
}
#endif

#define CASTOR_SHADE_PATHS_PARAMETERS                                                                                  \
    const RenderParams params, const PathParams path, const global Material *restrict materials,                       \
        const global PrincipledMaterial *restrict principled_materials, const global Light *restrict lights,           \
        const global Emitter *restrict emitters, const global Instance *restrict instances,                            \
        const global Texture *restrict textures, const global TextureImage *restrict texture_images,                   \
        const global uint *restrict texels, const global uint *restrict environment_parts,                             \
        const global LightNode *restrict light_nodes, CASTOR_READ(light_groups), CASTOR_READ(emission_groups),         \
        CASTOR_READ(pixel_blocks), CASTOR_READ(path_slot), CASTOR_READ(ray_time), CASTOR_READ(ray_origin_tmin),        \
        CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_READ(surface_position),                             \
        CASTOR_READ(surface_normal), CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse),                      \
        CASTOR_READ(surface_specular), CASTOR_READ(surface_uvs), CASTOR_READ(surface_tangent),                         \
        CASTOR_READ(surface_color), CASTOR_WRITE(path_throughput), CASTOR_WRITE(path_state), CASTOR_WRITE(film_terms), \
        CASTOR_WRITE(shadow_origin_tmin), CASTOR_WRITE(shadow_direction_tmax), CASTOR_WRITE(shadow_contribution),      \
        CASTOR_WRITE(shadow_length), CASTOR_WRITE(shadow_medium), CASTOR_WRITE(shadow_outer), CASTOR_WRITE(next_slot), \
        CASTOR_WRITE(next_origin_tmin), CASTOR_WRITE(next_direction_tmax), CASTOR_WRITE(next_rank),                    \
        CASTOR_WRITE(ray_counts)
#define CASTOR_SHADE_PATHS_ARGUMENTS                                                                                 \
    params, path, materials, principled_materials, lights, emitters, instances, textures, texture_images, texels,    \
        environment_parts, light_nodes, light_groups, emission_groups, pixel_blocks, path_slot, ray_time,            \
        ray_origin_tmin, ray_direction_tmax, hits, surface_position, surface_normal, surface_material,               \
        surface_diffuse, surface_specular, surface_uvs, surface_tangent, surface_color, path_throughput, path_state, \
        film_terms, shadow_origin_tmin, shadow_direction_tmax, shadow_contribution, shadow_length, shadow_medium,    \
        shadow_outer, next_slot, next_origin_tmin, next_direction_tmax, next_rank, ray_counts

CASTOR_ONCE void LANES(shade_paths_of_item)(const uint item, CASTOR_SHADE_PATHS_PARAMETERS)
{
    const uint place = item * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Real zero = (Real)(0.0f);
    const LANES(Vectors) black = LANES(vectors)(zero, zero, zero);
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole slot = LANES(slots)(params, path_slot, place, is_path);
    LANES(PathRecords) record = LANES(path_records)(params, path, path_throughput, path_state, slot);
    LANES(Vectors) throughput = record.throughput;
    const LANES(Vectors) along = LANES(load_vectors)(ray_direction_tmax + place);
    const LANES(Vectors) direction = LANES(normalized_vectors)(along);
    const LANES(Vectors) wo = LANES(scaled_vectors)(direction, (Real)(-1.0f));
    const Whole material_number = LANES(load_whole_column)(surface_material + place);
    const Mask is_met = is_path & (material_number != CASTOR_INVALID_INDEX);
    // Lanes that met nothing have a material that another has: materials that are all the same are loaded once.
    const Whole known_number =
        is_met ? material_number : (Whole)(LANES(largest_of_lanes)(is_met ? material_number : (Whole)(0)));
    const LightColumns of_lights = {lights,
                                    emitters,
                                    instances,
                                    texture_images,
                                    texels,
                                    environment_parts,
                                    principled_materials,
                                    textures,
                                    light_nodes,
                                    params.light_count,
                                    CASTOR_HAS_LIGHT_TREE && path.light_node_count > 0,
                                    path.pixel_spread,
                                    (path.flags & CASTOR_PATH_WEIGHS) != 0};
    const Real length =
        (is_met ? LANES(load_hits)(hits + place).t : zero) * LANES(square_root)(LANES(dot_products)(along, along));
#if CASTOR_HAS_PANES
    const LANES(PathRecords) before = record;
#endif
    record.length += length;
    const LANES(Vectors) normal = LANES(load_vectors)(surface_normal + place);
#if CASTOR_HAS_DIELECTRICS
    // A solid that absorbs and is met from within did so on the way, also where nothing tells that the path was in it.
    const LANES(Vectors) own_absorption = LANES(load_materials)(materials, known_number).absorption;
    const Mask is_within = is_met & (LANES(dot_products)(normal, direction) > 0.0f) & !LANES(are_black)(own_absorption);
    const Mask absorbs = is_within | (is_met & (record.media.medium != CASTOR_INVALID_INDEX));
    if (LANES(mask_of)(absorbs)) {
        const Whole medium = is_within ? known_number : record.media.medium;
        Mask is_new = absorbs;
#if CASTOR_HAS_SCATTERING
        // What scatters has been counted, where the path was known to be in it.
        is_new &= (medium != record.media.medium) | !LANES(scatter_light)(materials, absorbs ? medium : (Whole)(0));
#endif
        throughput = LANES(product_of_vectors)(throughput, LANES(left_by_media)(materials, medium, is_new, length));
    }
#endif

    LANES(BouncePoints) drawn;  // where something is met
    if (LANES(mask_of)(is_met)) drawn = LANES(points_of_bounce)(params, path.node, pixel_blocks, slot);

    // What there is at the surfaces.
    const LANES(Vectors) position = LANES(load_vectors)(surface_position + place);
    LANES(Scatterers) scatterer;
    scatterer.normal = normal;
    scatterer.is_solid = scatterer.is_inside = scatterer.is_rough = scatterer.is_principled = (Whole)(0) != 0u;
    LANES(Vectors) emission = black;
#if CASTOR_HAS_EMISSION
    emission = LANES(load_emissions)(materials, known_number);
#endif
    Mask scatters = is_met;
    Mask is_principled = is_met;
#if CASTOR_HAS_CLASSIC
    const LANES(Materials) material = LANES(load_materials)(materials, known_number);
    is_principled &= material.kind == CASTOR_MATERIAL_PRINCIPLED;
    const Mask is_classic = is_met & (material.kind != CASTOR_MATERIAL_PRINCIPLED);
    if (LANES(mask_of)(is_classic)) {
        LANES(Materials) seen = material;
#if CASTOR_HAS_TEXTURES
        seen = LANES(textured_materials)(seen, 0u, surface_diffuse + place, surface_specular + place);
#endif
        LANES(set_classic)(&scatterer, params, path, seen, normal, wo);
    }
#endif
#if CASTOR_HAS_PRINCIPLED
    if (LANES(mask_of)(is_principled)) {
        const Whole word = LANES(principled_numbers)(materials, known_number);
        const Whole number = is_principled ? word : (Whole)(LANES(largest_of_lanes)(is_principled ? word : (Whole)(0)));
#if CASTOR_HAS_ATTRIBUTES
        const PrincipledTextures of_textures = {principled_materials, textures, texture_images, texels};
        const LANES(Rows) tangent = LANES(load_rows)(surface_tangent + place);
        const LANES(Rows) of_vertices = LANES(load_rows)(surface_color + place);
        const LANES(TexturePlaces) at =
            LANES(texture_places)(LANES(load_rows)(surface_uvs + place), tangent, of_vertices,
                                  record.length * path.pixel_spread, drawn.texel);
        LANES(PrincipledSurfaces)
        surface = LANES(principled_surfaces)(of_textures, number, is_principled, normal, tangent, wo,
                                             LANES(vectors_of_rows)(of_vertices), at);
#else
        LANES(PrincipledSurfaces) surface = LANES(plain_principled_surfaces)(principled_materials, number, normal);
#endif
        LANES(set_principled)(&scatterer, &surface, is_principled, normal, wo, throughput);
        scatters &= !(is_principled & surface.is_unlit);
        emission =
            LANES(choose_vectors)(is_principled, LANES(product_of_vectors)(emission, surface.emission), emission);
    }
#endif

    // The light that rays met.
    LANES(Vectors) sent = black;
#if CASTOR_HAS_EMISSION || CASTOR_HAS_ENVIRONMENT || CASTOR_HAS_SUNS
    // Where rays were scattered. Of eye rays, and where there is no tree, nothing but the origin is read.
    const LANES(Receivers) last = LANES(receivers)(LANES(load_vectors)(ray_origin_tmin + place),
                                                   of_lights.has_tree ? LANES(as_uint)(record.cosine) : (Whole)(0));
#endif
#if CASTOR_HAS_LIGHT_GROUPS
    Whole group = (Whole)(light_groups[params.light_count]);  // of what is no light's
#endif
    if (path.depth == 0) {
        sent = LANES(same_vectors)(params.background);
#if CASTOR_HAS_TEXTURES && CASTOR_HAS_OTHER_TEXTURES
        if (params.flags & CASTOR_RENDER_BACKGROUND_TEXTURE) sent = LANES(load_vectors)(surface_diffuse + place);
#endif
        sent = LANES(choose_vectors)(is_met, black, sent);
#if CASTOR_HAS_SCATTERING
        sent = LANES(choose_vectors)(record.length > 0.0f, black, sent);  // scattered: no eye ray any more
#endif
    }
#if CASTOR_HAS_PANES
    // An eye ray that passed panes is one still: its path has no length.
    if (path.depth > 0 && !(params.flags & CASTOR_RENDER_BACKGROUND_TEXTURE))
        sent = LANES(choose_vectors)(is_path & !is_met & (before.length == 0.0f),
                                     LANES(same_vectors)(params.background), sent);
#endif
#if CASTOR_HAS_TEXTURES && CASTOR_HAS_OTHER_TEXTURES && CASTOR_HAS_CLASSIC
    sent = LANES(choose_vectors)(is_classic & LANES(sends_texel)(surface_diffuse + place),
                                 LANES(load_vectors)(surface_diffuse + place), sent);
#endif
#if CASTOR_HAS_EMISSION
    const Mask shines = is_met & !LANES(are_black)(emission);
    if (LANES(mask_of)(shines)) {
        const Mask has_rival = shines & (record.density > 0.0f);
        Real of_light = zero;
        if (LANES(mask_of)(has_rival)) {
            const Whole light = LANES(lights_of_materials)(materials, known_number);
            of_light = LANES(densities_of_lights)(of_lights, has_rival ? light : (Whole)(CASTOR_INVALID_INDEX), last,
                                                  CASTOR_HAS_MOTION ? LANES(load_real_column)(ray_time + place) : zero,
                                                  position, normal);
        }
        const Real weight = LANES(weights_of_chance)(path.flags, record.density, of_light);
        sent = LANES(choose_vectors)(shines, LANES(scaled_vectors)(emission, weight), sent);
#if CASTOR_HAS_LIGHT_GROUPS
        group = shines ? LANES(gather_wholes)(emission_groups, known_number, 1) : group;
#endif
    }
#endif
#if CASTOR_HAS_ENVIRONMENT
    sent = LANES(choose_vectors)(is_path & !is_met, black, sent);  // environments hide the background
#endif
#if CASTOR_HAS_LIGHT_GROUPS
    LANES(add_to_groups)
    (params, place, slot, is_path, group, LANES(product_of_vectors)(throughput, sent), film_terms);
#endif
#if CASTOR_HAS_ENVIRONMENT || CASTOR_HAS_SUNS
    const Mask is_missed = is_path & !is_met;
    if (LANES(mask_of)(is_missed)) {
        LANES(Vectors) seen = sent;
        for (uint i = path.first_far; i < path.far_end; ++i) {
            LANES(Vectors) of_light = black;
#if CASTOR_HAS_ENVIRONMENT
            if (lights[i].kind == CASTOR_LIGHT_ENVIRONMENT)
                of_light = LANES(weighed_environment)(of_lights, i, path, record, last, direction);
#endif
#if CASTOR_HAS_SUNS
            if (CASTOR_IS_SUN(lights[i])) of_light = LANES(weighed_sun)(of_lights, i, path, record, last, direction);
#endif
            seen = LANES(sum_of_vectors)(seen, of_light);
#if CASTOR_HAS_LIGHT_GROUPS
            LANES(add_to_groups)
            (params, place, slot, is_missed, (Whole)(light_groups[i]), LANES(product_of_vectors)(throughput, of_light),
             film_terms);
#endif
        }
        sent = LANES(choose_vectors)(is_missed, seen, sent);
    }
#endif
    LANES(add_to_slots)(params, place, slot, is_path, LANES(product_of_vectors)(throughput, sent), film_terms);
    // After the last bounce paths still pass panes, as the rays to lights do that they are weighed against.
    const Mask scatters_more = (Whole)(path.flags & CASTOR_PATH_ENDS) == 0u;
#if !CASTOR_HAS_PANES
    if (path.flags & CASTOR_PATH_ENDS) return;
#endif

#if CASTOR_HAS_DIELECTRICS
    const LANES(Media) here = LANES(media_here)(record.media, known_number, scatterer.is_inside);
    const LANES(Media) within = LANES(media_beyond)(record.media, known_number, scatterer.is_inside);
    const LANES(Media) beyond = LANES(choose_media)(scatterer.is_solid, within, here);
#endif

    // The light of lights.
    const Real epsilon = (Real)(params.shadow_epsilon);
    LANES(PathRays) shadow = LANES(dead_rays)();
    LANES(Vectors) contribution = black;
    Real group_of_contribution = zero;
    const Mask is_rough = scatters & scatterer.is_rough & scatters_more;
    const Whole facing =
        of_lights.has_tree ? LANES(packed_normals)(scatterer.normal, LANES(has_both_sides)(&scatterer)) : (Whole)(0);
    if (params.light_count > 0 && (path.flags & CASTOR_PATH_LIGHTS) && LANES(mask_of)(is_rough)) {
        const LANES(Vectors) origin = LANES(points_on_rays)(position, epsilon, scatterer.normal);
        LANES(Points) at = drawn.light_point;
        LANES(ChosenLights) chosen;
        chosen.probability = (Real)(1.0f);
        Real rest = drawn.choice.y;
        if (CASTOR_HAS_LIGHT_TREE && of_lights.has_tree) {
            chosen = LANES(walk_light_tree)(light_nodes, LANES(receivers)(origin, facing), is_rough, 1, (Whole)(0), at);
            at.x = chosen.rest;
        } else {
            const Real place = drawn.choice.y * (float)params.light_count;
            chosen.number = min(LANES(convert_uint)(place), (Whole)(params.light_count - 1u));
            rest = LANES(smaller)(place - LANES(convert_float)(chosen.number), (Real)(0x1.fffffep-1f));
        }
#if CASTOR_HAS_LIGHT_GROUPS
        const Whole known_light = is_rough ? chosen.number : (Whole)(0);
        group_of_contribution = LANES(convert_float)(LANES(gather_wholes)(light_groups, known_light, 1));
#endif
        LANES(LightQueries) query;
        query.origin = origin;
        query.normal = scatterer.normal;
        query.has_both_sides = LANES(has_both_sides)(&scatterer);
        query.choice = rest;
        query.time = CASTOR_HAS_MOTION ? LANES(load_real_column)(ray_time + place) : zero;
        query.at = at;
        query.length = record.length;
        query.texel = query.at;
#if CASTOR_HAS_ATTRIBUTES
        query.texel = drawn.light_texel;
#endif
        const LANES(LightRays) to_light = LANES(sample_lights)(of_lights, chosen.number, is_rough, query);
        const LANES(ScatteredLight) scattered = LANES(scattered_light)(&scatterer, to_light.sample.wi, is_rough);
        // Rays meet the light, too: then both ways share what it gives.
        const Mask has_rival = to_light.sample.density > 0.0f;
        const Real own = of_lights.has_tree ? to_light.sample.density * chosen.probability
                                            : LANES(divide)(to_light.sample.density, (Real)((float)params.light_count));
        const Real rarity =
            of_lights.has_tree ? LANES(inverse_or_zero)(chosen.probability) : (Real)((float)params.light_count);
        const Real weight = (path.flags & CASTOR_PATH_WEIGHS) && LANES(mask_of)(has_rival)
                                ? (has_rival ? LANES(balance)(own, scattered.density) : (Real)(1.0f))
                                : (Real)(1.0f);
        const LANES(Vectors) arriving =
            LANES(product_of_vectors)(throughput, LANES(scaled_vectors)(to_light.sample.irradiance, weight * rarity));
        contribution =
            LANES(choose_vectors)(is_rough, LANES(product_of_vectors)(arriving, scattered.value), contribution);
        // What lights the other side passes the surface.
        const Mask is_behind = LANES(dot_products)(scatterer.normal, to_light.sample.wi) < 0.0f;
#if CASTOR_HAS_DIELECTRICS
        // No ray from within a closed solid reaches a light that is far away, if it does not pass the surface.
        const LANES(Media) media = LANES(choose_media)(is_behind, beyond, here);
        const Whole medium = media.medium;
        Mask absorbs = is_rough & !to_light.is_far & (medium != CASTOR_INVALID_INDEX);
#if CASTOR_HAS_MATCHED_SOLIDS
        // What is left on the way of rays that pass solids is found there.
        absorbs &= has_rival;
        LANES(store_whole_column)(has_rival ? (Whole)(CASTOR_STOPPED_BY_SOLIDS) : medium, shadow_medium + place);
        LANES(store_whole_column)(media.outer, shadow_outer + place);
#endif
        if (LANES(mask_of)(absorbs))
            contribution = LANES(product_of_vectors)(
                contribution, LANES(left_by_media)(materials, medium, absorbs, to_light.sample.distance));
#endif
        if (path.flags & CASTOR_PATH_LIGHT_ROULETTE) {
            const LANES(Vectors) gathered = LANES(slot_sums)(params, place, slot, film_terms);
            const Real least = CASTOR_LEAST_SHARE * LANES(largest_of)(gathered), size = LANES(largest_of)(contribution);
            const Mask is_weak = is_rough & (size < least) & (least <= FLT_MAX);
            const Real chance = is_weak ? LANES(divide)(size, is_weak ? least : (Real)(1.0f)) : (Real)(1.0f);
            const Mask is_sent = drawn.end.y < chance;
            const Real rarer = LANES(divide)((Real)(1.0f), is_sent & is_weak ? chance : (Real)(1.0f));
            contribution = LANES(choose_vectors)(is_sent, LANES(scaled_vectors)(contribution, rarer), black);
        }
        const Mask is_lit = !LANES(are_black)(contribution);
        const LANES(Vectors) other_side = LANES(points_on_rays)(position, -epsilon, scatterer.normal);
        LANES(PathRays) ray;
        ray.origin = LANES(choose_vectors)(is_behind, other_side, origin);
        ray.t_min = (Real)(CASTOR_SMALLEST_T);
        ray.direction =
            LANES(choose_vectors)(is_behind & !to_light.is_far,
                                  LANES(difference_of_vectors)(to_light.sample.point, other_side), to_light.direction);
        ray.t_max = to_light.t_max;
        shadow = LANES(choose_rays)(is_lit, ray, shadow);
        ray_counts[item] += popcount(LANES(mask_of)(is_lit));
    }
    LANES(store_path_rays)(shadow, shadow_origin_tmin + place, shadow_direction_tmax + place);
#if CASTOR_HAS_PANES
    LANES(store_real_column)(record.length, shadow_length + place);
#endif
    LANES(store_rows)
    (contribution.x, contribution.y, contribution.z, group_of_contribution, shadow_contribution + place);

    // Where paths go on.
    Mask goes_on = scatters;
    if (LANES(mask_of)(goes_on)) {
        LANES(ScatteredRays)
        next = LANES(sample_scattering)(&scatterer, drawn.choice.x, drawn.direction, scatters);
#if CASTOR_HAS_PANES
        // The next surface absorbs along the whole ray.
        next.density = next.is_passed ? before.density : next.density;
        goes_on &= next.is_passed | scatters_more;
        throughput = LANES(choose_vectors)(next.is_passed, before.throughput, throughput);
#endif
        throughput = LANES(product_of_vectors)(throughput, next.weight);
        const Real largest = LANES(largest_of)(throughput);
        goes_on &= (largest > 0.0f) & (largest <= FLT_MAX);
        // Light that rays meet after the last bounce counts only where no sample of the light has counted.
        const uint sampling = path.flags & (CASTOR_PATH_LAST | CASTOR_PATH_LIGHTS | CASTOR_PATH_WEIGHS);
        if (sampling == (CASTOR_PATH_LAST | CASTOR_PATH_LIGHTS)) goes_on &= next.density == 0.0f;
        if (path.flags & CASTOR_PATH_ROULETTE) {
            const Real survival =
                LANES(smaller)(goes_on ? CASTOR_SURVIVAL * largest : (Real)(1.0f), (Real)(CASTOR_LARGEST_SURVIVAL));
            goes_on &= drawn.end.x < survival;
            throughput = LANES(scaled_vectors)(throughput, LANES(divide)((Real)(1.0f), survival));
        }
        if (LANES(mask_of)(goes_on)) {
            LANES(PathRays) ray;
            ray.origin = LANES(points_on_rays)(position, next.is_transmitted ? -epsilon : epsilon, scatterer.normal);
            ray.t_min = (Real)(CASTOR_SMALLEST_T);
            ray.direction = next.direction;
            ray.t_max = (Real)(INFINITY);
#if CASTOR_HAS_PANES
            if (LANES(mask_of)(next.is_passed)) {
                const Real t = LANES(load_hits)(hits + place).t;
                ray.origin =
                    LANES(choose_vectors)(next.is_passed, LANES(load_vectors)(ray_origin_tmin + place), ray.origin);
                ray.direction = LANES(choose_vectors)(next.is_passed, along, ray.direction);
                ray.t_min = next.is_passed ? LANES(as_float)(LANES(as_uint)(t) + CASTOR_FLOATS_BEYOND) : ray.t_min;
            }
#endif
            LANES(store_path_rays)(ray, next_origin_tmin + place, next_direction_tmax + place);
            LANES(store_whole_column)(slot, next_slot + place);
            record.throughput = throughput;
            record.density = next.density;
            record.cosine =
                of_lights.has_tree ? LANES(as_float)(facing) : LANES(dot_products)(scatterer.normal, next.direction);
#if CASTOR_HAS_DIELECTRICS
            record.media = LANES(choose_media)(next.is_transmitted, beyond, here);
#endif
#if CASTOR_HAS_PANES
            record.cosine = next.is_passed ? before.cosine : record.cosine;
            record.length = next.is_passed ? before.length : record.length;
#endif
            LANES(store_path_records)(record, slot, goes_on, path_throughput, path_state);
            ray_counts[item] += popcount(LANES(mask_of)(goes_on));
        }
    }
    LANES(store_bytes)(goes_on ? (Whole)(0) : (Whole)(CASTOR_PATH_ENDED), next_rank + place);
}

kernel CASTOR_IN_LANES void LANES(shade_paths)(CASTOR_SHADE_PATHS_PARAMETERS)
{
    LANES(shade_paths_of_item)(get_global_id(0), CASTOR_SHADE_PATHS_ARGUMENTS);
}
