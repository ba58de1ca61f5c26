// Traverses the upper part of the 8-wide tree for a group of 16 rays that go in different directions: each box, and
// each triangle or sphere, is tested against all of them. What few rays enter is deferred: each of them goes on there
// alone.
//
// That pays where a register holds something of all sixteen rays, and where most boxes are entered by more than a few
// of them: in small scenes, in rooms with little in them, and for rays that were meant to be a bundle but have parted.
#include "castor/shared/layout.h"
#include "device/object_rays.cl"
#include "device/traverse_wide.cl"

// Tests a leaf against the rays of the group.
CASTOR_INLINE void visit_leaf_by_group(RayGroup *group, const SceneColumns scene, const uint leaf)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) {
        for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
            const global SphereBlock *block = scene.sphere_blocks + i;
            for (uint place = 0; place < 4 && block->primitive[place] != CASTOR_INVALID_INDEX; ++place)
                visit_sphere_by_group(group, scene, block, place);
        }
        return;
    }
#endif
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        const global TriangleBlock *block = scene.triangle_blocks + i;
        for (uint place = 0; place < 4 && block->primitive[place] != CASTOR_INVALID_INDEX; ++place)
            visit_triangle_by_group(group, scene, block, place);
    }
}

#if CASTOR_REGISTERS_OF_16
// With no more rays than these that enter a child, each of them goes on alone: diffuse rays are faster by .01 than with
// 4 and 3, or with 6 and 5 (Intel Emerald Rapids).
#ifndef CASTOR_DIVERGENT_FEW_AT_NODE
#define CASTOR_DIVERGENT_FEW_AT_NODE 5
#endif
#ifndef CASTOR_DIVERGENT_FEW_AT_LEAF
#define CASTOR_DIVERGENT_FEW_AT_LEAF 4
#endif
// The same for instances: to enter one together costs what seven rays pay who enter alone.
#ifndef CASTOR_DIVERGENT_FEW_AT_INSTANCE
#define CASTOR_DIVERGENT_FEW_AT_INSTANCE 7
#endif

// Returns the sum of the components where `counts` is all ones.
CASTOR_INLINE float sum_of_some_8(const float8 v, const int8 counts)
{
    const float8 some = counts ? v : (float8)(0.0f);
    const float4 four = some.lo + some.hi;
    return (four.x + four.y) + (four.z + four.w);
}

// Tells whether rays meet leaves among a node's children about as often as others, by the surfaces of their boxes, as
// in rooms with little in them.
CASTOR_INLINE int is_mostly_leaves(const global WideNode *node)
{
    const global float8 *planes = (const global float8 *)node->planes;
    const float8 dx = planes[1] - planes[0], dy = planes[3] - planes[2], dz = planes[5] - planes[4];
    const float8 half_area = dx * dy + dy * dz + dz * dx;
    const uint8 child = *(const global uint8 *)node->child;
    const int8 is_leaf = (child >= CASTOR_WIDE_LEAF) & (child != CASTOR_INVALID_INDEX);
    return sum_of_some_8(half_area, is_leaf) > 0.7f * sum_of_some_8(half_area, child < CASTOR_WIDE_LEAF);
}

// Rays of a group begin near each other, as those do that leave a surface, where their origins are no farther apart
// than this share of the scene.
#ifndef CASTOR_DIVERGENT_SPREAD
#define CASTOR_DIVERGENT_SPREAD 0.125f
#endif

// Returns how far apart the origins of a group's rays may be for these to be traversed together, along each axis.
// Rays that begin anywhere have little in common unless most of them meet the same leaves.
CASTOR_INLINE float greatest_spread(const SceneColumns scene)
{
    if (scene.params.wide_root == CASTOR_INVALID_INDEX) return -1.0f;
    const global WideNode *root = scene.wide_nodes + scene.params.wide_root;
    if (scene.params.triangle_count + scene.params.sphere_count <= CASTOR_SMALL_SCENE || is_mostly_leaves(root))
        return INFINITY;
    const Bounds bounds = bounds_of_node(root);
    const float3 extent = bounds.upper - bounds.lower;
    return CASTOR_DIVERGENT_SPREAD * larger(extent.x, larger(extent.y, extent.z));
}

#if CASTOR_HAS_INSTANCES
// The same share for the tree over instances.
#ifndef CASTOR_DIVERGENT_SPREAD_OF_INSTANCES
#define CASTOR_DIVERGENT_SPREAD_OF_INSTANCES 0.0625f
#endif

// Returns what greatest_spread does, for the tree over instances.
CASTOR_INLINE float greatest_spread_of_instances(const SceneColumns scene)
{
    const Bounds bounds = bounds_of_node(scene.wide_instance_nodes);
    const float3 extent = bounds.upper - bounds.lower;
    return CASTOR_DIVERGENT_SPREAD_OF_INSTANCES * larger(extent.x, larger(extent.y, extent.z));
}
#endif

// Returns about how far apart rays [begin, end) of the columns, at least one, begin along any axis: by four of them.
CASTOR_INLINE float spread_of_rays(const TraceParams params, const uint begin, const uint end,
                                   const global float4 *restrict ray_origin_tmin)
{
    const global float4 *const origin = ray_origin_tmin + (size_t)begin * params.ray_stride;
    float spread = 0.0f;
    for (uint i = 1; i < 4; ++i) {
        const float4 apart = fabs(origin[(size_t)((end - begin - 1) * i / 3) * params.ray_stride] - origin[0]);
        spread = larger(spread, larger(apart.x, larger(apart.y, apart.z)));
    }
    return spread;
}

// The children that a group has yet to visit, and when each of its rays enters them; INFINITY: never.
typedef struct WaitingGroups {
    float entry[CASTOR_WAITING][CASTOR_GROUP_RAYS];
    uint child[CASTOR_WAITING];
} __attribute__((aligned(64))) WaitingGroups;

// Pushes the children of a node that rays of the group enter no later than their best hits, the one to visit first
// last. Returns the number of all that wait.
CASTOR_INLINE uint push_children_of_group(WaitingGroups *groups, uint count, const RayGroup *group, const int16 counts,
                                          const SceneColumns scene, const global WideNode *node, const int wants_any)
{
    float entry[8][CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
    float16 e[8];
    for (uint place = 0; place < 8; ++place) {
        CASTOR_COUNT(scene, BUNDLE_BOX);
        const Interval16 interval = group_interval_in_child(group, node, place);
        const int16 enters = counts & (interval.entry <= interval.exit);
        e[place] = enters ? interval.entry : (float16)(INFINITY);
        store_reals16(e[place], entry[place]);
    }
    const float8 least = (float8)(least_of_four_16(e[0], e[1], e[2], e[3]), least_of_four_16(e[4], e[5], e[6], e[7]));
    const int8 entered = least < INFINITY;
    const uint8 sorted = sorted_keys(entered, keys_of_children(least), wants_any);
    vstore8(permute_8(*(const global uint8 *)node->child, sorted), 0, groups->child + count);
    uint places[8];
    vstore8(sorted & CASTOR_KEY_PLACE, 0, places);
    const uint end = count + popcount(mask_of8(entered));
    for (uint i = 0; count < end; ++count, ++i) store_reals16(vload16(0, entry[places[i]]), groups->entry[count]);
    return end;
}

// Traverses what rays of the group, given as bits, have deferred.
CASTOR_INLINE void trace_deferred(RayGroup *group, const SceneColumns *scene, uint rays, const int over_instances,
                                  const int wants_any, const DeferredChildren *deferred, WaitingStack *waiting)
{
    ushort places[CASTOR_GROUP_RAYS];
    uint count = 0;
    for (; rays; rays &= rays - 1) places[count++] = (ushort)lowest_bit(rays);
    trace_lanes(scene, group, places, count, over_instances, 0, wants_any, deferred, waiting);
}

// Adds a child that some rays enter, given as bits, to those deferred. Returns whether the list is full.
CASTOR_INLINE int defer(DeferredChildren *deferred, uint16 *of_ray, uint *count, const uint child, const float16 entry,
                        const uint entering)
{
    store_reals16(entry, deferred->entry[*count]);
    deferred->child[*count] = child;
    *of_ray |= as_uint16(lanes_of_mask16(entering)) & (1u << *count);
    return ++*count == CASTOR_MAX_DEFERRED;
}

// Leaves the other rays than these, given as bits, no range in which there could be a hit.
CASTOR_INLINE void keep_only(RayGroup *group, const uint mask)
{
    if (mask == 0xffffu) return;
    const int16 counts = lanes_of_mask16(mask);
    store_reals16(counts ? vload16(0, group->t_min) : (float16)(INFINITY), group->t_min);
    store_reals16(counts ? vload16(0, group->best_t) : (float16)(-INFINITY), group->best_t);
}

// Ends the search of rays for any hit that have one.
CASTOR_INLINE void end_decided(RayGroup *group)
{
    const int16 is_decided = vload16(0, group->best_primitive) != CASTOR_INVALID_INDEX;
    store_reals16(is_decided ? (float16)(-INFINITY) : vload16(0, group->best_t), group->best_t);
}

// Traverses the tree from node `root` on for rays of a group, given as bits, as far as many of them enter the same
// children; `over_instances` as for trace_lanes. Returns the rays that have deferred others, as bits: what these have
// hit need not be their nearest hit. Rays that enter an instance together go on in its space, with what waits in the
// world below on the same stack; what they defer there is finished before they leave it.
CASTOR_NOINLINE uint trace_together(RayGroup *group, const SceneColumns *scene_columns, const uint mask,
                                    const int over_instances, const uint root, const int wants_any,
                                    DeferredChildren *deferred, WaitingStack *waiting)
{
    const SceneColumns scene = *scene_columns;
    WaitingGroups groups;
    uint16 of_ray = (uint16)(0);
    uint deferred_count = 0;
    keep_only(group, mask);
    RayGroup *rays = group;
    DeferredChildren *list = deferred;
    const global WideNode *nodes = scene.wide_nodes;
#if CASTOR_HAS_INSTANCES
    if (over_instances) nodes = scene.wide_instance_nodes;
    RayGroup objects __attribute__((aligned(64)));
    DeferredChildren in_instance;
    uint instance = 0;
    uint16 of_world_ray = (uint16)(0);
    uint world_count = 0;
#endif
    uint count = push_children_of_group(&groups, 0, rays, lanes_of_mask16(mask), scene, nodes + root, wants_any);
    while (count > 0) {
        --count;
        const uint child = groups.child[count];
#if CASTOR_HAS_INSTANCES
        if (child == CASTOR_INVALID_INDEX) {  // all of the instance is done, but for what is deferred
            if (deferred_count) {
                store_wholes16(of_ray, list->of_ray);
                trace_deferred(&objects, scene_columns, mask_of16(of_ray != 0u), 0, wants_any, list, waiting);
            }
            take_hits_of_instance(group, &objects, instance);
            if (wants_any) end_decided(group);
            rays = group;
            list = deferred;
            nodes = scene.wide_instance_nodes;
            of_ray = of_world_ray;
            deferred_count = world_count;
            continue;
        }
        const int is_in_world = over_instances && rays == group;
#else
        const int is_in_world = 0;
#endif
        const float16 entry = vload16(0, groups.entry[count]);
        uint entering = mask_of16(entry <= vload16(0, rays->best_t));
        if (!entering) continue;
        const int is_node = !(child & CASTOR_WIDE_LEAF);
        if (is_node && popcount(entering) > CASTOR_DIVERGENT_FEW_AT_NODE) {
            count = push_children_of_group(&groups, count, rays, lanes_of_mask16(entering), scene, nodes + child,
                                           wants_any);
            continue;
        }
        const int is_instance_of_few = is_in_world & (popcount(entering) <= CASTOR_DIVERGENT_FEW_AT_INSTANCE);
        if (is_node | is_instance_of_few) {
            if (!defer(list, &of_ray, &deferred_count, child, entry, entering)) continue;
            store_wholes16(of_ray, list->of_ray);
            trace_deferred(rays, scene_columns, mask_of16(of_ray != 0u), is_in_world, wants_any, list, waiting);
            of_ray = (uint16)(0);
            deferred_count = 0;
#if CASTOR_HAS_INSTANCES
        } else if (is_in_world) {
            if (!make_object_rays(&objects, group, scene, entering, child & ~CASTOR_WIDE_LEAF)) continue;
            instance = child & ~CASTOR_WIDE_LEAF;
            keep_only(&objects, objects.valid);
            of_world_ray = of_ray;
            world_count = deferred_count;
            of_ray = (uint16)(0);
            deferred_count = 0;
            list = &in_instance;
            rays = &objects;
            nodes = scene.wide_nodes;
            groups.child[count++] = CASTOR_INVALID_INDEX;
            count = push_children_of_group(&groups, count, rays, lanes_of_mask16(objects.valid), scene,
                                           nodes + scene.wide_roots[scene.instances[instance].geometry], wants_any);
            continue;
#endif
        } else if (popcount(entering) > CASTOR_DIVERGENT_FEW_AT_LEAF) {
            visit_leaf_by_group(rays, scene, child);
        } else {
            for (; entering; entering &= entering - 1) visit_leaf(rays, lowest_bit(entering), scene, child);
        }
        if (wants_any) end_decided(rays);
    }
    store_wholes16(of_ray, deferred->of_ray);
    const uint deferring = mask_of16(of_ray != 0u);
    return wants_any ? deferring & unended_rays(group, wants_any) : deferring;
}

// Leaves all of the tree from node `root` on to each ray of a group.
CASTOR_INLINE void defer_root(DeferredChildren *deferred, const uint root)
{
    store_reals16((float16)(-INFINITY), deferred->entry[0]);
    store_wholes16((uint16)(1), deferred->of_ray);
    deferred->child[0] = root;
}

// Traverses the tree from node `root` on for rays of a group, given as bits, that go in different directions.
CASTOR_INLINE void trace_divergent(RayGroup *group, const SceneColumns *scene, const uint mask, const uint root,
                                   const int wants_any, WaitingStack *waiting)
{
    DeferredChildren deferred;
    const uint left = trace_together(group, scene, mask, 0, root, wants_any, &deferred, waiting);
    trace_deferred(group, scene, left, 0, wants_any, &deferred, waiting);
}
#else
CASTOR_INLINE void trace_divergent(RayGroup *group, const SceneColumns *scene, const uint mask, const uint root,
                                   const int wants_any, WaitingStack *waiting)
{
    trace_rays(group, scene, mask, 0, root, wants_any, waiting);
}
#endif
