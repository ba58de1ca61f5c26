// Traverses the 8-wide tree for CASTOR_WIDE_LANES rays at a time, interleaved: eight boxes at once, then four triangles
// or spheres.
//
// A single ray waits most of its time: for memory, for its own comparisons, and after every branch that was predicted
// wrong. So a work-item interleaves CASTOR_WIDE_LANES rays: every lane whose ray is at a node goes one step, then every
// lane whose ray is at a leaf, and so on (Turns). A step has hardly a branch (the entered children are sorted by a
// network and all wait on the ray's stack), so that a CPU works on several lanes' steps at the same time, and what a
// ray needs next is prefetched before its lane's next turn. A ray that is done leaves its lane to the next one. What a
// ray hits does not depend on its neighbours.
//
// CASTOR_WIDE_LANES  rays that a work-item interleaves, at most 32
// CASTOR_WIDE_BATCH  rays that a work-item traces; with the suffix u. What is no multiple of CASTOR_GROUP_RAYS leaves
//                    places in its last group empty.
#include "castor/shared/layout.h"
#include "device/instance_slabs.x16.cl"
#include "device/instance_slabs.x8.cl"
#include "device/intersect_blocks.cl"
#include "device/intersect_group.cl"
#include "device/ray_group.x1.cl"
#include "device/ray_group.x8.cl"
#include "device/store_object_ray.cl"

#ifndef CASTOR_WIDE_LANES
#define CASTOR_WIDE_LANES CASTOR_DEFAULT_WIDE_LANES
#endif
#if CASTOR_WIDE_LANES > 32
#error "Lanes are bits of a uint."
#endif
#ifndef CASTOR_WIDE_BATCH
#define CASTOR_WIDE_BATCH CASTOR_DEFAULT_WIDE_BATCH
#endif

// Keys that are looked at together where a ray goes on with what waits.
#define CASTOR_BELOW 8u

// The children that one ray has yet to visit: when it enters each, as an integer key, and the child's code. Keys order
// as the entries do: they are the bits of a float that is not negative, with the child's place in its node instead of
// the three least significant bits. An entry before t = 0 counts as 0. So a key is no later than the ray's entry, which
// is all that skipping a child needs. At the bottom is the code that ends the ray. All eight children of a node are
// written at once, those that are not entered above the top. Where the ray is in the space of an instance, such a code
// lies above what waits in the world.
#if CASTOR_HAS_INSTANCES
#define CASTOR_WAITING (CASTOR_MAX_WIDE_STACK + 7 * CASTOR_MAX_INSTANCE_STACK + 1 + 8)
#else
#define CASTOR_WAITING (CASTOR_MAX_WIDE_STACK + 8)
#endif
typedef struct WaitingStack {
    uint key[CASTOR_BELOW + CASTOR_WAITING];  // that of place i at CASTOR_BELOW + i; those below never count
    uint child[CASTOR_WAITING];
} __attribute__((aligned(64))) WaitingStack;

#define CASTOR_KEY_PLACE 7u

// Return whether children with these keys are entered no later than best_t, all ones for eight. As whole numbers the
// bits of floats that are not negative are in their order, and the others are later than all of them: a ray with a hit
// before t = 0 skips nothing.
CASTOR_INLINE int is_near(const uint key, const float best_t) { return (key & ~CASTOR_KEY_PLACE) <= as_uint(best_t); }
CASTOR_INLINE int8 are_near(const uint8 keys, const float best_t)
{
    return (keys & ~CASTOR_KEY_PLACE) <= (uint8)(as_uint(best_t));
}

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
    return wants_any ? ~greatest_of_some_first_8(~keys, entered) : greatest_of_some_first_8(keys, entered);
}

// One of the interleaved rays. 16 or 32 bytes, so that a lane's address needs no multiplication.
typedef struct Lane {
    RayGroup *ray;
    uint current;  // the child to visit next; CASTOR_INVALID_INDEX: the ray is done, or leaves the instance
    uint count;    // children on the stack
#if CASTOR_HAS_INSTANCES
    const global WideNode *nodes;  // of the tree in which the ray is
    RayGroup *world_ray;           // where `ray` is in the space of an instance: the one that entered it
#endif
} Lane;

// Children that a group may have deferred at once.
#define CASTOR_MAX_DEFERRED 32u

// The children that rays of a group have yet to visit each by itself, in this order, and when each ray enters them.
typedef struct DeferredChildren {
    float entry[CASTOR_MAX_DEFERRED][CASTOR_GROUP_RAYS];
    uint child[CASTOR_MAX_DEFERRED];
    uint of_ray[CASTOR_GROUP_RAYS];  // which children each ray has deferred, as bits
} __attribute__((aligned(64))) DeferredChildren;

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
    vstore8((uint8)(INT_MAX), 0, waiting->key);
    waiting->key[CASTOR_BELOW] = 0;
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

// Returns which of the eight children below place `count` of the stack are entered no later than best_t, as bits, the
// uppermost one highest.
CASTOR_INLINE uint near_children(const WaitingStack *waiting, const uint count, const float best_t)
{
    return mask_of8(are_near(vload8(0, waiting->key + count), best_t));
}

// Returns the place of the uppermost child below place `count` that is entered no later than best_t; `near` is what
// near_children says of it. There is always one: the lowest child.
CASTOR_INLINE uint next_place(const WaitingStack *waiting, uint count, uint near, const float best_t)
{
    while (!near) {
        count -= CASTOR_BELOW;
        near = near_children(waiting, count, best_t);
    }
    return count - 1 - clz(near << 24);
}

// Takes the next child from the stack that is not entered later than the best hit.
CASTOR_INLINE void take_next(Lane *lane, const WaitingStack *waiting)
{
    const float best_t = lane->ray->best_t[0];
    lane->count = next_place(waiting, lane->count, near_children(waiting, lane->count, best_t), best_t);
    lane->current = waiting->child[lane->count];
}

// Enters the node's nearest child and pushes the others, the nearer ones on top. Where no child is entered, the next
// one from the stack is known by then, since keys that were stored some turns ago are read without a wait. So there is
// no branch but for two rare cases: more than four children are entered, or eight and more that wait are too far.
CASTOR_INLINE void step_at_node(Lane *lane, const global WideNode *node, const int wants_any, WaitingStack *waiting)
{
    const uint count = lane->count;
    const float best_t = lane->ray->best_t[0];
    const uint near = near_children(waiting, count, best_t);
    float8 entry;
    const int8 entered = enter_children(lane->ray, 0, node, &entry);
    const uint8 sorted = sorted_keys(entered, keys_of_children(entry), wants_any);
    vstore8(sorted, 0, waiting->key + CASTOR_BELOW + count);
    vstore8(permute_8(*(const global uint8 *)node->child, sorted), 0, waiting->child + count);
    const uint entered_mask = mask_of8(entered);
    uint next = count - 1 + (entered_mask ? popcount(entered_mask) : 0u - clz(near << 24));
    if (!(entered_mask | near)) next = next_place(waiting, count, near, best_t);
    lane->count = next;
    lane->current = waiting->child[next];
}

CASTOR_INLINE void step_at_leaf(Lane *lane, const SceneColumns scene, const int wants_any, WaitingStack *waiting)
{
    visit_leaf(lane->ray, 0, scene, lane->current);
    if (wants_any && has_hit(lane->ray, 0))
        lane->current = CASTOR_INVALID_INDEX;
    else
        take_next(lane, waiting);
}

// Returns the nodes of the tree in which the lane's ray is.
CASTOR_INLINE const global WideNode *nodes_of_lane(const Lane *lane, const SceneColumns scene)
{
#if CASTOR_HAS_INSTANCES
    return lane->nodes;
#else
    return scene.wide_nodes;
#endif
}

// Prefetches what the ray visits next: a node, a leaf block, or, where `is_over_instances`, an instance.
CASTOR_INLINE void prefetch_child(const Lane *lane, const SceneColumns scene, const int is_over_instances)
{
    const uint child = lane->current;
    const global uchar *node = (const global uchar *)(nodes_of_lane(lane, scene) + child);
    const global uchar *block = (const global uchar *)(scene.triangle_blocks + first_block(child));
#if CASTOR_HAS_SPHERES
    if (child & CASTOR_WIDE_SPHERES) block = (const global uchar *)(scene.sphere_blocks + first_block(child));
#endif
#if CASTOR_HAS_INSTANCES
    if (is_over_instances) block = (const global uchar *)(scene.instances + (child & ~CASTOR_WIDE_LEAF));
#endif
    const global uchar *at = child & CASTOR_WIDE_LEAF ? block : node;
    prefetch_line(at);
    prefetch_line(at + 64);
    prefetch_line(at + 128);
    prefetch_line(at + 192);
}

#if CASTOR_HAS_INSTANCES
// Makes the lane's ray, which is at an instance, ready at place 0 of `object` in the instance's space, to go on there.
// Returns 1; 0 where the ray can hit nothing there, and goes on in the world.
CASTOR_INLINE uint enter_instance(Lane *lane, RayGroup *object, const SceneColumns scene, WaitingStack *waiting)
{
    const uint number = lane->current & ~CASTOR_WIDE_LEAF;
    const global Instance *instance = scene.instances + number;
    const uint geometry = instance->geometry;
    if (!store_object_ray(object, lane->ray, instance, scene.geometries[geometry].largest_coordinate)) {
        take_next(lane, waiting);
        return 0;
    }
    set_best_of_ray(object, 0, best_to_beat(best_of_ray(lane->ray, 0), number));
    object->instance[0] = number;
    waiting->key[CASTOR_BELOW + lane->count] = 0;
    waiting->child[lane->count] = CASTOR_INVALID_INDEX;
    ++lane->count;
    lane->world_ray = lane->ray;
    lane->ray = object;
    lane->nodes = scene.wide_nodes;
    lane->current = scene.wide_roots[geometry];
    return 1;
}

// Goes on in the world, with what was found in the instance.
CASTOR_INLINE void leave_instance(Lane *lane, const SceneColumns scene, const int wants_any,
                                  const WaitingStack *waiting)
{
    const Hit found = best_of_ray(lane->ray, 0);
    const uint number = lane->ray->instance[0];
    RayGroup *ray = lane->world_ray;
    set_best_of_ray(ray, 0, better_of_instances(best_of_ray(ray, 0), found, number));
    lane->ray = ray;
    lane->nodes = scene.wide_instance_nodes;
    if (!wants_any || !has_hit(ray, 0)) take_next(lane, waiting);
}
#endif

// Goes on with the next child that the ray of the lane, which is at this place of its group, has deferred, if there is
// one that it does not enter later than its best hit. Returns the others, as bits.
CASTOR_INLINE uint take_deferred(Lane *lane, const DeferredChildren *deferred, const uint place, uint left)
{
    const float best_t = lane->ray->best_t[0];
    while (left) {
        const uint number = lowest_bit(left);
        left &= left - 1;
        if (deferred->entry[number][place] <= best_t) {
            lane->current = deferred->child[number];
            lane->count = 1;
            break;
        }
    }
    return left;
}

// The lanes by what their rays do next, as bits: a turn takes one kind of work after the other, with no branch between
// kinds. Bits are in registers; lists of lanes in memory are slower by .01 to .03 (Intel Emerald Rapids).
typedef struct Turns {
    uint off_nodes;    // at a leaf, at an instance, or at the end
    uint at_end;       // nothing is left: of the instance, or of the world
    uint in_instance;  // in the space of an instance, whatever is next
} Turns;

// Returns those of the lanes `some` that are at a leaf or an instance, and takes them out.
CASTOR_INLINE uint take_leaves(Turns *turns, const uint some)
{
    const uint taken = turns->off_nodes & ~turns->at_end & some;
    turns->off_nodes ^= taken;
    return taken;
}

// Returns those of the lanes `some` that are at the end, and takes them out.
CASTOR_INLINE uint take_ended(Turns *turns, const uint some)
{
    const uint taken = turns->at_end & some;
    turns->at_end ^= taken;
    turns->off_nodes ^= taken;
    return taken;
}

// Returns the number of the first lane, and takes it out. There is at least one.
CASTOR_INLINE uint take_first(uint *lanes)
{
    const uint first = lowest_bit(*lanes);
    *lanes &= *lanes - 1;
    return first;
}

// Adds the lane to those that do the same next, and prefetches what its ray visits.
CASTOR_INLINE void wait_for_turn(Turns *turns, const uint number, const Lane *lane, const SceneColumns scene,
                                 const int over_instances)
{
    prefetch_child(lane, scene, over_instances && !(turns->in_instance >> number & 1u));
    const uint bit = 1u << number;
    turns->off_nodes |= (uint)((int)lane->current >> 31) & bit;
    turns->at_end |= lane->current == CASTOR_INVALID_INDEX ? bit : 0u;
}

// Traverses the tree for the rays of the groups at places `places` (16 * group + place in the group), from `child` on,
// until all are done. `over_instances`: the tree over instances, and those that a ray meets, for rays with slabs for
// this. `deferred`, where it is not 0, has the children that rays of each group visit in place of `child`.
CASTOR_NOINLINE void trace_lanes(const SceneColumns *scene_columns, RayGroup *groups, const ushort *places,
                                 const uint place_count, const int over_instances, const uint child,
                                 const int wants_any, const DeferredChildren *deferred, WaitingStack *waiting)
{
    const SceneColumns scene = *scene_columns;
    Lane lanes[CASTOR_WIDE_LANES];
    Turns turns;
    ushort place_of_lane[CASTOR_WIDE_LANES];
    uint deferred_of_lane[CASTOR_WIDE_LANES];
#if CASTOR_HAS_INSTANCES
    RayGroup objects[(CASTOR_WIDE_LANES + CASTOR_GROUP_RAYS - 1) / CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
#endif
    uint next = 0, live = 0;
    for (; next < min(place_count, (uint)CASTOR_WIDE_LANES); ++next) {
        lanes[next].current = CASTOR_INVALID_INDEX;
        deferred_of_lane[next] = 0;
        live |= 1u << next;
    }
    turns.off_nodes = turns.at_end = live;
    turns.in_instance = 0;
    next = 0;
    while (live) {
        // Lanes at leaves are those from before the steps at nodes, and lanes that are done those from before the
        // leaves: what the last step leaves behind is known late.
        uint at_node = live & ~turns.off_nodes;
        uint at_leaf = take_leaves(&turns, over_instances ? turns.in_instance : ~0u);
        while (at_node) {
            const uint number = take_first(&at_node);
            Lane *lane = &lanes[number];
            CASTOR_COUNT(scene, NODE);
            step_at_node(lane, nodes_of_lane(lane, scene) + lane->current, wants_any, &waiting[number]);
            wait_for_turn(&turns, number, lane, scene, over_instances);
        }
        uint done = take_ended(&turns, ~turns.in_instance);
        while (at_leaf) {
            const uint number = take_first(&at_leaf);
            Lane *lane = &lanes[number];
            step_at_leaf(lane, scene, wants_any, &waiting[number]);
            wait_for_turn(&turns, number, lane, scene, over_instances);
        }
#if CASTOR_HAS_INSTANCES
        uint leaving = take_ended(&turns, turns.in_instance);
        turns.in_instance ^= leaving;
        while (leaving) {
            const uint number = take_first(&leaving);
            Lane *lane = &lanes[number];
            leave_instance(lane, scene, wants_any, &waiting[number]);
            wait_for_turn(&turns, number, lane, scene, over_instances);
        }
        uint entering = over_instances ? take_leaves(&turns, ~turns.in_instance) : 0u;
        while (entering) {
            const uint number = take_first(&entering);
            Lane *lane = &lanes[number];
            RayGroup *object = group_from_place(objects + number / CASTOR_GROUP_RAYS, number % CASTOR_GROUP_RAYS);
            turns.in_instance |= enter_instance(lane, object, scene, &waiting[number]) << number;
            wait_for_turn(&turns, number, lane, scene, over_instances);
        }
#endif
        while (done) {
            const uint number = take_first(&done);
            Lane *lane = &lanes[number];
            if (!deferred_of_lane[number] || (wants_any && has_hit(lane->ray, 0))) {
                if (next == place_count) {
                    live ^= 1u << number;
                    continue;
                }
                RayGroup *group = groups + places[next] / CASTOR_GROUP_RAYS;
                const uint place = places[next] % CASTOR_GROUP_RAYS;
                begin_lane(lane, &waiting[number], group, place, deferred ? CASTOR_INVALID_INDEX : child);
                place_of_lane[number] = places[next];
                if (deferred) deferred_of_lane[number] = deferred[group - groups].of_ray[place];
                ++next;
            }
            if (deferred)
                deferred_of_lane[number] =
                    take_deferred(lane, deferred + place_of_lane[number] / CASTOR_GROUP_RAYS,
                                  place_of_lane[number] % CASTOR_GROUP_RAYS, deferred_of_lane[number]);
#if CASTOR_HAS_INSTANCES
            lane->nodes = over_instances ? scene.wide_instance_nodes : scene.wide_nodes;
#endif
            wait_for_turn(&turns, number, lane, scene, over_instances);
        }
    }
}

#if CASTOR_HAS_INSTANCES
// Makes the group's rays, which begin with ray `begin` of the columns, ready for the tree over instances, and for no
// other any more.
CASTOR_INLINE void turn_to_instances(RayGroup *group, const SceneColumns scene, const uint begin)
{
    const float slope = scene.instance_nodes[0].slope;
    if (CASTOR_REGISTERS_OF_16) {
        store_instance_slabs16(group, 0, slope);
    } else {
        store_instance_slabs8(group, 0, slope);
        store_instance_slabs8(group, 8, slope);
    }
#if CASTOR_HAS_MOTION
    for (uint mask = group->valid; mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        group->time[place] = scene.ray_time[begin + place];
    }
#endif
}
#endif

// Traverses the tree for some rays of the group, given as bits, each by itself, from `child` on.
CASTOR_INLINE void trace_rays(RayGroup *rays, const SceneColumns *scene, uint mask, const int over_instances,
                              const uint child, const int wants_any, WaitingStack *waiting)
{
    ushort places[CASTOR_GROUP_RAYS];
    uint count = 0;
    for (; mask; mask &= mask - 1) places[count++] = (ushort)lowest_bit(mask);
    trace_lanes(scene, rays, places, count, over_instances, child, wants_any, 0, waiting);
}
