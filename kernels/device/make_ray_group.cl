// Makes the rays of a group ready, and writes their answers.
#include "castor/shared/layout.h"
#include "device/add_rays.x16.cl"
#include "device/add_rays.x8.cl"
#include "device/hits.x16.cl"
#include "device/instances.cl"
#include "device/ray_group.cl"
#include "device/simd.cl"
#include "device/store_rays.x1.cl"

CASTOR_INLINE Hit best_of_ray(const RayGroup *group, const uint place)
{
    Hit best;
    best.t = group->best_t[place];
    best.u = group->best_u[place];
    best.v = group->best_v[place];
    best.primitive = group->best_primitive[place];
#if CASTOR_HAS_INSTANCES
    best.instance = group->best_instance[place];
#else
    best.instance = 0;
#endif
    return best;
}

CASTOR_INLINE void set_best_of_ray(RayGroup *group, const uint place, const Hit best)
{
    group->best_t[place] = best.t;
    group->best_u[place] = best.u;
    group->best_v[place] = best.v;
    group->best_primitive[place] = best.primitive;
#if CASTOR_HAS_INSTANCES
    group->best_instance[place] = best.instance;
#endif
}

CASTOR_INLINE int has_hit(const RayGroup *group, const uint place)
{
    return group->best_primitive[place] != CASTOR_INVALID_INDEX;
}

// Returns the rays that have a hit, as bits.
CASTOR_INLINE uint rays_with_hit(const RayGroup *group)
{
    return mask_of16(vload16(0, group->best_primitive) != CASTOR_INVALID_INDEX);
}

// Returns the rays that no hit has ended yet, as bits.
CASTOR_INLINE uint unended_rays(const RayGroup *group, const int wants_any)
{
    uint unended = group->valid;
    if (!wants_any) return unended;
    for (uint place = 0; place < CASTOR_GROUP_RAYS; ++place)
        if (has_hit(group, place)) unended &= ~(1u << place);
    return unended;
}

// Returns the rays that have to traverse the tree, as bits.
CASTOR_INLINE uint undecided_rays(const RayGroup *group, const int wants_any)
{
    return CASTOR_HAS_PLANES || CASTOR_HAS_CHUNKS ? unended_rays(group, wants_any) : group->valid;
}

CASTOR_INLINE float least_float_of_8(const float8 v)
{
    const float4 four = v.lo < v.hi ? v.lo : v.hi;
    return smaller(smaller(four.x, four.y), smaller(four.z, four.w));
}

// Returns the box around a node's children.
CASTOR_INLINE Bounds bounds_of_node(const global WideNode *node)
{
    const global float8 *planes = (const global float8 *)node->planes;
    Bounds bounds;
    bounds.lower = (float3)(least_float_of_8(planes[0]), least_float_of_8(planes[2]), least_float_of_8(planes[4]));
    bounds.upper = -(float3)(least_float_of_8(-planes[1]), least_float_of_8(-planes[3]), least_float_of_8(-planes[5]));
    return bounds;
}

// Returns the bounds for make_ray_group, where it asks for them.
CASTOR_INLINE Bounds bounds_of_scene(const SceneColumns scene)
{
    if (CASTOR_ALL_IS_BOUNDED && scene.params.wide_root != CASTOR_INVALID_INDEX)
        return bounds_of_node(scene.wide_nodes + scene.params.wide_root);
    const Bounds nothing = {(float3)(INFINITY), (float3)(-INFINITY)};
    return nothing;
}

// Makes rays [begin, end) of the columns ready, at most 16, and tests them against the scene's planes. Where earlier
// chunks have written answers, a ray reaches no farther than its answer, and one that is occluded already has a hit.
CASTOR_NOINLINE void make_ray_group(RayGroup *group, const SceneColumns scene, const Bounds bounds, const uint begin,
                                    const uint end, const int wants_any, const global float4 *restrict ray_origin_tmin,
                                    const global float4 *restrict ray_direction_tmax, const global Hit *hits,
                                    const global uchar *occluded)
{
    group->valid = 0;
    if (CASTOR_REGISTERS_OF_16) {
        add_rays16(group, 0, scene.params, bounds, begin, end, ray_origin_tmin, ray_direction_tmax);
    } else {
        add_rays8(group, 0, scene.params, bounds, begin, end, ray_origin_tmin, ray_direction_tmax);
        add_rays8(group, 8, scene.params, bounds, begin + 8, end, ray_origin_tmin, ray_direction_tmax);
    }
    if (goes_on(scene) && wants_any) {
        for (uint place = 0; place < CASTOR_GROUP_RAYS && begin + place < end; ++place)
            if (occluded[begin + place]) group->best_primitive[place] = 0;
    } else if (goes_on(scene)) {
        for (uint mask = group->valid; mask; mask &= mask - 1) {
            const uint place = lowest_bit(mask);
            group->best_t[place] = search_limit(scene, group->best_t[place], hits + begin + place);
        }
    }
    if (!CASTOR_HAS_PLANES) return;
    for (uint mask = undecided_rays(group, wants_any); mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        const TraceRay ray = load_ray(scene.params, begin + place, ray_origin_tmin, ray_direction_tmax);
        set_best_of_ray(group, place, nearest_plane(scene, ray, no_hit_yet(group->best_t[place])));
    }
}

#if !CASTOR_HAS_INSTANCES && !CASTOR_ANSWERS_GO_ON
// Returns what finished_hit does, for all rays of a group.
CASTOR_INLINE Hits16 finished_hits(const RayGroup *group)
{
    Hits16 hit;
    hit.primitive = vload16(0, group->best_primitive);
    const int16 is_hit = hit.primitive != CASTOR_INVALID_INDEX;
    hit.t = is_hit ? vload16(0, group->best_t) * vload16(0, group->t_scale) : (float16)(INFINITY);
    hit.u = is_hit ? vload16(0, group->best_u) : (float16)(0.0f);
    hit.v = is_hit ? vload16(0, group->best_v) : (float16)(0.0f);
    hit.instance = is_hit ? (uint16)(0) : (uint16)(CASTOR_INVALID_INDEX);
    return hit;
}
#endif

// Writes the answers of rays [begin, end), which the group holds.
CASTOR_NOINLINE void write_answers(const RayGroup *group, const SceneColumns scene, const uint begin, const uint end,
                                   const int wants_any, global Hit *hits, global uchar *occluded)
{
    const int is_in_vectors = CASTOR_REGISTERS_OF_16 && end - begin == CASTOR_GROUP_RAYS;
    if (is_in_vectors && wants_any) {
        const uint16 primitive = vload16(0, group->best_primitive);
        vstore16(convert_uchar16(primitive != CASTOR_INVALID_INDEX ? (uint16)(1) : (uint16)(0)), 0, occluded + begin);
        return;
    }
#if !CASTOR_HAS_INSTANCES && !CASTOR_ANSWERS_GO_ON
    if (is_in_vectors) {
        store_hits16(finished_hits(group), hits + begin);
        return;
    }
#endif
    for (uint place = 0; begin + place < end; ++place) {
        if (wants_any)
            occluded[begin + place] = (uchar)has_hit(group, place);
        else
            hits[begin + place] =
                finished_hit(scene, group->t_scale[place], best_of_ray(group, place), hits + begin + place);
    }
}
