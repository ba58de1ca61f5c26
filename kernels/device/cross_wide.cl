// Traverses the 8-wide tree for all crossings of rays, one after the other: eight boxes at once, then four triangles or
// spheres.
#include "castor/shared/layout.h"
#include "device/crossings.cl"
#include "device/crossings.x4.cl"
#include "device/traverse_wide.cl"

// Adds the hits that are accepted.
CASTOR_INLINE void add_block_hits(Crossings *crossings, const SceneColumns scene, const PrimitiveHits4 hits,
                                  const global uint *primitives, const uint leaves)
{
    uint mask = mask_of4(hits.accepted);
    if (!mask) return;
    float t[4], u[4], v[4], determinant[4];
    vstore4(hits.t, 0, t);
    vstore4(hits.u, 0, u);
    vstore4(hits.v, 0, v);
    vstore4(hits.determinant, 0, determinant);
    for (; mask; mask &= mask - 1) {
        const uint i = lowest_bit(mask);
        const Candidate candidate = lane_candidate(t[i], u[i], v[i], determinant[i]);
        if (!is_culled(scene, primitives[i], candidate))
            add_crossing_of_tree(crossings, scene, candidate, primitives[i], leaves);
    }
}

CASTOR_INLINE void cross_triangle_block(Crossings *crossings, const RayGroup *group, const uint place,
                                        const SceneColumns scene, const global TriangleBlock *block)
{
    const RelativeTriangle4 sheared = sheared_block(group, place, block);
    if (!mask_of4(may_hit_triangle4(sheared))) return;
    TriangleWeights4 weights = triangle_weights4(sheared);
    if (!mask_of4(weights.inside)) return;
    weights.inside &= crosses_triangle4(sheared);
    add_block_hits(crossings, scene, hits_of_block(group, place, block, sheared, weights), block->primitive, 0);
}

#if CASTOR_HAS_SPHERES
CASTOR_INLINE void cross_sphere_block(Crossings *crossings, const RayGroup *group, const uint place,
                                      const SceneColumns scene, const global SphereBlock *block)
{
    const Spheres4 spheres = spheres_of_block(block);
    const BoxPlanes4 planes = planes_of_spheres4(slabs_of_group4(group, place), spheres);
    const int4 possible = may_hit_spheres(group, place, spheres, planes);
    if (!mask_of4(possible)) return;
    const SphereRoots4 roots = sphere_roots4(sphere_ray_of_group4(group, place), spheres);
    for (uint leaves = 0; leaves < 2; ++leaves) {
        PrimitiveHits4 hits = sphere_crossings4(roots, leaves);
        hits.accepted &= possible;
        add_block_hits(crossings, scene, within_own_boxes(group, place, planes, hits), block->primitive, leaves);
    }
}
#endif

CASTOR_INLINE void cross_leaf(Crossings *crossings, const RayGroup *group, const uint place, const SceneColumns scene,
                              const uint leaf)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) {
        for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
            CASTOR_COUNT(scene, SPHERE_BLOCK);
            cross_sphere_block(crossings, group, place, scene, scene.sphere_blocks + i);
        }
        return;
    }
#endif
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        CASTOR_COUNT(scene, TRIANGLE_BLOCK);
        cross_triangle_block(crossings, group, place, scene, scene.triangle_blocks + i);
    }
}

// Adds the crossings within the tree of root `root` by the ray at `place`.
CASTOR_INLINE void cross_tree_wide(Crossings *crossings, RayGroup *group, const uint place, const SceneColumns scene,
                                   const uint instance, const uint root)
{
    WaitingStack waiting;
    Lane lane;
    crossings->instance = instance;
    begin_tree(crossings, group->t_max[place]);
    do {
        group->best_t[place] = crossings->t_limit;
        begin_lane(&lane, &waiting, group, place, root);
        while (lane.current != CASTOR_INVALID_INDEX) {
            if (lane.current & CASTOR_WIDE_LEAF) {
                cross_leaf(crossings, group, place, scene, lane.current);
                group->best_t[place] = crossings->t_limit;
                take_next(&lane, &waiting);
            } else {
                CASTOR_COUNT(scene, NODE);
                step_at_node(&lane, scene.wide_nodes + lane.current, 0, &waiting);
            }
        }
    } while (end_traversal(crossings, scene, group->t_max[place]));
}

// Adds the crossings of a chunk.
CASTOR_INLINE void cross_wide(Crossings *crossings, const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return;
    RayGroup group;
    const uint place = 0;
    cross_planes(crossings, scene, ray);
    if (scene.params.wide_root != CASTOR_INVALID_INDEX) {
        store_rays(&group, place, ray);
        cross_tree_wide(crossings, &group, place, scene, 0, scene.params.wide_root);
    }
#if CASTOR_HAS_INSTANCES
    InstanceWalk walk;
    begin_instance_walk(&walk, scene, ray, ray.t_max);
    for (uint i; (i = next_instance(&walk, scene, ray.t_max)) != CASTOR_INVALID_INDEX;) {
        const uint geometry = scene.instances[i].geometry;
        const TraceRay object =
            make_object_ray(ray, scene.instances + i, scene.geometries[geometry].largest_coordinate);
        if (!object.valid) continue;
        store_rays(&group, place, object);
        cross_tree_wide(crossings, &group, place, scene, i, scene.wide_roots[geometry]);
    }
#endif
}

// Finds the crossings of rays [begin, end) of the columns. `limit` 0 (a constant): they are counted alone, and there
// are no `crossings`.
CASTOR_NOINLINE void cross_batch(const SceneColumns scene, const uint begin, const uint end, const uint limit,
                                 const global float4 *restrict ray_origin_tmin,
                                 const global float4 *restrict ray_direction_tmax, global Hit *restrict crossings,
                                 global uint *restrict crossing_counts)
{
    for (uint i = begin; i < end; ++i) {
        const TraceRay ray = load_ray(scene.params, i, ray_origin_tmin, ray_direction_tmax);
        Crossings found = begin_crossings(scene, ray, limit, crossings + (size_t)i * limit, crossing_counts + i);
        cross_wide(&found, scene, ray);
        if (limit > 0) finish_list(&found, scene);
        crossing_counts[i] = found.count;
    }
}
