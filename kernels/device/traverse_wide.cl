// Many rays down the 8-wide tree, each by itself: eight boxes at a time, then four triangles or spheres.
//
// One ray waits most of its time: for memory, for its own comparisons, and after every branch that was guessed wrong.
// So a work-item leads CASTOR_WIDE_LANES rays at once: every lane whose ray stands at a node goes one step, then every
// one whose ray stands at a leaf. A step has hardly a branch (the entered children are sorted by a network and all wait
// on the stack), so that a CPU works on several lanes' steps at the same time; what a ray looks at next is asked for
// before its lane's next turn. A ray that is done leaves its lane to the next one. What a ray finds does not depend on
// its neighbours.
//
// CASTOR_WIDE_LANES  rays that a work-item leads at once, at most 255
// CASTOR_WIDE_BATCH  rays that a work-item traces, a multiple of CASTOR_GROUP_RAYS; with the suffix u
#include "castor/shared/layout.h"
#include "device/intersect_blocks.cl"

#ifndef CASTOR_WIDE_LANES
#define CASTOR_WIDE_LANES CASTOR_DEFAULT_WIDE_LANES
#endif
#ifndef CASTOR_WIDE_BATCH
#define CASTOR_WIDE_BATCH CASTOR_DEFAULT_WIDE_BATCH
#endif

// Of a kernel that computes in vectors: a compiler that puts work-items into the lanes of vectors, as Intel's does for
// CPUs, is to leave it as it is. Otherwise it takes minutes over closest_hit_packet, not seconds.
#define CASTOR_IN_VECTORS __attribute__((vec_type_hint(float16)))

// The children that wait, of one ray: when it enters each, as an integer key, and the child's code. Keys order as the
// entries do: bits of a float that is not negative, and below them, in place of the three least significant ones, the
// child's place in its node. An entry before t = 0 counts as 0. So a key says no later than the ray enters, which is
// all that passing over a child needs. At the bottom waits the code that ends the ray.
typedef struct WaitingStack {
    uint
        key[CASTOR_MAX_WIDE_STACK + 8];  // a node's eight are written at once, those that are not entered above the top
    uint child[CASTOR_MAX_WIDE_STACK + 8];
} WaitingStack;

#define CASTOR_KEY_PLACE 7u

// The greatest key that is not later than t.
CASTOR_INLINE uint last_key(const float t) { return as_uint(larger(t, 0.0f)) | CASTOR_KEY_PLACE; }

// The keys of the entered children, that to look at first last. For the nearest hit that is the nearest child. For any
// hit it is the farthest: most such rays begin on a surface, whose neighbourhood has much to visit and little to hit.
// What follows them has no meaning.
CASTOR_INLINE uint8 sorted_keys(const int8 entered, const float8 entry, const int wants_any)
{
    const uint8 place = (uint8)(0, 1, 2, 3, 4, 5, 6, 7);
    const uint8 key = (as_uint8(larger8(entry, (float8)(0.0f))) & ~CASTOR_KEY_PLACE) | place;
    return wants_any ? ~greatest_first_8(as_uint8(entered) & ~key) : greatest_first_8(as_uint8(entered) & key);
}

// One ray on its way.
typedef struct Lane {
    RayGroup *ray;
    uint current;  // the child to look at next; CASTOR_INVALID_INDEX: the ray is done
    uint count;    // children that wait
} Lane;

CASTOR_INLINE void begin_lane(Lane *lane, WaitingStack *waiting, RayGroup *ray, const uint child)
{
    lane->ray = ray;
    lane->current = child;
    lane->count = 1;
    waiting->key[0] = 0;
    waiting->child[0] = CASTOR_INVALID_INDEX;
}

CASTOR_INLINE float8 node_planes(const global uchar *node, const uint bytes)
{
    return *(const global float8 *)(node + bytes);
}

// The children whose boxes the ray enters no later than t_limit, all ones; *entry is when.
CASTOR_INLINE int8 enter_children(const RayGroup *ray, const global WideNode *wide_node, const float t_limit,
                                  float8 *entry)
{
    const global uchar *node = (const global uchar *)wide_node;
    const float8 inverse_x = (float8)(ray->inverse_x[0]);
    const float8 inverse_y = (float8)(ray->inverse_y[0]);
    const float8 inverse_z = (float8)(ray->inverse_z[0]);
    const uint near_x = ray->near_x[0];
    const uint near_y = ray->near_y[0];
    const uint near_z = ray->near_z[0];
    const float8 entry_x = fma(node_planes(node, near_x), inverse_x, (float8)(ray->entry_x[0]));
    const float8 entry_y = fma(node_planes(node, near_y), inverse_y, (float8)(ray->entry_y[0]));
    const float8 entry_z = fma(node_planes(node, near_z), inverse_z, (float8)(ray->entry_z[0]));
    const float8 exit_x = fma(node_planes(node, near_x ^ CASTOR_PLANE_BYTES), inverse_x, (float8)(ray->exit_x[0]));
    const float8 exit_y = fma(node_planes(node, near_y ^ CASTOR_PLANE_BYTES), inverse_y, (float8)(ray->exit_y[0]));
    const float8 exit_z = fma(node_planes(node, near_z ^ CASTOR_PLANE_BYTES), inverse_z, (float8)(ray->exit_z[0]));
    *entry = larger8(larger8(entry_x, entry_y), larger8(entry_z, (float8)(ray->t_min[0])));
    const float8 exit = smaller8(smaller8(exit_x, exit_y), smaller8(exit_z, (float8)(t_limit)));
    return *entry <= exit;
}

// Takes the hits of a block where they are better.
CASTOR_INLINE void accept_block_hits(RayGroup *ray, const SceneColumns scene, const BlockHits block,
                                     const global uint *primitives)
{
    if (!block.mask) return;
    float t[4], u[4], v[4], determinant[4];
    vstore4(block.t, 0, t);
    vstore4(block.u, 0, u);
    vstore4(block.v, 0, v);
    vstore4(block.determinant, 0, determinant);
    Hit best = best_of_ray(ray);
    for (uint mask = block.mask; mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        Candidate candidate;
        candidate.t = t[place];
        candidate.u = u[place];
        candidate.v = v[place];
        candidate.from_behind = determinant[place] < 0.0f;
        if (!is_culled(scene, primitives[place], candidate)) best = nearer_hit(best, candidate, primitives[place]);
    }
    set_best_of_ray(ray, best);
}

CASTOR_INLINE uint first_block(const uint leaf) { return leaf & CASTOR_WIDE_FIRST_MASK; }

CASTOR_INLINE uint end_block(const uint leaf)
{
    return first_block(leaf) + ((leaf >> CASTOR_WIDE_COUNT_SHIFT) & CASTOR_WIDE_COUNT_MASK) + 1;
}

CASTOR_INLINE void visit_leaf(RayGroup *ray, const SceneColumns scene, const uint leaf)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) {
        for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
            CASTOR_COUNT(scene, SPHERE_BLOCK);
            const global SphereBlock *block = scene.sphere_blocks + i;
            accept_block_hits(ray, scene, intersect_sphere_block(ray, block), block->primitive);
        }
        return;
    }
#endif
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        CASTOR_COUNT(scene, TRIANGLE_BLOCK);
        const global TriangleBlock *block = scene.triangle_blocks + i;
        accept_block_hits(ray, scene, intersect_triangle_block(ray, block), block->primitive);
    }
}

// The next waiting child that is not entered later than the best hit.
CASTOR_INLINE void take_next(Lane *lane, const WaitingStack *waiting)
{
    const uint last = last_key(lane->ray->best_t[0]);
    uint count = lane->count;
    do --count;
    while (waiting->key[count] > last);
    lane->count = count;
    lane->current = waiting->child[count];
}

// Enters the node's nearest child; the others wait, the nearer ones on top.
CASTOR_INLINE void step_at_node(Lane *lane, const global WideNode *node, const int wants_any, WaitingStack *waiting)
{
    float8 entry;
    const int8 entered = enter_children(lane->ray, node, lane->ray->best_t[0], &entry);
    const uint8 sorted = sorted_keys(entered, entry, wants_any);
    vstore8(sorted, 0, waiting->key + lane->count);
    vstore8(permute_8(*(const global uint8 *)node->child, sorted), 0, waiting->child + lane->count);
    lane->count += popcount(mask_of_8(entered));
    take_next(lane, waiting);
}

CASTOR_INLINE void step_at_leaf(Lane *lane, const SceneColumns scene, const int wants_any, WaitingStack *waiting)
{
    visit_leaf(lane->ray, scene, lane->current);
    if (wants_any && has_hit(lane->ray))
        lane->current = CASTOR_INVALID_INDEX;
    else
        take_next(lane, waiting);
}

// Asks for what the ray looks at next.
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

// Where the search of a ray begins: at `child`, or with CASTOR_INVALID_INDEX at the root of its own.
CASTOR_INLINE uint first_child(const RayGroup *ray, const uint child)
{
#if CASTOR_HAS_INSTANCES
    if (child == CASTOR_INVALID_INDEX) return ray->root[0];
#endif
    return child;
}

// Leads the rays of the groups at places `places` (16 * group + place in it), from `child` on (see first_child), until
// they are done.
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
        lanes[next].ray = groups;
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
                const uint place = places[next++];
                RayGroup *ray = ray_of_group(groups + place / CASTOR_GROUP_RAYS, place % CASTOR_GROUP_RAYS);
                begin_lane(lane, &waiting[number], ray, first_child(ray, child));
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
// Rays that go through the instances together: enough to fill the lanes for most of their way, and no more, since each
// keeps a stack.
#define CASTOR_INSTANCE_RAYS 64u

// Finds what the instances add to the best hits of rays [begin, end), at most CASTOR_INSTANCE_RAYS, which the groups
// hold: in rounds. In each, all rays step in turns through the tree over instances until they stand at one, and are
// then led through these together.
CASTOR_NOINLINE void trace_instances(const SceneColumns *scene_columns, RayGroup *groups, const uint begin,
                                     const uint end, const int wants_any, const global float4 *ray_origin_tmin,
                                     const global float4 *ray_direction_tmax, WaitingStack *waiting)
{
    const SceneColumns scene = *scene_columns;
    RayGroup objects[CASTOR_INSTANCE_RAYS / CASTOR_GROUP_RAYS];
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
            rays[place] = load_ray(scene.params, begin + place, ray_origin_tmin, ray_direction_tmax);
            begin_instance_walk(&walks[place], scene, rays[place], ray_of_group(group, place - first)->best_t[0]);
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
                const float best_t =
                    ray_of_group(groups + place / CASTOR_GROUP_RAYS, place % CASTOR_GROUP_RAYS)->best_t[0];
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
            RayGroup *group = objects + place / CASTOR_GROUP_RAYS;
            const Hit best = best_of_ray(ray_of_group(groups + place / CASTOR_GROUP_RAYS, place % CASTOR_GROUP_RAYS));
            set_ray_of_group(group, place % CASTOR_GROUP_RAYS, object, best_to_beat(best, instances[place]));
            ray_of_group(group, place % CASTOR_GROUP_RAYS)->root[0] = scene.wide_roots[instance->geometry];
            places[place_count] = (ushort)place;
            place_count += object.valid ? 1 : 0;
        }
        trace_lanes(&scene, objects, places, place_count, CASTOR_INVALID_INDEX, wants_any, waiting);
        for (uint k = 0; k < place_count; ++k) {
            const uint place = places[k];
            RayGroup *ray = ray_of_group(groups + place / CASTOR_GROUP_RAYS, place % CASTOR_GROUP_RAYS);
            const RayGroup *object = ray_of_group(objects + place / CASTOR_GROUP_RAYS, place % CASTOR_GROUP_RAYS);
            set_best_of_ray(ray, better_of_instances(best_of_ray(ray), best_of_ray(object), instances[place]));
            if (wants_any && has_hit(ray)) walks[place].count = 0;
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
CASTOR_INLINE void trace_batch(const SceneColumns scene, const uint begin, const uint end, const int wants_any,
                               const global float4 *restrict ray_origin_tmin,
                               const global float4 *restrict ray_direction_tmax, global Hit *hits,
                               global uchar *occluded)
{
    RayGroup groups[CASTOR_WIDE_BATCH / CASTOR_GROUP_RAYS];
    ushort places[CASTOR_WIDE_BATCH];
    uint place_count = 0;
    for (uint first = 0; begin + first < end; first += CASTOR_GROUP_RAYS) {
        RayGroup *group = &groups[first / CASTOR_GROUP_RAYS];
        make_ray_group(group, scene, begin + first, end, wants_any, ray_origin_tmin, ray_direction_tmax, hits,
                       occluded);
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
                      min(end, begin + first + CASTOR_GROUP_RAYS), wants_any, hits, occluded);
}
