// Traverses the 8-wide tree for CASTOR_WIDE_LANES rays at a time, interleaved: eight boxes at once, then four triangles
// or spheres.
//
// A single ray waits most of its time: for memory, for its own comparisons, and after every branch that was predicted
// wrong. So a work-item interleaves CASTOR_WIDE_LANES rays: every lane whose ray is at a node goes one step, then every
// lane whose ray is at a leaf. A step has hardly a branch (the entered children are sorted by a network and all wait on
// the ray's stack), so that a CPU works on several lanes' steps at the same time, and what a ray needs next is
// prefetched before its lane's next turn. A ray that is done leaves its lane to the next one. What a ray hits does not
// depend on its neighbours.
//
// CASTOR_WIDE_LANES  rays that a work-item interleaves, at most 255
// CASTOR_WIDE_BATCH  rays that a work-item traces; with the suffix u. What is no multiple of CASTOR_GROUP_RAYS leaves
//                    places in its last group empty.
#include "castor/shared/layout.h"
#include "device/intersect_blocks.cl"
#include "device/ray_group.x8.cl"

#ifndef CASTOR_WIDE_LANES
#define CASTOR_WIDE_LANES CASTOR_DEFAULT_WIDE_LANES
#endif
#ifndef CASTOR_WIDE_BATCH
#define CASTOR_WIDE_BATCH CASTOR_DEFAULT_WIDE_BATCH
#endif

// The children that one ray has yet to visit: when it enters each, as an integer key, and the child's code. Keys order
// as the entries do: they are the bits of a float that is not negative, with the child's place in its node instead of
// the three least significant bits. An entry before t = 0 counts as 0. So a key is no later than the ray's entry, which
// is all that skipping a child needs. At the bottom is the code that ends the ray. All eight children of a node are
// written at once, those that are not entered above the top.
typedef struct WaitingStack {
    uint key[CASTOR_MAX_WIDE_STACK + 8];
    uint child[CASTOR_MAX_WIDE_STACK + 8];
} __attribute__((aligned(64))) WaitingStack;

#define CASTOR_KEY_PLACE 7u

// Returns the greatest key that is not later than t.
CASTOR_INLINE uint last_key(const float t) { return as_uint(larger(t, 0.0f)) | CASTOR_KEY_PLACE; }

// Returns the keys of a node's children.
CASTOR_INLINE uint8 keys_of_children(const float8 entry)
{
    const uint8 place = (uint8)(0, 1, 2, 3, 4, 5, 6, 7);
    return (as_uint8(larger8(entry, (float8)(0.0f))) & ~CASTOR_KEY_PLACE) | place;
}

// Returns the keys of the entered children, the one to visit first last. For the nearest hit this is the nearest child.
// For any hit it is the farthest: most such rays begin on a surface, whose neighbourhood has much to visit and little
// to hit. The keys after them have no meaning.
CASTOR_INLINE uint8 sorted_keys(const int8 entered, const uint8 keys, const int wants_any)
{
    return wants_any ? ~greatest_first_8(as_uint8(entered) & ~keys) : greatest_first_8(as_uint8(entered) & keys);
}

// One of the interleaved rays. 16 bytes, so that a lane's address needs no multiplication.
typedef struct Lane {
    RayGroup *ray;
    uint current;  // the child to visit next; CASTOR_INVALID_INDEX: the ray is done
    uint count;    // children on the stack
} Lane;

// Returns a group whose place 0 is this place of `group`, and which has no other. One register then names a ray; with
// another one for the place, rays are slower by a fortieth (AMD Zen 4).
CASTOR_INLINE RayGroup *group_from_place(RayGroup *group, const uint place)
{
    return (RayGroup *)((uint *)group + place);
}

CASTOR_INLINE void begin_lane(Lane *lane, WaitingStack *waiting, RayGroup *group, const uint place, const uint child)
{
    lane->ray = group_from_place(group, place);
    lane->current = child;
    lane->count = 1;
    waiting->key[0] = 0;
    waiting->child[0] = CASTOR_INVALID_INDEX;
}

CASTOR_INLINE float8 node_planes(const global uchar *node, const uint bytes)
{
    return *(const global float8 *)(node + bytes);
}

// Returns the planes of a node's children, for rays whose near planes are at these offsets.
CASTOR_INLINE BoxPlanes8 planes_of_children(const global WideNode *wide_node, const uint near_x, const uint near_y,
                                            const uint near_z)
{
    const global uchar *node = (const global uchar *)wide_node;
    BoxPlanes8 planes;
    planes.near_x = node_planes(node, near_x);
    planes.near_y = node_planes(node, near_y);
    planes.near_z = node_planes(node, near_z);
    planes.far_x = node_planes(node, near_x ^ CASTOR_PLANE_BYTES);
    planes.far_y = node_planes(node, near_y ^ CASTOR_PLANE_BYTES);
    planes.far_z = node_planes(node, near_z ^ CASTOR_PLANE_BYTES);
    return planes;
}

// Returns the children whose boxes the ray enters no later than its best hit, all ones; *entry is when.
CASTOR_INLINE int8 enter_children(const RayGroup *group, const uint place, const global WideNode *wide_node,
                                  float8 *entry)
{
    const BoxPlanes8 planes =
        planes_of_children(wide_node, group->near_x[place], group->near_y[place], group->near_z[place]);
    const Interval8 interval = slab_test8(slabs_of_group8(group, place), planes, rays_of8(group->t_min, place),
                                          rays_of8(group->best_t, place));
    *entry = interval.entry;
    return interval.entry <= interval.exit;
}

CASTOR_INLINE uint first_block(const uint leaf) { return leaf & CASTOR_WIDE_FIRST_MASK; }

CASTOR_INLINE uint end_block(const uint leaf)
{
    return first_block(leaf) + ((leaf >> CASTOR_WIDE_COUNT_SHIFT) & CASTOR_WIDE_COUNT_MASK) + 1;
}

CASTOR_INLINE void visit_leaf(RayGroup *group, const uint place, const SceneColumns scene, const uint leaf)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) {
        for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
            CASTOR_COUNT(scene, SPHERE_BLOCK);
            visit_sphere_block(group, place, scene, scene.sphere_blocks + i);
        }
        return;
    }
#endif
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        CASTOR_COUNT(scene, TRIANGLE_BLOCK);
        visit_triangle_block(group, place, scene, scene.triangle_blocks + i);
    }
}

// Takes the next child from the stack that is not entered later than the best hit.
CASTOR_INLINE void take_next(Lane *lane, const WaitingStack *waiting)
{
    const uint last = last_key(lane->ray->best_t[0]);
    uint count = lane->count;
    do --count;
    while (waiting->key[count] > last);
    lane->count = count;
    lane->current = waiting->child[count];
}

// Enters the node's nearest child and pushes the others, the nearer ones on top.
CASTOR_INLINE void step_at_node(Lane *lane, const global WideNode *node, const int wants_any, WaitingStack *waiting)
{
    float8 entry;
    const int8 entered = enter_children(lane->ray, 0, node, &entry);
    const uint8 sorted = sorted_keys(entered, keys_of_children(entry), wants_any);
    vstore8(sorted, 0, waiting->key + lane->count);
    vstore8(permute_8(*(const global uint8 *)node->child, sorted), 0, waiting->child + lane->count);
    lane->count += popcount(mask_of8(entered));
    take_next(lane, waiting);
}

CASTOR_INLINE void step_at_leaf(Lane *lane, const SceneColumns scene, const int wants_any, WaitingStack *waiting)
{
    visit_leaf(lane->ray, 0, scene, lane->current);
    if (wants_any && has_hit(lane->ray, 0))
        lane->current = CASTOR_INVALID_INDEX;
    else
        take_next(lane, waiting);
}

// Prefetches the node or leaf block that the ray visits next.
CASTOR_INLINE void prefetch_child(const SceneColumns scene, const uint child)
{
    const global uchar *node = (const global uchar *)(scene.wide_nodes + child);
    const global uchar *block = (const global uchar *)(scene.triangle_blocks + first_block(child));
#if CASTOR_HAS_SPHERES
    if (child & CASTOR_WIDE_SPHERES) block = (const global uchar *)(scene.sphere_blocks + first_block(child));
#endif
    const global uchar *at = child & CASTOR_WIDE_LEAF ? block : node;
    prefetch_line(at);
    prefetch_line(at + 64);
    prefetch_line(at + 128);
    prefetch_line(at + 192);
}

// Returns where a ray begins: at `child`, or where that is CASTOR_INVALID_INDEX at the root of the ray's own tree.
CASTOR_INLINE uint first_child(const RayGroup *group, const uint place, const uint child)
{
#if CASTOR_HAS_INSTANCES
    if (child == CASTOR_INVALID_INDEX) return group->root[place];
#endif
    return child;
}

// Traverses the tree for the rays of the groups at places `places` (16 * group + place in the group), from `child` on
// (see first_child), until all are done.
CASTOR_NOINLINE void trace_lanes(const SceneColumns *scene_columns, RayGroup *groups, const ushort *places,
                                 const uint place_count, const uint child, const int wants_any, WaitingStack *waiting)
{
    const SceneColumns scene = *scene_columns;
    Lane lanes[CASTOR_WIDE_LANES];
    uchar at_node[CASTOR_WIDE_LANES + 1];
    uchar at_leaf[CASTOR_WIDE_LANES + 1];  // or done
    uint node_count = 0;
    uint leaf_count = 0;
    uint next = 0;
    for (; next < min(place_count, (uint)CASTOR_WIDE_LANES); ++next) {
        lanes[next].current = CASTOR_INVALID_INDEX;
        at_leaf[leaf_count++] = (uchar)next;
    }
    next = 0;
    while (node_count + leaf_count > 0) {
        uint turns = node_count;
        node_count = 0;
        for (uint i = 0; i < turns; ++i) {
            const uchar number = at_node[i];
            Lane *lane = &lanes[number];
            CASTOR_COUNT(scene, NODE);
            step_at_node(lane, scene.wide_nodes + lane->current, wants_any, &waiting[number]);
            prefetch_child(scene, lane->current);
            const uint is_leaf = lane->current >> 31;
            at_leaf[leaf_count] = number;
            leaf_count += is_leaf;
            at_node[node_count] = number;
            node_count += 1 - is_leaf;
        }
        turns = leaf_count;
        leaf_count = 0;
        for (uint i = 0; i < turns; ++i) {
            const uchar number = at_leaf[i];
            Lane *lane = &lanes[number];
            if (lane->current == CASTOR_INVALID_INDEX) {
                if (next == place_count) continue;
                RayGroup *group = groups + places[next] / CASTOR_GROUP_RAYS;
                const uint place = places[next++] % CASTOR_GROUP_RAYS;
                begin_lane(lane, &waiting[number], group, place, first_child(group, place, child));
            } else {
                step_at_leaf(lane, scene, wants_any, &waiting[number]);
            }
            prefetch_child(scene, lane->current);
            const uint is_leaf = lane->current >> 31;
            at_leaf[leaf_count] = number;
            leaf_count += is_leaf;
            at_node[node_count] = number;
            node_count += 1 - is_leaf;
        }
    }
}

#if CASTOR_HAS_INSTANCES
// Rays that traverse the instances together: enough to fill the lanes most of the time, and no more, since each has a
// stack.
#define CASTOR_INSTANCE_RAYS 64u

// Tests rays [begin, end) of the columns, at most CASTOR_INSTANCE_RAYS, which the groups hold, against the instances,
// in rounds. In each round all rays traverse the tree over instances, interleaved, until each has reached an instance,
// and then traverse the trees of these together.
CASTOR_NOINLINE void trace_instances(const SceneColumns *scene_columns, RayGroup *groups, const uint begin,
                                     const uint end, const int wants_any, const global float4 *ray_origin_tmin,
                                     const global float4 *ray_direction_tmax, WaitingStack *waiting)
{
    const SceneColumns scene = *scene_columns;
    RayGroup objects[CASTOR_INSTANCE_RAYS / CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
    TraceRay rays[CASTOR_INSTANCE_RAYS];
    InstanceWalk walks[CASTOR_INSTANCE_RAYS];
    uint instances[CASTOR_INSTANCE_RAYS];
    ushort walking[CASTOR_INSTANCE_RAYS];
    ushort arrived[CASTOR_INSTANCE_RAYS];
    uint walking_count = 0;
    for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS) {
        RayGroup *group = &groups[first / CASTOR_GROUP_RAYS];
        for (uint mask = unended_rays(group, wants_any); mask; mask &= mask - 1) {
            const uint place = first + lowest_bit(mask);
            rays[place] = load_timed_ray(scene, begin + place, ray_origin_tmin, ray_direction_tmax);
            begin_instance_walk(&walks[place], scene, rays[place], group->best_t[place - first]);
            walking[walking_count] = (ushort)place;
            walking_count += walks[place].count;
        }
    }
    while (walking_count > 0) {
        uint arrived_count = 0;
        while (walking_count > 0) {
            const uint turns = walking_count;
            walking_count = 0;
            for (uint i = 0; i < turns; ++i) {
                const uint place = walking[i];
                const float best_t = groups[place / CASTOR_GROUP_RAYS].best_t[place % CASTOR_GROUP_RAYS];
                const uint instance = step_instance_walk(&walks[place], scene, best_t);
                instances[place] = instance;
                const uint has_arrived = instance != CASTOR_INVALID_INDEX ? 1 : 0;
                arrived[arrived_count] = (ushort)place;
                arrived_count += has_arrived;
                walking[walking_count] = (ushort)place;
                walking_count += walks[place].count > 0 ? 1 - has_arrived : 0;
            }
        }
        ushort places[CASTOR_INSTANCE_RAYS];
        uint place_count = 0;
        for (uint k = 0; k < arrived_count; ++k) {
            const uint place = arrived[k];
            const global Instance *instance = scene.instances + instances[place];
            const TraceRay object =
                make_object_ray(rays[place], instance, scene.geometries[instance->geometry].largest_coordinate);
            const uint row = place % CASTOR_GROUP_RAYS;
            RayGroup *group = objects + place / CASTOR_GROUP_RAYS;
            const Hit best = best_of_ray(groups + place / CASTOR_GROUP_RAYS, row);
            store_rays(group, row, object);
            set_best_of_ray(group, row, best_to_beat(best, instances[place]));
            group->root[row] = scene.wide_roots[instance->geometry];
            places[place_count] = (ushort)place;
            place_count += object.valid ? 1 : 0;
        }
        trace_lanes(&scene, objects, places, place_count, CASTOR_INVALID_INDEX, wants_any, waiting);
        for (uint k = 0; k < place_count; ++k) {
            const uint place = places[k];
            const uint row = place % CASTOR_GROUP_RAYS;
            RayGroup *group = groups + place / CASTOR_GROUP_RAYS;
            const Hit found = best_of_ray(objects + place / CASTOR_GROUP_RAYS, row);
            set_best_of_ray(group, row, better_of_instances(best_of_ray(group, row), found, instances[place]));
            if (wants_any && has_hit(group, row)) walks[place].count = 0;
        }
        for (uint k = 0; k < arrived_count; ++k) {
            walking[walking_count] = arrived[k];
            walking_count += walks[arrived[k]].count > 0 ? 1 : 0;
        }
    }
}
#endif

// Traces rays [begin, end) of the columns, at most CASTOR_WIDE_BATCH. `wants_any` (a constant): the first hit found
// ends a ray's search, and `occluded` is written; else the nearest hit is found, and `hits` is written.
CASTOR_NOINLINE void trace_batch(const SceneColumns scene, const uint begin, const uint end, const int wants_any,
                                 const global float4 *restrict ray_origin_tmin,
                                 const global float4 *restrict ray_direction_tmax, global Hit *hits,
                                 global uchar *occluded)
{
    RayGroup groups[(CASTOR_WIDE_BATCH + CASTOR_GROUP_RAYS - 1) / CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
    const Bounds bounds = bounds_of_scene(scene);
    ushort places[CASTOR_WIDE_BATCH];
    uint place_count = 0;
    for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS) {
        RayGroup *group = &groups[first / CASTOR_GROUP_RAYS];
        make_ray_group(group, scene, bounds, begin + first, end, wants_any, 8, ray_origin_tmin, ray_direction_tmax,
                       hits, occluded);
        for (uint mask = undecided_rays(group, wants_any); mask; mask &= mask - 1)
            places[place_count++] = (ushort)(first + lowest_bit(mask));
    }
    WaitingStack waiting[CASTOR_WIDE_LANES];
    if (scene.params.wide_root != CASTOR_INVALID_INDEX)
        trace_lanes(&scene, groups, places, place_count, scene.params.wide_root, wants_any, waiting);
#if CASTOR_HAS_INSTANCES
    for (uint first = begin; first < end; first += CASTOR_INSTANCE_RAYS)
        trace_instances(&scene, groups + (first - begin) / CASTOR_GROUP_RAYS, first,
                        min(end, first + CASTOR_INSTANCE_RAYS), wants_any, ray_origin_tmin, ray_direction_tmax,
                        waiting);
#endif
    for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS)
        write_answers(&groups[first / CASTOR_GROUP_RAYS], scene, begin + first,
                      min(end, begin + first + CASTOR_GROUP_RAYS), wants_any, 8, hits, occluded);
}
