// Several rays down the 8-wide tree at once: eight boxes at a time, then four triangles or spheres.
//
// One ray waits most of its time, for memory and for its own comparisons. So a work-item leads CASTOR_WIDE_LANES rays in turn, one node or leaf each, and asks
// for a ray's next node or leaf before it turns to the others. A ray that is done gives its lane to the next of the work-item's batch. What a ray
// finds does not depend on its neighbours.
//
// CASTOR_WIDE_LANES  rays that a work-item leads at once
#include "castor/shared/layout.h"
#include "device/intersect_blocks.cl"

#ifndef CASTOR_WIDE_LANES
#define CASTOR_WIDE_LANES 6
#endif

// A child that waits: when the ray enters it, above its code. As integers the nearer child is the smaller one (for entries before t = 0 the order is
// another, which costs time but no hits).
typedef ulong WaitingChild;

CASTOR_INLINE WaitingChild waiting_child(const float entry, const uint child) { return (ulong)as_uint(entry) << 32 | child; }
CASTOR_INLINE float entry_of(const WaitingChild waiting) { return as_float((uint)(waiting >> 32)); }
CASTOR_INLINE uint child_of(const WaitingChild waiting) { return (uint)waiting; }

// A ray on its way.
typedef struct WideLane {
    BlockRay ray;
    uint near_x, near_y, near_z;  // bytes to the near planes in a node; the far ones are at ^ CASTOR_PLANE_BYTES
    uint current;                 // the child to look at next; CASTOR_INVALID_INDEX: done
    int waiting_count;
    uint index;  // of the ray
    float t_scale;
    Hit best;
} WideLane;

#define CASTOR_PLANE_BYTES 32u

CASTOR_INLINE void begin_lane(WideLane *lane, const SceneColumns scene, const TraceRay ray, const uint index)
{
    lane->ray = make_block_ray(ray);
    lane->near_x = 0 * CASTOR_PLANE_BYTES + (ray.inverse.x < 0.0f ? CASTOR_PLANE_BYTES : 0u);
    lane->near_y = 2 * CASTOR_PLANE_BYTES + (ray.inverse.y < 0.0f ? CASTOR_PLANE_BYTES : 0u);
    lane->near_z = 4 * CASTOR_PLANE_BYTES + (ray.inverse.z < 0.0f ? CASTOR_PLANE_BYTES : 0u);
    lane->current = ray.valid ? scene.params.wide_root : CASTOR_INVALID_INDEX;
    lane->waiting_count = 0;
    lane->index = index;
    lane->t_scale = ray.t_scale;
    lane->best = no_hit_yet(ray);
    if (CASTOR_HAS_PLANES && ray.valid) lane->best = nearest_plane(scene, ray, lane->best);
}

CASTOR_INLINE float8 node_planes(const global uchar *node, const uint bytes)
{
    return *(const global float8 *)(node + bytes);
}

// The children whose boxes the ray enters no later than t_limit, as bits; *entry is when.
CASTOR_INLINE uint enter_children(const WideLane *lane, const global WideNode *wide_node, const float t_limit, float8 *entry)
{
    const global uchar *node = (const global uchar *)wide_node;
    const BlockRay *ray = &lane->ray;
    const float8 inverse_x = (float8)(ray->inverse_x);
    const float8 inverse_y = (float8)(ray->inverse_y);
    const float8 inverse_z = (float8)(ray->inverse_z);
    const float8 entry_x = fma(node_planes(node, lane->near_x), inverse_x, (float8)(ray->entry_x));
    const float8 entry_y = fma(node_planes(node, lane->near_y), inverse_y, (float8)(ray->entry_y));
    const float8 entry_z = fma(node_planes(node, lane->near_z), inverse_z, (float8)(ray->entry_z));
    const float8 exit_x = fma(node_planes(node, lane->near_x ^ CASTOR_PLANE_BYTES), inverse_x, (float8)(ray->exit_x));
    const float8 exit_y = fma(node_planes(node, lane->near_y ^ CASTOR_PLANE_BYTES), inverse_y, (float8)(ray->exit_y));
    const float8 exit_z = fma(node_planes(node, lane->near_z ^ CASTOR_PLANE_BYTES), inverse_z, (float8)(ray->exit_z));
    *entry = larger8(larger8(entry_x, entry_y), larger8(entry_z, (float8)(ray->t_min)));
    const float8 exit = smaller8(smaller8(exit_x, exit_y), smaller8(exit_z, (float8)(t_limit)));
    return mask_of_8(*entry <= exit);
}

// The better of the best hit so far and those of a block.
CASTOR_INLINE Hit nearest_of_block(const SceneColumns scene, const BlockHits block, const global uint *primitives, Hit best)
{
    float t[4], u[4], v[4], determinant[4];
    vstore4(block.t, 0, t);
    vstore4(block.u, 0, u);
    vstore4(block.v, 0, v);
    vstore4(block.determinant, 0, determinant);
    for (uint mask = block.mask; mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        Candidate candidate;
        candidate.t = t[place];
        candidate.u = u[place];
        candidate.v = v[place];
        candidate.from_behind = determinant[place] < 0.0f;
        if (!is_culled(scene, primitives[place], candidate)) best = nearer_hit(best, candidate, primitives[place]);
    }
    return best;
}

CASTOR_INLINE uint first_block(const uint leaf) { return leaf & CASTOR_WIDE_FIRST_MASK; }

CASTOR_INLINE uint end_block(const uint leaf)
{
    return first_block(leaf) + ((leaf >> CASTOR_WIDE_COUNT_SHIFT) & CASTOR_WIDE_COUNT_MASK) + 1;
}

CASTOR_INLINE void visit_leaf(WideLane *lane, const SceneColumns scene, const uint leaf)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) {
        for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
            CASTOR_COUNT(scene, SPHERE_BLOCK);
            const global SphereBlock *block = scene.sphere_blocks + i;
            const BlockHits hits = intersect_sphere_block(&lane->ray, block);
            if (hits.mask) lane->best = nearest_of_block(scene, hits, block->primitive, lane->best);
        }
        return;
    }
#endif
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        CASTOR_COUNT(scene, TRIANGLE_BLOCK);
        const global TriangleBlock *block = scene.triangle_blocks + i;
        const BlockHits hits = intersect_triangle_block(&lane->ray, block);
        if (hits.mask) lane->best = nearest_of_block(scene, hits, block->primitive, lane->best);
    }
}

// The next waiting child that is not entered later than the best hit.
CASTOR_INLINE uint next_waiting(WideLane *lane, const WaitingChild *waiting)
{
    while (lane->waiting_count > 0) {
        const WaitingChild next = waiting[--lane->waiting_count];
        if (entry_of(next) <= lane->best.t) return child_of(next);
    }
    return CASTOR_INVALID_INDEX;
}

// Enters the node's nearest child; the others wait, the nearer ones on top.
CASTOR_INLINE uint visit_node(WideLane *lane, const global WideNode *node, WaitingChild *waiting)
{
    float8 entry;
    uint mask = enter_children(lane, node, lane->best.t, &entry);
    if (!mask) return next_waiting(lane, waiting);
    const uint first = lowest_bit(mask);
    mask &= mask - 1;
    if (!mask) return node->child[first];

    // Which of two is nearer is a coin toss: chosen, not branched on.
    float entries[8];
    vstore8(entry, 0, entries);
    const uint second = lowest_bit(mask);
    mask &= mask - 1;
    const WaitingChild a = waiting_child(entries[first], node->child[first]);
    const WaitingChild b = waiting_child(entries[second], node->child[second]);
    WaitingChild nearest = min(a, b);
    const int base = lane->waiting_count;
    int count = base;
    waiting[count++] = max(a, b);
    for (; mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        const WaitingChild c = waiting_child(entries[place], node->child[place]);
        WaitingChild other = max(nearest, c);
        nearest = min(nearest, c);
        // The last one that waits is chosen likewise; farther ones are rare.
        const WaitingChild top = waiting[count - 1];
        waiting[count] = min(top, other);
        other = max(top, other);
        int at = count++ - 1;
        for (; at > base && waiting[at - 1] < other; --at) waiting[at] = waiting[at - 1];
        waiting[at] = other;
    }
    lane->waiting_count = count;
    return child_of(nearest);
}

// The same without an order: for any hit.
CASTOR_INLINE uint visit_node_unordered(WideLane *lane, const global WideNode *node, WaitingChild *waiting)
{
    float8 entry;
    uint mask = enter_children(lane, node, lane->ray.t_max, &entry);
    for (; mask; mask &= mask - 1) {
        waiting[lane->waiting_count++] = waiting_child(lane->ray.t_min, node->child[lowest_bit(mask)]);
    }
    return next_waiting(lane, waiting);
}

// Leads one ray alone from lane->current on until it is done.
CASTOR_NOINLINE void follow_lane(WideLane *lane, const SceneColumns *scene, const int wants_any, WaitingChild *waiting)
{
    while (lane->current != CASTOR_INVALID_INDEX) {
        if (lane->current & CASTOR_WIDE_LEAF) {
            visit_leaf(lane, *scene, lane->current);
            if (wants_any && lane->best.primitive != CASTOR_INVALID_INDEX) return;
            lane->current = next_waiting(lane, waiting);
        } else {
            CASTOR_COUNT(*scene, NODE);
            // Also for any hit the nearer child is likelier to hold one.
            lane->current = visit_node(lane, scene->wide_nodes + lane->current, waiting);
        }
    }
}

// Asks for what the ray looks at next.
CASTOR_INLINE void prefetch_child(const SceneColumns scene, const uint child)
{
    const global uchar *at = (const global uchar *)(scene.wide_nodes + child);
    if (child & CASTOR_WIDE_LEAF) at = (const global uchar *)(scene.triangle_blocks + (child & CASTOR_WIDE_FIRST_MASK));
    if (CASTOR_HAS_SPHERES && (child & CASTOR_WIDE_LEAF) && (child & CASTOR_WIDE_SPHERES)) return;
    prefetch_line(at);
    prefetch_line(at + 64);
    prefetch_line(at + 128);
    prefetch_line(at + 192);
}

// Traces rays [begin, end) of the columns, CASTOR_WIDE_LANES at a time. `wants_any` (a constant): the first hit found ends a ray's search, and `occluded` is
// written; else the nearest hit is found, and `hits` is written.
CASTOR_INLINE void trace_batch(const SceneColumns scene, const uint begin, const uint end, const int wants_any,
                               const global float4 *restrict ray_origin_tmin,
                               const global float4 *restrict ray_direction_tmax, global Hit *restrict hits,
                               global uchar *restrict occluded)
{
    WideLane lanes[CASTOR_WIDE_LANES];
    WaitingChild waiting[CASTOR_WIDE_LANES][CASTOR_MAX_WIDE_STACK];
    uint next = begin;
    uint busy = 0;
    for (; busy < CASTOR_WIDE_LANES && next < end; ++busy, ++next)
        begin_lane(&lanes[busy], scene, load_ray(scene.params, next, ray_origin_tmin, ray_direction_tmax), next);

    while (busy > 0) {
        for (uint i = 0; i < busy; ++i) {
            WideLane *lane = &lanes[i];
            const uint current = lane->current;
            const int has_hit = lane->best.primitive != CASTOR_INVALID_INDEX;
            if (current == CASTOR_INVALID_INDEX || (wants_any && has_hit)) {
                if (wants_any)
                    occluded[lane->index] = (uchar)has_hit;
                else
                    hits[lane->index] = finished_hit(lane->t_scale, lane->best);
                if (next < end) {
                    begin_lane(lane, scene, load_ray(scene.params, next, ray_origin_tmin, ray_direction_tmax), next);
                    ++next;
                } else if (i != --busy) {
                    // The last lane takes this place.
                    lanes[i] = lanes[busy];
                    for (int w = 0; w < lanes[i].waiting_count; ++w) waiting[i][w] = waiting[busy][w];
                }
                continue;
            }
            if (current & CASTOR_WIDE_LEAF) {
                visit_leaf(lane, scene, current);
                lane->current = next_waiting(lane, waiting[i]);
            } else if (wants_any) {
                CASTOR_COUNT(scene, NODE);
                lane->current = visit_node_unordered(lane, scene.wide_nodes + current, waiting[i]);
            } else {
                CASTOR_COUNT(scene, NODE);
                lane->current = visit_node(lane, scene.wide_nodes + current, waiting[i]);
            }
            prefetch_child(scene, lane->current);
        }
    }
}
