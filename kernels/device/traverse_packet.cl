// Traverses the 8-wide tree for a bundle of 16 coherent rays: one interval test of a node's eight boxes for the whole
// bundle, then vectors over rays. Where few rays of the bundle enter a child, each of them may go on alone.
#define CASTOR_GROUPS_HAVE_ORIGINS 1
#include "castor/shared/layout.h"
#include "device/object_ray.x16.cl"
#include "device/packet_boxes.x4.cl"
#include "device/packet_boxes.x8.cl"
#include "device/traverse_divergent.cl"

// What the groups of a batch so far tell of the next one.
typedef struct PacketHistory {
    // What bundles have cost, and what their rays would have cost each by itself, in steps that take about the same
    // time: a node, a box and half a leaf block of a bundle, and a node or a leaf block of a ray.
    uint together, alone;
    uint occluder;                  // a leaf that has occluded many rays; CASTOR_INVALID_INDEX: none
    uint own_boxes, entered_boxes;  // of triangles, against which bundles were tested, and those that they entered
} PacketHistory;

// After so many steps a batch goes on without bundles where its rays would have taken less than this many tenths of the
// steps each by itself. These rays are interleaved, so that a step of theirs takes less time. For the nearest hit it
// did not pay without instances.
#ifndef CASTOR_PACKET_TRIAL
#define CASTOR_PACKET_TRIAL 64
#endif
#ifndef CASTOR_PACKET_LEAST_ALONE
#define CASTOR_PACKET_LEAST_ALONE (CASTOR_HAS_INSTANCES ? 4u : 0u)
#endif
#ifndef CASTOR_PACKET_LEAST_ALONE_ANY
#define CASTOR_PACKET_LEAST_ALONE_ANY 5u
#endif

// Returns these tenths. 0: bundles are never given up.
CASTOR_INLINE uint least_alone(const int wants_any)
{
    return wants_any ? CASTOR_PACKET_LEAST_ALONE_ANY : CASTOR_PACKET_LEAST_ALONE;
}

CASTOR_INLINE void add_work(PacketHistory *history, const uint together, const uint alone, const int wants_any)
{
    if (least_alone(wants_any) == 0u) return;
    history->together += together;
    history->alone += alone;
}

CASTOR_INLINE int is_slower_together(const PacketHistory history, const int wants_any)
{
    return history.together >= CASTOR_PACKET_TRIAL && 10u * history.alone < least_alone(wants_any) * history.together;
}

// A leaf that occludes at least so many rays of a bundle is tested first against the groups that follow, as long as it
// occludes so many of each. Rates were the same within 3 % with 4 to 12 and 1 to 4.
#define CASTOR_OCCLUDER_FOUND 8
#define CASTOR_OCCLUDER_KEPT 4

#define CASTOR_PACKET_GROUPS ((CASTOR_WIDE_BATCH + CASTOR_GROUP_RAYS - 1) / CASTOR_GROUP_RAYS)

// With no more rays than these that enter a node, or a leaf of spheres, these rays go on alone. Where a register holds
// something of all sixteen, a step of the bundle takes no longer than that of a ray, and they never do, but for nodes
// among instances.
#ifndef CASTOR_PACKET_FEW_AT_NODE
#define CASTOR_PACKET_FEW_AT_NODE (!CASTOR_REGISTERS_OF_16 ? 3 : CASTOR_HAS_INSTANCES ? 2 : 0)
#endif
#ifndef CASTOR_PACKET_FEW_AT_SPHERES
#define CASTOR_PACKET_FEW_AT_SPHERES (CASTOR_REGISTERS_OF_16 ? 0 : 3)
#endif

// A bundle is tested first against the own boxes of so many triangles of a block, all at once, and then against those
// triangles alone whose boxes it enters. This pays where they are no more than half of all, as among long thin
// triangles: 16 samples a pixel take a tenth less time there. A batch goes on with it as long as the boxes that were
// entered are no more than half of all and half of the trial's.
#ifndef CASTOR_PACKET_LEAST_BOXES
#define CASTOR_PACKET_LEAST_BOXES 3
#endif
#define CASTOR_PACKET_BOXES_TRIAL 16u

CASTOR_INLINE int do_own_boxes_pay(const PacketHistory *history)
{
    return 2u * history->entered_boxes <= history->own_boxes + CASTOR_PACKET_BOXES_TRIAL;
}

// 1: rays that are tested alone against a block find first together whether they may hit anything. Shadow rays are
// faster by .01 to .06; rays for their nearest hit are not, and shadow rays among instances are slower by .015 (Intel
// Emerald Rapids).
#define CASTOR_PACKET_RAYS_JOIN(wants_any) (CASTOR_REGISTERS_OF_16 && !CASTOR_HAS_INSTANCES && (wants_any))

// Tells whether rays that enter a leaf are so few that each of them is tested alone against a block of `triangles`, all
// of them at once. A bundle is tested against one triangle at a time.
CASTOR_INLINE int is_few_at_block(const uint rays, const uint triangles, const int wants_any)
{
    if (!CASTOR_REGISTERS_OF_16) return rays <= 8;
    return CASTOR_PACKET_RAYS_JOIN(wants_any) ? rays <= triangles : rays < triangles;
}

CASTOR_INLINE float16 plane_of_child(const global uchar *node, const uint bytes)
{
    return (float16)(*(const global float *)(node + bytes));
}

// Returns the rays of the bundle that take part and enter the box at `place` of the node no later than their best hit,
// as bits.
CASTOR_INLINE uint rays_in_child(const Packet *packet, const global WideNode *wide_node, const uint place)
{
    const global uchar *node = (const global uchar *)wide_node + 4 * place;
    BoxPlanes16 planes;
    planes.near_x = plane_of_child(node, packet->near_x);
    planes.near_y = plane_of_child(node, packet->near_y);
    planes.near_z = plane_of_child(node, packet->near_z);
    planes.far_x = plane_of_child(node, packet->near_x ^ CASTOR_PLANE_BYTES);
    planes.far_y = plane_of_child(node, packet->near_y ^ CASTOR_PLANE_BYTES);
    planes.far_z = plane_of_child(node, packet->near_z ^ CASTOR_PLANE_BYTES);
    const Interval16 interval = slab_test16(slabs_of_group16(packet->rays, 0), planes, CASTOR_COLUMN(packet, t_min),
                                            CASTOR_COLUMN(packet, best_t));
    return packet->active & mask_of16(interval.entry <= interval.exit);
}

// Returns the children that some ray of the bundle may enter no later than `limit`, all ones; *entry is a lower bound
// of when.
CASTOR_INLINE int8 enter_children_together(const Packet *packet, const global WideNode *node, const float limit,
                                           float8 *entry)
{
    const BoxPlanes8 planes = planes_of_children(node, packet->near_x, packet->near_y, packet->near_z);
    const Interval8 interval = packet_interval8(packet, planes, limit);
    *entry = interval.entry;
    return interval.entry <= interval.exit;
}

// Returns the triangles of a block whose own boxes some ray of the bundle may enter no later than `limit`, as bits. By
// the own-box rule no other triangle is hit.
CASTOR_INLINE uint triangles_in_reach(const Packet *packet, const global TriangleBlock *block, const float limit)
{
    Slabs4 slabs;  // of which planes_of_block needs no more
    slabs.inverse_x = (float4)(packet->least_inverse.x);
    slabs.inverse_y = (float4)(packet->least_inverse.y);
    slabs.inverse_z = (float4)(packet->least_inverse.z);
    const Interval4 interval = packet_interval4(packet, planes_of_block(slabs, block), limit);
    return mask_of4(interval.entry <= interval.exit);
}

// Returns the planes of one box, in every lane. Rays of a bundle have the same near planes.
CASTOR_INLINE BoxPlanes16 planes_of_box_together(const Packet *packet, const float3 lower, const float3 upper)
{
    const float3 near_plane = packet->least_inverse < 0.0f ? upper : lower;
    const float3 far_plane = packet->least_inverse < 0.0f ? lower : upper;
    BoxPlanes16 planes;
    planes.near_x = (float16)(near_plane.x);
    planes.near_y = (float16)(near_plane.y);
    planes.near_z = (float16)(near_plane.z);
    planes.far_x = (float16)(far_plane.x);
    planes.far_y = (float16)(far_plane.y);
    planes.far_z = (float16)(far_plane.z);
    return planes;
}

// Tests one triangle of a leaf block against the bundle. Returns the rays that have a better hit now, as bits.
CASTOR_INLINE uint visit_triangle_together(Packet *packet, const SceneColumns scene, const global TriangleBlock *block,
                                           const uint place)
{
    CASTOR_COUNT(scene, BUNDLE_TRIANGLE);
    const global float *at = (const global float *)block + place;
    const uint kx = 4 * packet->kx;
    const uint ky = 4 * packet->ky;
    const uint kz = 4 * packet->kz;
    RelativeTriangle16 triangle;
    triangle.ax = at[kx] - CASTOR_COLUMN(packet, origin_x);
    triangle.ay = at[ky] - CASTOR_COLUMN(packet, origin_y);
    triangle.az = at[kz] - CASTOR_COLUMN(packet, origin_z);
    triangle.bx = at[12 + kx] - CASTOR_COLUMN(packet, origin_x);
    triangle.by = at[12 + ky] - CASTOR_COLUMN(packet, origin_y);
    triangle.bz = at[12 + kz] - CASTOR_COLUMN(packet, origin_z);
    triangle.cx = at[24 + kx] - CASTOR_COLUMN(packet, origin_x);
    triangle.cy = at[24 + ky] - CASTOR_COLUMN(packet, origin_y);
    triangle.cz = at[24 + kz] - CASTOR_COLUMN(packet, origin_z);
    const Shear16 shear = shear_of_group16(packet->rays, 0);
    const RelativeTriangle16 sheared = shear_triangle16(shear, triangle);
    const uint primitive = block->primitive[place];
    TriangleWeights16 weights;
    if (!find_weights_in_triangle(scene, sheared, primitive, &weights)) return 0;
    const float3 p0 = corner_of_block(at), p1 = corner_of_block(at + 12), p2 = corner_of_block(at + 24);
    const BoxPlanes16 planes = planes_of_box_together(packet, lower_corner(p0, p1, p2), upper_corner(p0, p1, p2));
    return accept_group_hits(packet->rays, planes, triangle_hits16(shear, sheared, weights), primitive);
}

#if CASTOR_REGISTERS_OF_16
CASTOR_INLINE float16 four_times(const float4 v) { return (float16)(v, v, v, v); }

// Returns which of a block's triangles four rays of the bundle may hit, as bits: four for each ray. `rays`: each ray's
// place, four times.
CASTOR_INLINE uint may_hit_block(const Packet *packet, const global TriangleBlock *block, const uint16 rays)
{
    const global float4 *along_x = (const global float4 *)block + packet->kx;
    const global float4 *along_y = (const global float4 *)block + packet->ky;
    const global float4 *along_z = (const global float4 *)block + packet->kz;
    const float16 origin_x = permute_16(CASTOR_COLUMN(packet, origin_x), rays);
    const float16 origin_y = permute_16(CASTOR_COLUMN(packet, origin_y), rays);
    const float16 origin_z = permute_16(CASTOR_COLUMN(packet, origin_z), rays);
    RelativeTriangle16 triangle;
    triangle.ax = four_times(along_x[0]) - origin_x;
    triangle.ay = four_times(along_y[0]) - origin_y;
    triangle.az = four_times(along_z[0]) - origin_z;
    triangle.bx = four_times(along_x[3]) - origin_x;
    triangle.by = four_times(along_y[3]) - origin_y;
    triangle.bz = four_times(along_z[3]) - origin_z;
    triangle.cx = four_times(along_x[6]) - origin_x;
    triangle.cy = four_times(along_y[6]) - origin_y;
    triangle.cz = four_times(along_z[6]) - origin_z;
    Shear16 shear;
    shear.x = permute_16(CASTOR_COLUMN(packet, shear_x), rays);
    shear.y = permute_16(CASTOR_COLUMN(packet, shear_y), rays);
    shear.z = permute_16(CASTOR_COLUMN(packet, shear_z), rays);
    return mask_of16(may_hit_triangle16(shear_triangle16(shear, triangle)));
}

// Tests a leaf block against rays of the bundle, given as bits, no more than four: together first, and those that may
// hit anything each by itself. Returns the rays that have a better hit now, as bits.
CASTOR_INLINE uint visit_block_by_few(Packet *packet, const SceneColumns scene, const global TriangleBlock *block,
                                      const uint entering)
{
    const uint16 places = some_side_by_side_16(lane_numbers16(), entering);
    const uint16 four = (uint16)((uint4)(0), (uint4)(1), (uint4)(2), (uint4)(3));
    uint may_hit = may_hit_block(packet, block, as_uint16(permute_16(as_float16(places), four)));
    uint better = 0;
    for (uint left = entering; left; left &= left - 1, may_hit >>= 4) {
        CASTOR_COUNT(scene, TRIANGLE_BLOCK);
        if ((may_hit & 15u) && visit_triangle_block(packet->rays, lowest_bit(left), scene, block))
            better |= left & (0u - left);
    }
    return better;
}
#endif

#if CASTOR_HAS_SPHERES
// Tests one sphere of a leaf block against the bundle. Returns the rays that have a better hit now, as bits.
CASTOR_INLINE uint visit_sphere_together(Packet *packet, const global SphereBlock *block, const uint place)
{
    const float3 center =
        (float3)(block->center_radius[0][place], block->center_radius[1][place], block->center_radius[2][place]);
    const float radius = block->center_radius[3][place];
    int is_missed;
    const PrimitiveHits16 hits = group_hits_of_sphere(packet->rays, center, radius, &is_missed);
    if (is_missed) return 0;
    return accept_group_hits(packet->rays, planes_of_box_together(packet, center - radius, center + radius), hits,
                             block->primitive[place]);
}
#endif

#if CASTOR_HAS_SPHERES
// As visit_leaf_together, for a leaf of spheres.
CASTOR_INLINE uint visit_spheres_together(Packet *packet, const SceneColumns scene, const uint leaf,
                                          const uint entering)
{
    if (popcount(entering) <= CASTOR_PACKET_FEW_AT_SPHERES) {
        for (uint left = entering; left; left &= left - 1) visit_leaf(packet->rays, lowest_bit(left), scene, leaf);
        return entering & rays_with_hit(packet->rays);
    }
    uint better = 0;
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        const global SphereBlock *block = scene.sphere_blocks + i;
        for (uint place = 0; place < 4 && block->primitive[place] != CASTOR_INVALID_INDEX; ++place) {
            CASTOR_COUNT(scene, BUNDLE_SPHERE);
            better |= visit_sphere_together(packet, block, place);
        }
    }
    return better;
}
#endif

// Tests a leaf against the rays of the bundle that enter it, given as bits; a hit after `limit` is none. Returns
// the rays that may have a better hit now, as bits: for any hit, those that have one.
CASTOR_INLINE uint visit_leaf_together(Packet *packet, const SceneColumns scene, const uint leaf, const uint entering,
                                       const float limit, const int wants_any, PacketHistory *history)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) return visit_spheres_together(packet, scene, leaf, entering);
#endif
    uint better = 0;
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        const global TriangleBlock *block = scene.triangle_blocks + i;
        uint triangles = 1;
        while (triangles < 4 && block->primitive[triangles] != CASTOR_INVALID_INDEX) ++triangles;
        if (is_few_at_block(popcount(entering), triangles, wants_any)) {
#if CASTOR_REGISTERS_OF_16
            if (CASTOR_PACKET_RAYS_JOIN(wants_any) && popcount(entering) > 1) {
                better |= visit_block_by_few(packet, scene, block, entering);
                continue;
            }
#endif
            for (uint left = entering; left; left &= left - 1) {
                CASTOR_COUNT(scene, TRIANGLE_BLOCK);
                if (visit_triangle_block(packet->rays, lowest_bit(left), scene, block)) better |= left & (0u - left);
            }
            continue;
        }
        uint reached = (1u << triangles) - 1;
        if (triangles >= CASTOR_PACKET_LEAST_BOXES && do_own_boxes_pay(history)) {
            CASTOR_COUNT(scene, BUNDLE_BLOCK);
            reached &= triangles_in_reach(packet, block, limit);
            history->own_boxes += triangles;
            history->entered_boxes += popcount(reached);
        }
        for (; reached; reached &= reached - 1)
            better |= visit_triangle_together(packet, scene, block, lowest_bit(reached));
    }
    return better;
}

// Returns the greatest best t of the bundle, and for any hit when the last ray ends: nothing beyond it matters.
CASTOR_INLINE float packet_limit(const Packet *packet, const int wants_any)
{
    return wants_any ? packet->greatest_t_max : greatest_of_16(CASTOR_COLUMN(packet, best_t));
}

// Leaves the other rays than these, given as bits, no range in which there could be a hit: a bundle tests all sixteen
// along its own axes.
CASTOR_INLINE void keep_only_ranges(RayGroup *rays, const uint mask)
{
    if (mask == 0xffffu) return;
    store_reals16(lanes_of_mask16(mask) ? vload16(0, rays->best_t) : (float16)(-INFINITY), rays->best_t);
}

// Tests the leaf that occluded earlier groups, if any, against the rays of this one.
CASTOR_NOINLINE void test_last_occluder(RayGroup *rays, const SceneColumns scene, PacketHistory *history)
{
    if (history->occluder == CASTOR_INVALID_INDEX) return;
    keep_only_ranges(rays, rays->valid);
    const uint before = rays_with_hit(rays);
    visit_leaf_by_group(rays, scene, history->occluder);
    if (popcount(rays_with_hit(rays) & ~before) < CASTOR_OCCLUDER_KEPT) history->occluder = CASTOR_INVALID_INDEX;
}

// The children that a bundle has yet to visit. For the nearest hit: as for a ray, and the nodes whose children they
// are. For any hit: nodes, and their children as bits, in any order. CASTOR_INVALID_INDEX in place of the child, or of
// the node: below lies what waits in the world.
typedef struct WaitingBundles {
    WaitingStack stack;
    uint node[CASTOR_WAITING];
    uint children[CASTOR_WAITING];
} WaitingBundles;

// A child of a node. Functions return it through a pointer: as a value PoCL 3.1 puts node and place together, and takes
// them apart again, in one number.
typedef struct ChildPlace {
    uint node, place, child;
} ChildPlace;

// Returns the key of the child that sorted_keys has last. At least one is entered.
CASTOR_INLINE uint first_key(const int8 entered, const uint8 keys, const int wants_any)
{
    return wants_any ? greatest_of_8(as_uint8(entered) & keys) : least_of_8(~as_uint8(entered) | keys);
}

// Finds the child to visit first of those of a node that are entered, at least one, and adds the others to those that
// wait. `entry` counts from the bundle's start.
CASTOR_INLINE void push_children(WaitingBundles *bundles, uint *count, const global WideNode *nodes, const uint node,
                                 const int8 entered, const float8 entry, const int wants_any, ChildPlace *first)
{
    const uint8 keys = keys_of_children(entry);
    const uint mask = mask_of8(entered);
    first->node = node;
    first->place = first_key(entered, keys, wants_any) & CASTOR_KEY_PLACE;
    first->child = nodes[node].child[first->place];
    if (wants_any) {
        const uint others = mask & ~(1u << first->place);
        bundles->node[*count] = node;
        bundles->children[*count] = others;
        *count += others ? 1 : 0;
    } else {
        const uint8 sorted = sorted_keys(entered, keys, wants_any);
        vstore8(sorted, 0, bundles->stack.key + *count);
        vstore8(permute_8(*(const global uint8 *)nodes[node].child, sorted), 0, bundles->stack.child + *count);
        vstore8((uint8)(node), 0, bundles->node + *count);
        *count += popcount(mask) - 1;
    }
}

// Takes a child from those that wait, of which there is at least one.
CASTOR_INLINE void take_child(WaitingBundles *bundles, uint *count, const global WideNode *nodes, const int wants_any,
                              ChildPlace *taken)
{
    const uint top = *count - 1;
    taken->node = bundles->node[top];
    if (wants_any) {
        const uint children = bundles->children[top];
        taken->place = 31u - clz(children);
        const uint others = children ^ (1u << taken->place);
        bundles->children[top] = others;
        *count = top + (others ? 1 : 0);
        taken->child = CASTOR_HAS_INSTANCES && taken->node == CASTOR_INVALID_INDEX
                           ? taken->node
                           : nodes[taken->node].child[taken->place];
    } else {
        *count = top;
        taken->place = bundles->stack.key[top] & CASTOR_KEY_PLACE;
        taken->child = bundles->stack.child[top];
    }
}

#if CASTOR_HAS_INSTANCES
// Adds what take_child finds as CASTOR_INVALID_INDEX.
CASTOR_INLINE void push_end_of_instance(WaitingBundles *bundles, uint *count)
{
    bundles->stack.key[*count] = 0;
    bundles->stack.child[*count] = CASTOR_INVALID_INDEX;
    bundles->node[*count] = CASTOR_INVALID_INDEX;
    bundles->children[*count] = 1;
    ++*count;
}
#endif

#if CASTOR_HAS_INSTANCES
// Returns the padding of bundles for the tree over instances.
CASTOR_INLINE PacketPadding padding_for_instances(const SceneColumns scene)
{
    const Bounds bounds = bounds_of_node(scene.wide_instance_nodes);
    const float3 farthest = larger3(fabs(bounds.lower), fabs(bounds.upper));
    const float largest_coordinate = larger(farthest.x, larger(farthest.y, farthest.z));
    const PacketPadding padding = {CASTOR_PACKET_OWN_PADDING * largest_coordinate,
                                   fma(CASTOR_PACKET_SLOPE, scene.instance_nodes[0].slope, CASTOR_PACKET_OWN_PADDING)};
    return padding;
}
#endif

// Traverses the tree for the bundle, from the root on; `over_instances` as for trace_lanes. Adds to `history`. Returns
// 0 where the rays have yet to traverse the tree, each by itself, with what they have hit so far. From a node it goes
// on to the first child at once: that takes half the time of the sorting network, which puts the others on the stack
// meanwhile. Among thin boxes bundles are faster by a sixth for it (AMD Zen 5).
CASTOR_INLINE int trace_packet(Packet *packet, const SceneColumns scene, const int over_instances, const int wants_any,
                               PacketHistory *history, WaitingBundles *bundles, WaitingStack *waiting)
{
    float limit = packet_limit(packet, wants_any);
    uint count = 0;
#if CASTOR_HAS_INSTANCES
    const global WideNode *nodes = over_instances ? scene.wide_instance_nodes : scene.wide_nodes;
    uint node_index = over_instances ? 0 : scene.params.wide_root;
    Packet *const world = packet;
    RayGroup objects;
    Packet in_instance;
    uint instance = 0;  // of `objects`
#else
    const global WideNode *const nodes = scene.wide_nodes;
    uint node_index = scene.params.wide_root;
#endif
    while (1) {
        const global WideNode *node = nodes + node_index;
        CASTOR_COUNT(scene, BUNDLE_NODE);
        add_work(history, 1, 0, wants_any);
        float8 entry;
        const int8 entered = enter_children_together(packet, node, limit, &entry);
        int is_first = mask_of8(entered) != 0;
        ChildPlace next = {node_index, 0, 0};
        if (is_first)
            push_children(bundles, &count, nodes, node_index, entered, wants_any ? entry - packet->least_t_min : entry,
                          wants_any, &next);

        // Children that few rays enter, and leaves, are finished here; the bundle enters the first other one.
        node_index = CASTOR_INVALID_INDEX;
        while (node_index == CASTOR_INVALID_INDEX) {
            if (!is_first) {
                if (count == 0) return 1;
                take_child(bundles, &count, nodes, wants_any, &next);
#if CASTOR_HAS_INSTANCES
                if (next.child == CASTOR_INVALID_INDEX) {  // all of the instance is done
                    take_hits_of_instance(world->rays, &objects, instance);
                    packet = world;
                    nodes = scene.wide_instance_nodes;
                    if (wants_any) packet->active &= ~rays_with_hit(packet->rays);
                    limit = packet_limit(packet, wants_any);
                    continue;
                }
#endif
                if (wants_any ? !packet->active : !is_near(bundles->stack.key[count], limit)) continue;
            }
            is_first = 0;
            const uint child = next.child;
            CASTOR_COUNT(scene, BUNDLE_BOX);
            const uint entering = rays_in_child(packet, nodes + next.node, next.place);
            add_work(history, 1, popcount(entering), wants_any);
            if (!entering) continue;
#if CASTOR_HAS_INSTANCES
            const int is_in_world = over_instances && packet == world;
#else
            const int is_in_world = 0;
#endif
            if (!(child & CASTOR_WIDE_LEAF)) {
                if (popcount(entering) > CASTOR_PACKET_FEW_AT_NODE) {
                    if (is_slower_together(*history, wants_any)) return 0;
                    node_index = child;
                    continue;
                }
                trace_rays(packet->rays, &scene, entering, is_in_world, child, wants_any, waiting);
#if CASTOR_HAS_INSTANCES
            } else if (is_in_world) {
                instance = child & ~CASTOR_WIDE_LEAF;
                if (!make_object_rays(&objects, world->rays, scene, entering, instance)) continue;
                const uint geometry = scene.instances[instance].geometry;
                const uint root = scene.wide_roots[geometry];
                if (rays_like_first(&objects, objects.valid) == objects.valid) {
                    keep_only_ranges(&objects, objects.valid);
                    make_packet(&in_instance, &objects, objects.valid,
                                padding_for_boxes(scene.geometries[geometry].largest_coordinate), wants_any);
                    push_end_of_instance(bundles, &count);
                    packet = &in_instance;
                    nodes = scene.wide_nodes;
                    limit = packet_limit(packet, wants_any);
                    node_index = root;
                    continue;
                }
                trace_divergent(&objects, &scene, objects.valid, root, wants_any, waiting);
                take_hits_of_instance(world->rays, &objects, instance);
#endif
            } else {
                const uint blocks = end_block(child) - first_block(child);
                add_work(history, 2 * blocks, (blocks - 1) * popcount(entering), wants_any);
                const uint better = visit_leaf_together(packet, scene, child, entering, limit, wants_any, history);
                if (!better) continue;
                if (wants_any) {
                    if (!over_instances && popcount(better & entering) >= CASTOR_OCCLUDER_FOUND)
                        history->occluder = child;
                    packet->active &= ~better;
                    if (!CASTOR_HAS_INSTANCES && !packet->active) return 1;
                    continue;
                }
            }
            if (wants_any) packet->active &= ~rays_with_hit(packet->rays);
            limit = packet_limit(packet, wants_any);
        }
    }
}

// PoCL takes long to compile a traversal, so that there is one of them, also where it is called twice.
#if CASTOR_HAS_INSTANCES
#define CASTOR_TRAVERSAL CASTOR_NOINLINE
#else
#define CASTOR_TRAVERSAL CASTOR_INLINE
#endif

// A group whose rays are not all alike is several bundles for any hit: of at least so many rays each that are alike.
// For the nearest hit this did not pay: diffuse rays are slower by up to a tenth (Intel Xeon, Emerald Rapids).
#ifndef CASTOR_PACKET_LEAST_ALIKE
#define CASTOR_PACKET_LEAST_ALIKE 5u
#endif

// The others go on each by itself, in place of together, where there are no more of them than these.
#ifndef CASTOR_PACKET_FEW_UNLIKE
#define CASTOR_PACKET_FEW_UNLIKE 4
#endif

// What is left of a group of rays in a tree.
typedef struct LeftRays {
    uint rays;      // that have yet to traverse the tree, as bits
    int is_unlike;  // 1: too unlike for a bundle
} LeftRays;

// Traces the group's rays through a tree as a bundle, where they are alike. `over_instances` as for trace_lanes.
CASTOR_TRAVERSAL LeftRays trace_group(RayGroup *rays, const SceneColumns *scene, const int over_instances,
                                      const PacketPadding padding, const int wants_any, PacketHistory *history,
                                      WaitingStack *waiting)
{
    LeftRays left = {rays->valid, 0};
    if (wants_any) {
        if (!over_instances) test_last_occluder(rays, *scene, history);
        left.rays &= ~rays_with_hit(rays);
    }
    if (!left.rays || is_slower_together(*history, wants_any)) return left;
    Packet packet;
    WaitingBundles bundles;
    uint ahead = left.rays;
    const uint least = min((uint)popcount(ahead), wants_any ? CASTOR_PACKET_LEAST_ALIKE : CASTOR_GROUP_RAYS);
    left.rays = 0;
    while (popcount(ahead) >= least) {
        const uint alike = rays_like_first(rays, ahead);
        ahead &= ~alike;
        if (popcount(alike) < least) {
            left.rays |= alike;
            continue;
        }
        make_packet(&packet, rays, alike, padding, wants_any);
        const float16 best_t = vload16(0, rays->best_t);
        keep_only_ranges(rays, alike);
        const int is_done = trace_packet(&packet, *scene, over_instances, wants_any, history, &bundles, waiting);
        if (alike != 0xffffu) store_reals16(lanes_of_mask16(alike) ? vload16(0, rays->best_t) : best_t, rays->best_t);
        if (!is_done) {
            left.rays |= ahead | (alike & unended_rays(rays, wants_any));
            return left;
        }
    }
    left.rays |= ahead;
    left.is_unlike = popcount(left.rays) > CASTOR_PACKET_FEW_UNLIKE;
    return left;
}

#if CASTOR_REGISTERS_OF_16
// Traces rays of a group, given as bits, that are too unlike for a bundle, together through the upper tree. Returns
// what trace_together does. The other rays keep their ranges.
CASTOR_INLINE uint trace_unlike(RayGroup *group, const SceneColumns *scene, const uint rays, const int wants_any,
                                DeferredChildren *deferred, WaitingStack *waiting)
{
    const float16 t_min = vload16(0, group->t_min), best_t = vload16(0, group->best_t);
    const uint left = trace_together(group, scene, rays, 0, scene->params.wide_root, wants_any, deferred, waiting);
    const int16 takes_part = lanes_of_mask16(rays);
    store_reals16(takes_part ? vload16(0, group->t_min) : t_min, group->t_min);
    store_reals16(takes_part ? vload16(0, group->best_t) : best_t, group->best_t);
    return left;
}
#endif

// Adds rays of a group, given as bits, to `places` as trace_lanes takes them. Returns the number of all.
CASTOR_INLINE uint add_places(ushort *places, uint count, const uint group, uint rays)
{
    for (; rays; rays &= rays - 1) places[count++] = (ushort)(group * CASTOR_GROUP_RAYS + lowest_bit(rays));
    return count;
}

// Traces rays [begin, end) of the columns, at most CASTOR_WIDE_BATCH: first in bundles, then what is left of them.
CASTOR_NOINLINE void trace_bundles(const SceneColumns scene, const uint begin, const uint end, const int wants_any,
                                   const global float4 *restrict ray_origin_tmin,
                                   const global float4 *restrict ray_direction_tmax, global Hit *hits,
                                   global uchar *occluded)
{
    const Bounds bounds = bounds_of_scene(scene);
    const int has_tree = scene.params.wide_root != CASTOR_INVALID_INDEX;
    const PacketPadding padding = padding_for_boxes(scene.params.largest_coordinate);
    PacketHistory history = {0, 0, CASTOR_INVALID_INDEX, 0, 0};
    WaitingStack waiting[CASTOR_WIDE_LANES];
    ushort places[CASTOR_WIDE_BATCH];
    uint place_count = 0;
#if CASTOR_HAS_INSTANCES
    const int has_instances = scene.params.instance_node_count > 0;
    const PacketPadding instance_padding = padding_for_instances(scene);
    PacketHistory instance_history = {0, 0, CASTOR_INVALID_INDEX, 0, 0};
    ushort instance_places[CASTOR_WIDE_BATCH];
    uint instance_place_count = 0;
#endif

    // The groups of which rays are left in the first tree, in `left`, or in that over instances.
    RayGroup groups[CASTOR_PACKET_GROUPS] __attribute__((aligned(64)));
    uint group_begin[CASTOR_PACKET_GROUPS];
    LeftRays left[CASTOR_PACKET_GROUPS];
    uint group_count = 0;
    for (uint first = begin; first < end; first += CASTOR_GROUP_RAYS) {
        const uint group_end = min(first + CASTOR_GROUP_RAYS, end);
        RayGroup *group = &groups[group_count];
        make_ray_group(group, scene, bounds, first, group_end, wants_any, ray_origin_tmin, ray_direction_tmax, hits,
                       occluded);
        LeftRays left_here = {0, 0};
        if (group->valid && has_tree) left_here = trace_group(group, &scene, 0, padding, wants_any, &history, waiting);
        int is_done = !left_here.rays;
#if CASTOR_HAS_INSTANCES
        if (is_done && group->valid && has_instances) {
            turn_to_instances(group, scene, first);
            const uint rays =
                trace_group(group, &scene, 1, instance_padding, wants_any, &instance_history, waiting).rays;
            instance_place_count = add_places(instance_places, instance_place_count, group_count, rays);
            is_done = !rays;
        }
#endif
        if (is_done) {
            write_answers(group, scene, first, group_end, wants_any, hits, occluded);
            continue;
        }
        left[group_count] = left_here;
        group_begin[group_count++] = first;
    }

#if CASTOR_REGISTERS_OF_16
    DeferredChildren deferred[CASTOR_PACKET_GROUPS];
#else
    DeferredChildren *const deferred = 0;
#endif
    for (uint i = 0; i < group_count; ++i) {
        uint rays = left[i].rays;
#if CASTOR_REGISTERS_OF_16
        if (left[i].is_unlike && !is_slower_together(history, wants_any))
            rays = trace_unlike(&groups[i], &scene, rays, wants_any, &deferred[i], waiting);
        else
            defer_root(&deferred[i], scene.params.wide_root);
#endif
        place_count = add_places(places, place_count, i, rays);
    }
    trace_lanes(&scene, groups, places, place_count, 0, scene.params.wide_root, wants_any, deferred, waiting);
#if CASTOR_HAS_INSTANCES
    for (uint i = 0; has_instances && i < group_count; ++i) {
        if (!left[i].rays) continue;  // it is among instances already
        turn_to_instances(&groups[i], scene, group_begin[i]);
        instance_place_count =
            add_places(instance_places, instance_place_count, i, unended_rays(&groups[i], wants_any));
    }
    trace_lanes(&scene, groups, instance_places, instance_place_count, 1, 0, wants_any, 0, waiting);
#endif
    for (uint i = 0; i < group_count; ++i)
        write_answers(&groups[i], scene, group_begin[i], min(group_begin[i] + CASTOR_GROUP_RAYS, end), wants_any, hits,
                      occluded);
}
