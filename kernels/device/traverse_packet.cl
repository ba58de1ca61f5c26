// Traverses the 8-wide tree for a bundle of 16 coherent rays: one interval test of a node's eight boxes for the whole
// bundle, then vectors over rays. Where few rays of the bundle enter a child, each of them may go on alone.
//
// The interval test may only say no where every ray's own test (enter_children) says no. Those compute, for a plane p,
// near or far, p * inverse + offset with offset = -(o * inverse) -+ padding * |inverse|, and the rounding of these
// takes at most 4 of the 64 units of CASTOR_BOX_PADDING. The bundle's bound is the least (greatest) of (p - o) *
// inverse over the corners of the bundle's intervals of o and inverse, enlarged by CASTOR_PACKET_PADDING, which is
// another 32 units, where 8 are needed: 4 for their rounding and 4 for its own.
//
// For any hit, where nothing is compared with times of hits, two things make the intervals smaller. Times of each ray
// are multiplied by its speed along the longest axis, as if all directions had been given with the same component
// there: each inverse is rounded once more for it, which takes 2 units. And in place of the origins a bundle may have
// the ends of its rays, from where all times count then: shadow rays end at the same light, or near it, however far
// from each other they begin. An end is o + t_max / inverse; its rounding takes at most 7 units of the largest
// coordinate of origins and ends (division may be wrong by 2.5 ulp), and that of t_min - t_max 2.
#define CASTOR_GROUPS_HAVE_ORIGINS 1
#include "castor/shared/layout.h"
#include "device/object_ray.x16.cl"
#include "device/traverse_divergent.cl"

// In the tree over instances, a ray's own padding is the slope of InstanceNode times its origin's largest coordinate,
// which two roundings change by less than a part in 10^4.
#define CASTOR_PACKET_PADDING (1.5f * CASTOR_BOX_PADDING)
#define CASTOR_PACKET_OWN_PADDING (0.5f * CASTOR_BOX_PADDING)
#define CASTOR_PACKET_SLOPE 1.0001f

// What the groups of a batch so far tell of the next one.
typedef struct PacketHistory {
    // What bundles have cost, and what their rays would have cost each by itself, in steps that take about the same
    // time: a node, a box and half a leaf block of a bundle, and a node or a leaf block of a ray.
    uint together, alone;
    uint occluder;  // a leaf that has occluded many rays; CASTOR_INVALID_INDEX: none
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
#define CASTOR_PACKET_LEAST_ALONE_ANY 9u
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

// How far a bundle's bounds are enlarged: by fixed + per_origin * (largest coordinate of the origins), which is then
// multiplied by the inverse.
typedef struct PacketPadding {
    float fixed, per_origin;
} PacketPadding;

CASTOR_INLINE PacketPadding padding_for_boxes(const float largest_coordinate)
{
    const PacketPadding padding = {CASTOR_PACKET_PADDING * largest_coordinate, CASTOR_PACKET_PADDING};
    return padding;
}

// With no more rays than these that enter a node, or a leaf of spheres, these rays go on alone. Where a register holds
// something of all sixteen, a step of the bundle takes no longer than that of a ray, and they never do, but for nodes
// among instances.
#ifndef CASTOR_PACKET_FEW_AT_NODE
#define CASTOR_PACKET_FEW_AT_NODE (!CASTOR_REGISTERS_OF_16 ? 3 : CASTOR_HAS_INSTANCES ? 2 : 0)
#endif
#ifndef CASTOR_PACKET_FEW_AT_SPHERES
#define CASTOR_PACKET_FEW_AT_SPHERES (CASTOR_REGISTERS_OF_16 ? 0 : 3)
#endif

// Tells whether rays that enter a leaf are so few that each of them is tested alone against a block of `triangles`, all
// of them at once. A bundle is tested against one triangle at a time.
#ifndef CASTOR_PACKET_IS_FEW_AT_BLOCK
#define CASTOR_PACKET_IS_FEW_AT_BLOCK(rays, triangles) (CASTOR_REGISTERS_OF_16 ? (rays) < (triangles) : (rays) <= 8)
#endif

// A group of rays that are alike, and the bounds of all of them.
typedef struct Packet {
    RayGroup *rays;  // best_t is -INFINITY for one that takes no part any more
    float3 least_inverse, greatest_inverse;
    float3 least_origin, greatest_origin;  // or of the rays' ends
    float3 padding;                        // of (p - o) * inverse
    float least_t_min, greatest_t_max;     // the latter for any hit alone
    uint near_x, near_y, near_z;
    uint kx, ky, kz;
} Packet;

#define CASTOR_COLUMN(packet, name) vload16(0, (packet)->rays->name)

CASTOR_INLINE float3 smaller3(const float3 a, const float3 b) { return a < b ? a : b; }
CASTOR_INLINE float3 larger3(const float3 a, const float3 b) { return a > b ? a : b; }

CASTOR_INLINE float greatest_of_16(const float16 v)
{
    const float8 a = larger8(v.lo, v.hi);
    const float4 b = larger4(a.lo, a.hi);
    const float2 c = b.lo > b.hi ? b.lo : b.hi;
    return larger(c.x, c.y);
}

// Tells whether the valid rays agree in what `bits` says of each.
CASTOR_INLINE int agree(const uint bits, const uint valid) { return (bits & valid) == 0 || (bits & valid) == valid; }

// Bounds of a point of each ray of a bundle, and the least t_min, counted from these points.
typedef struct PointBounds {
    float3 least, greatest;
    float least_t_min;
} PointBounds;

CASTOR_INLINE PointBounds bounds_of_points(const int16 counts, const float16 x, const float16 y, const float16 z,
                                           const float16 t_min)
{
    const float16 nothing = (float16)(INFINITY);
    const float4 least =
        least_of_four_16(counts ? x : nothing, counts ? y : nothing, counts ? z : nothing, counts ? t_min : nothing);
    PointBounds bounds;
    bounds.least = least.xyz;
    bounds.greatest =
        -least_of_four_16(counts ? -x : nothing, counts ? -y : nothing, counts ? -z : nothing, nothing).xyz;
    bounds.least_t_min = least.w;
    return bounds;
}

CASTOR_INLINE float largest_coordinate_in(const PointBounds bounds)
{
    const float3 farthest = larger3(fabs(bounds.least), fabs(bounds.greatest));
    return larger(farthest.x, larger(farthest.y, farthest.z));
}

// Returns about how far points of a bundle's rays lie apart: by those of two rays, and with what their coordinates add
// to the bundle's padding.
CASTOR_INLINE float spread_of_points(const float16 x, const float16 y, const float16 z, const uint first,
                                     const uint last, const PacketPadding padding)
{
    float at[3][CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
    store_reals16(x, at[0]);
    store_reals16(y, at[1]);
    store_reals16(z, at[2]);
    float sum = 0.0f;
    for (uint i = 0; i < 3; ++i)
        sum += fabs(at[i][first] - at[i][last]) + 2.0f * padding.per_origin * fabs(at[i][first]);
    return sum;
}

// Makes a bundle of rays of the group, given as bits, of which there is at least one. Returns 0 if they are too unlike:
// signs or longest axes differ.
CASTOR_NOINLINE int make_packet(Packet *packet, RayGroup *rays, const uint valid, const PacketPadding padding,
                                const int wants_any)
{
    packet->rays = rays;
    const uint leader = lowest_bit(valid);
    packet->near_x = rays->near_x[leader];
    packet->near_y = rays->near_y[leader];
    packet->near_z = rays->near_z[leader];
    packet->kx = rays->kx[leader];
    packet->ky = rays->ky[leader];
    packet->kz = rays->kz[leader];
    float16 ix = vload16(0, rays->inverse_x);
    float16 iy = vload16(0, rays->inverse_y);
    float16 iz = vload16(0, rays->inverse_z);
    if (!agree(mask_of16(ix < 0.0f), valid) || !agree(mask_of16(iy < 0.0f), valid) ||
        !agree(mask_of16(iz < 0.0f), valid) || !agree(mask_of16(as_int16(vload16(0, rays->kz) == packet->kz)), valid))
        return 0;

    // Rays that do not count bound nothing.
    const int16 counts = lanes_of_mask16(valid);
    const float16 nothing = (float16)(INFINITY);
    const float16 ox = vload16(0, rays->world_origin_x);
    const float16 oy = vload16(0, rays->world_origin_y);
    const float16 oz = vload16(0, rays->world_origin_z);
    float16 t_min = vload16(0, rays->t_min), t_max = vload16(0, rays->best_t);
    if (valid != 0xffffu) store_reals16(counts ? t_max : (float16)(-INFINITY), rays->best_t);
    if (wants_any) {  // times by which all go equally far along the longest axis
        const float16 speed = 1.0f / fabs(packet->kz == 0 ? ix : packet->kz == 1 ? iy : iz);
        ix *= speed;
        iy *= speed;
        iz *= speed;
        t_min *= speed;
        t_max *= speed;
    }
    packet->least_inverse =
        least_of_four_16(counts ? ix : nothing, counts ? iy : nothing, counts ? iz : nothing, nothing).xyz;
    const float4 greatest = -least_of_four_16(counts ? -ix : nothing, counts ? -iy : nothing, counts ? -iz : nothing,
                                              counts ? -t_max : nothing);
    packet->greatest_inverse = greatest.xyz;
    PointBounds bounds = {(float3)(0.0f), (float3)(0.0f), 0.0f};
    float farthest = INFINITY;
    if (wants_any) {
        const float16 end_x = ox + t_max / ix, end_y = oy + t_max / iy, end_z = oz + t_max / iz;
        const uint last = 31 - clz(valid);
        if (spread_of_points(end_x, end_y, end_z, leader, last, padding) <
            spread_of_points(ox, oy, oz, leader, last, padding)) {
            const float16 of_origin = larger16(fabs(ox), larger16(fabs(oy), fabs(oz)));
            bounds = bounds_of_points(counts, end_x, end_y, end_z, t_min - t_max);
            farthest = larger(largest_coordinate_in(bounds), greatest_of_16(counts ? of_origin : (float16)(0.0f)));
            packet->greatest_t_max = 0.0f;
        }
    }
    if (!(farthest <= CASTOR_MAX_COORDINATE)) {  // of the origins it never is more
        bounds = bounds_of_points(counts, ox, oy, oz, t_min);
        farthest = largest_coordinate_in(bounds);
        packet->greatest_t_max = greatest.w;
    }
    packet->least_t_min = bounds.least_t_min;
    packet->least_origin = bounds.least;
    packet->greatest_origin = bounds.greatest;
    packet->padding = fma(padding.per_origin, farthest, padding.fixed) *
                      larger3(fabs(packet->least_inverse), fabs(packet->greatest_inverse));
    return 1;
}

CASTOR_INLINE float16 plane_of_child(const global uchar *node, const uint bytes)
{
    return (float16)(*(const global float *)(node + bytes));
}

// Returns the rays of the bundle that enter the box at `place` of the node no later than their best hit, as bits.
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
    return mask_of16(interval.entry <= interval.exit);
}

// Bound (p - o) * inverse over the bundle, for eight planes of one axis. Where inverse is positive, it is least at the
// greatest origin.
CASTOR_INLINE float8 least_entry(const float8 plane, const float origin, const float least, const float greatest,
                                 const float padding)
{
    const float8 d = plane - origin;
    return smaller8(fma(d, (float8)(least), (float8)(-padding)), fma(d, (float8)(greatest), (float8)(-padding)));
}

CASTOR_INLINE float8 greatest_exit(const float8 plane, const float origin, const float least, const float greatest,
                                   const float padding)
{
    const float8 d = plane - origin;
    return larger8(fma(d, (float8)(least), (float8)(padding)), fma(d, (float8)(greatest), (float8)(padding)));
}

// Returns the children that some ray of the bundle may enter no later than `limit`, all ones; *entry is a lower bound
// of when.
CASTOR_INLINE int8 enter_children_together(const Packet *packet, const global WideNode *wide_node, const float limit,
                                           float8 *entry)
{
    const BoxPlanes8 planes = planes_of_children(wide_node, packet->near_x, packet->near_y, packet->near_z);
    const float3 low = packet->least_inverse;
    const float3 high = packet->greatest_inverse;
    const float near_ox = low.x < 0.0f ? packet->least_origin.x : packet->greatest_origin.x;
    const float near_oy = low.y < 0.0f ? packet->least_origin.y : packet->greatest_origin.y;
    const float near_oz = low.z < 0.0f ? packet->least_origin.z : packet->greatest_origin.z;
    const float far_ox = low.x < 0.0f ? packet->greatest_origin.x : packet->least_origin.x;
    const float far_oy = low.y < 0.0f ? packet->greatest_origin.y : packet->least_origin.y;
    const float far_oz = low.z < 0.0f ? packet->greatest_origin.z : packet->least_origin.z;
    const float8 entry_x = least_entry(planes.near_x, near_ox, low.x, high.x, packet->padding.x);
    const float8 entry_y = least_entry(planes.near_y, near_oy, low.y, high.y, packet->padding.y);
    const float8 entry_z = least_entry(planes.near_z, near_oz, low.z, high.z, packet->padding.z);
    const float8 exit_x = greatest_exit(planes.far_x, far_ox, low.x, high.x, packet->padding.x);
    const float8 exit_y = greatest_exit(planes.far_y, far_oy, low.y, high.y, packet->padding.y);
    const float8 exit_z = greatest_exit(planes.far_z, far_oz, low.z, high.z, packet->padding.z);
    *entry = larger8(larger8(entry_x, entry_y), larger8(entry_z, (float8)(packet->least_t_min)));
    const float8 exit = smaller8(smaller8(exit_x, exit_y), smaller8(exit_z, (float8)(limit)));
    return *entry <= exit;
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

// Tests one triangle of a leaf block against the bundle. Returns whether any ray has a better hit now.
CASTOR_INLINE int visit_triangle_together(Packet *packet, const SceneColumns scene, const global TriangleBlock *block,
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
    const TriangleWeights16 weights = weights_in_triangle(scene, sheared, primitive);
    if (!mask_of16(weights.inside)) return 0;
    const float3 p0 = corner_of_block(at), p1 = corner_of_block(at + 12), p2 = corner_of_block(at + 24);
    const BoxPlanes16 planes = planes_of_box_together(packet, lower_corner(p0, p1, p2), upper_corner(p0, p1, p2));
    return accept_group_hits(packet->rays, planes, triangle_hits16(shear, sheared, weights), primitive);
}

#if CASTOR_HAS_SPHERES
// Tests one sphere of a leaf block against the bundle. Returns whether any ray has a better hit now.
CASTOR_INLINE int visit_sphere_together(Packet *packet, const global SphereBlock *block, const uint place)
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
CASTOR_INLINE int visit_spheres_together(Packet *packet, const SceneColumns scene, const uint leaf, const uint entering)
{
    if (popcount(entering) <= CASTOR_PACKET_FEW_AT_SPHERES) {
        for (uint left = entering; left; left &= left - 1) visit_leaf(packet->rays, lowest_bit(left), scene, leaf);
        return 1;
    }
    int is_better = 0;
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        const global SphereBlock *block = scene.sphere_blocks + i;
        for (uint place = 0; place < 4 && block->primitive[place] != CASTOR_INVALID_INDEX; ++place) {
            CASTOR_COUNT(scene, BUNDLE_SPHERE);
            is_better |= visit_sphere_together(packet, block, place);
        }
    }
    return is_better;
}
#endif

// Tests a leaf against the rays of the bundle that enter it, given as bits. Returns 0 where no ray has a better hit.
CASTOR_INLINE int visit_leaf_together(Packet *packet, const SceneColumns scene, const uint leaf, const uint entering)
{
#if CASTOR_HAS_SPHERES
    if (leaf & CASTOR_WIDE_SPHERES) return visit_spheres_together(packet, scene, leaf, entering);
#endif
    int is_better = 0;
    for (uint i = first_block(leaf); i < end_block(leaf); ++i) {
        const global TriangleBlock *block = scene.triangle_blocks + i;
        uint triangles = 1;
        while (triangles < 4 && block->primitive[triangles] != CASTOR_INVALID_INDEX) ++triangles;
        if (CASTOR_PACKET_IS_FEW_AT_BLOCK(popcount(entering), triangles)) {
            for (uint left = entering; left; left &= left - 1) {
                CASTOR_COUNT(scene, TRIANGLE_BLOCK);
                visit_triangle_block(packet->rays, lowest_bit(left), scene, block);
            }
            is_better = 1;
            continue;
        }
        for (uint place = 0; place < triangles; ++place)
            is_better |= visit_triangle_together(packet, scene, block, place);
    }
    return is_better;
}

// Returns the greatest best t of the bundle: nothing beyond it matters. -INFINITY: no ray takes part any more.
CASTOR_INLINE float packet_limit(const Packet *packet, const int wants_any)
{
    const float greatest = greatest_of_16(CASTOR_COLUMN(packet, best_t));
    return wants_any && greatest > -INFINITY ? packet->greatest_t_max : greatest;
}

// Takes rays that have a hit out of the bundle, for an any-hit query.
CASTOR_INLINE void retire_decided(Packet *packet)
{
    const int16 is_decided = CASTOR_COLUMN(packet, best_primitive) != CASTOR_INVALID_INDEX;
    store_reals16(is_decided ? (float16)(-INFINITY) : CASTOR_COLUMN(packet, best_t), packet->rays->best_t);
}

// Tests the leaf that occluded earlier groups, if any, against the rays of this one.
CASTOR_NOINLINE void test_last_occluder(RayGroup *rays, const SceneColumns scene, PacketHistory *history)
{
    if (history->occluder == CASTOR_INVALID_INDEX) return;
    if (rays->valid != 0xffffu)  // no hit is within the range of the others
        store_reals16(lanes_of_mask16(rays->valid) ? vload16(0, rays->best_t) : (float16)(-INFINITY), rays->best_t);
    const uint before = rays_with_hit(rays);
    visit_leaf_by_group(rays, scene, history->occluder);
    if (popcount(rays_with_hit(rays) & ~before) < CASTOR_OCCLUDER_KEPT) history->occluder = CASTOR_INVALID_INDEX;
}

// The children that a bundle has yet to visit: as for a ray, and the nodes whose children they are.
typedef struct WaitingBundles {
    WaitingStack stack;
    uint node[CASTOR_WAITING];
} WaitingBundles;

// Returns the key of the child that sorted_keys has last. At least one is entered.
CASTOR_INLINE uint first_key(const int8 entered, const uint8 keys, const int wants_any)
{
    return wants_any ? greatest_of_8(as_uint8(entered) & keys) : least_of_8(~as_uint8(entered) | keys);
}

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
        const uint mask = mask_of8(entered);
        int is_first = mask != 0;
        uint parent = node_index, place = 0, child = 0;
        if (is_first) {
            const uint8 keys = keys_of_children(wants_any ? entry - packet->least_t_min : entry);
            const uint8 sorted = sorted_keys(entered, keys, wants_any);
            vstore8(sorted, 0, bundles->stack.key + count);
            vstore8(permute_8(*(const global uint8 *)node->child, sorted), 0, bundles->stack.child + count);
            vstore8((uint8)(node_index), 0, bundles->node + count);
            count += popcount(mask) - 1;
            place = first_key(entered, keys, wants_any) & CASTOR_KEY_PLACE;
            child = node->child[place];
        }

        // Children that few rays enter, and leaves, are finished here; the bundle enters the first other one.
        node_index = CASTOR_INVALID_INDEX;
        while (node_index == CASTOR_INVALID_INDEX) {
            if (!is_first) {
                if (count == 0) return 1;
                const uint key = bundles->stack.key[--count];
                if (key > last_key(wants_any ? limit - packet->least_t_min : limit)) continue;
                parent = bundles->node[count];
                place = key & CASTOR_KEY_PLACE;
                child = bundles->stack.child[count];
#if CASTOR_HAS_INSTANCES
                if (child == CASTOR_INVALID_INDEX) {  // all of the instance is done
                    take_hits_of_instance(world->rays, &objects, instance);
                    packet = world;
                    nodes = scene.wide_instance_nodes;
                    if (wants_any) retire_decided(packet);
                    limit = packet_limit(packet, wants_any);
                    continue;
                }
#endif
            }
            is_first = 0;
            CASTOR_COUNT(scene, BUNDLE_BOX);
            const uint entering = rays_in_child(packet, nodes + parent, place);
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
                if (make_packet(&in_instance, &objects, objects.valid,
                                padding_for_boxes(scene.geometries[geometry].largest_coordinate), wants_any)) {
                    bundles->stack.key[count] = 0;
                    bundles->stack.child[count] = CASTOR_INVALID_INDEX;
                    ++count;
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
                if (!visit_leaf_together(packet, scene, child, entering)) continue;
                if (wants_any && !over_instances &&
                    popcount(rays_with_hit(packet->rays) & entering) >= CASTOR_OCCLUDER_FOUND)
                    history->occluder = child;
            }
            if (wants_any) retire_decided(packet);
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
    left.is_unlike = !make_packet(&packet, rays, left.rays, padding, wants_any);
    if (left.is_unlike) return left;
    WaitingBundles bundles;
    const int is_done = trace_packet(&packet, *scene, over_instances, wants_any, history, &bundles, waiting);
    left.rays = is_done ? 0 : unended_rays(rays, wants_any);
    return left;
}

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
    const uint lanes = CASTOR_REGISTERS_OF_16 ? CASTOR_GROUP_RAYS : 8;
    const Bounds bounds = bounds_of_scene(scene);
    const int has_tree = scene.params.wide_root != CASTOR_INVALID_INDEX;
    const PacketPadding padding = padding_for_boxes(scene.params.largest_coordinate);
    PacketHistory history = {0, 0, CASTOR_INVALID_INDEX};
    WaitingStack waiting[CASTOR_WIDE_LANES];
    ushort places[CASTOR_WIDE_BATCH];
    uint place_count = 0;
#if CASTOR_HAS_INSTANCES
    const int has_instances = scene.params.instance_node_count > 0;
    const PacketPadding instance_padding = padding_for_instances(scene);
    PacketHistory instance_history = {0, 0, CASTOR_INVALID_INDEX};
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
        make_ray_group(group, scene, bounds, first, group_end, wants_any, lanes, ray_origin_tmin, ray_direction_tmax,
                       hits, occluded);
        LeftRays left_here = {0, 0};
        if (group->valid && has_tree) left_here = trace_group(group, &scene, 0, padding, wants_any, &history, waiting);
        int is_done = !left_here.rays;
#if CASTOR_HAS_INSTANCES
        if (is_done && group->valid && has_instances) {
            turn_to_instances(group, scene, first, lanes);
            const uint rays =
                trace_group(group, &scene, 1, instance_padding, wants_any, &instance_history, waiting).rays;
            instance_place_count = add_places(instance_places, instance_place_count, group_count, rays);
            is_done = !rays;
        }
#endif
        if (is_done) {
            write_answers(group, scene, first, group_end, wants_any, lanes, hits, occluded);
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
            rays =
                trace_together(&groups[i], &scene, rays, 0, scene.params.wide_root, wants_any, &deferred[i], waiting);
        else
            defer_root(&deferred[i], scene.params.wide_root);
#endif
        place_count = add_places(places, place_count, i, rays);
    }
    trace_lanes(&scene, groups, places, place_count, 0, scene.params.wide_root, wants_any, deferred, waiting);
#if CASTOR_HAS_INSTANCES
    for (uint i = 0; has_instances && i < group_count; ++i) {
        if (!left[i].rays) continue;  // it is among instances already
        turn_to_instances(&groups[i], scene, group_begin[i], lanes);
        instance_place_count =
            add_places(instance_places, instance_place_count, i, unended_rays(&groups[i], wants_any));
    }
    trace_lanes(&scene, groups, instance_places, instance_place_count, 1, 0, wants_any, 0, waiting);
#endif
    for (uint i = 0; i < group_count; ++i)
        write_answers(&groups[i], scene, group_begin[i], min(group_begin[i] + CASTOR_GROUP_RAYS, end), wants_any, lanes,
                      hits, occluded);
}
