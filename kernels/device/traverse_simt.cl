// Traverses the compressed 8-wide tree for one ray: Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on
// GPUs Through Compressed Wide BVHs", §4.
//
// Exactness: a plane is decompressed to a float first, by the very arithmetic with which compress_bvh has made sure
// that a child's planes contain its box, and then goes through the slab test of all boxes. That test is monotone in the
// planes (intersect_box.lanes.cl), so the ray enters the child's planes no later than its box and leaves them no
// earlier, exactly, whatever the rounding.
//
// The stack: a group has children of one node. When the nearest of them is visited, the rest of the group is pushed;
// all other entries are such rests of nodes further up on the way from the root, one each. So the node at level k (the
// root has level 1) is visited with at most k - 1 groups on the stack, and as many entries as the tree has levels
// cannot overflow.
//
// CASTOR_SIMT_STACK  entries of the stack: no fewer than the tree has levels
#include "castor/shared/layout.h"
#include "device/instances.cl"
#include "device/intersect_box.x4.cl"
#include "device/simd.cl"

#ifndef CASTOR_SIMT_STACK
#define CASTOR_SIMT_STACK CASTOR_MAX_STACK
#endif

// The children of one node that are yet to be visited. x: the node's first inner child. y: those to visit, bits 24 to
// 31, the nearer the higher; all inner children by place, bits 0 to 7.
typedef uint2 NodeGroup;

CASTOR_INLINE int is_spent(const NodeGroup group) { return group.y < (1u << 24); }

// The children of a node that the ray enters.
typedef struct NodeVisit {
    NodeGroup nodes;
    uint first_primitive;
    uint primitives;  // bit i: first_primitive + i
} NodeVisit;

// Returns a bit for each axis along which the ray runs upwards. Places are numbered alike, by corners of the node: of
// two that the ray may pass, the one with the greater place ^ octant is the nearer along the diagonals.
CASTOR_INLINE uint octant_of(const TraceRay ray)
{
    return (ray.inverse_x < 0.0f ? 0u : 1u) | (ray.inverse_y < 0.0f ? 0u : 2u) | (ray.inverse_z < 0.0f ? 0u : 4u);
}

CASTOR_INLINE float4 decompressed_planes(const uint steps, const uint exponent, const float origin)
{
    return fma(convert_float4(as_uchar4(steps)), (float4)(as_float(exponent << 23)), (float4)(origin));
}

// Tests four children of a node, given the steps of their near and far planes. Returns the bits that `meta` gives to
// those that the ray enters no later than t_limit. A node entered exactly at t_limit counts: it may hold an equal t
// with a smaller number.
CASTOR_INLINE uint entered_children(const TraceRay ray, const uint octant, const float t_limit, const float3 origin,
                                    const uint3 exponent, const uint3 near_steps, const uint3 far_steps,
                                    const uint meta)
{
    BoxPlanes4 planes;
    planes.near_x = decompressed_planes(near_steps.x, exponent.x, origin.x);
    planes.near_y = decompressed_planes(near_steps.y, exponent.y, origin.y);
    planes.near_z = decompressed_planes(near_steps.z, exponent.z, origin.z);
    planes.far_x = decompressed_planes(far_steps.x, exponent.x, origin.x);
    planes.far_y = decompressed_planes(far_steps.y, exponent.y, origin.y);
    planes.far_z = decompressed_planes(far_steps.z, exponent.z, origin.z);
    const Interval4 interval = slab_test4(slabs_of4(ray), planes, (float4)(ray.t_min), (float4)(t_limit));

    // Byte by byte: inner children, and those alone, have places from 24 on, bits 3 and 4 set; these turn with the
    // octant.
    const uint is_inner = (meta & meta << 1) & 0x10101010u;
    const uint place = (meta ^ (is_inner >> 4) * octant) & 0x1f1f1f1fu;
    const uint count = meta >> CASTOR_COMPRESSED_COUNT_SHIFT & 0x07070707u;
    const uint4 bits = convert_uint4(as_uchar4(count)) << convert_uint4(as_uchar4(place));
    const uint4 entered = as_uint4(interval.entry <= interval.exit) & bits;
    return (entered.x | entered.y) | (entered.z | entered.w);
}

CASTOR_INLINE NodeVisit visit_node(const TraceRay ray, const uint octant, const float t_limit,
                                   const global CompressedNode *node)
{
    // Five rows of 16 bytes, the struct's members in order.
    const global uint4 *rows = (const global uint4 *)node;
    const uint4 head = rows[0];
    const uint4 links = rows[1];
    const uint4 lower_xy = rows[2];
    const uint4 lower_z_upper_x = rows[3];
    const uint4 upper_yz = rows[4];
    const uchar4 exponents = as_uchar4(head.w);

    const float3 origin = as_float3(head.xyz);
    const uint3 exponent = convert_uint3(exponents.xyz);
    const uint2 near_x = ray.inverse_x < 0.0f ? lower_z_upper_x.zw : lower_xy.xy;
    const uint2 near_y = ray.inverse_y < 0.0f ? upper_yz.xy : lower_xy.zw;
    const uint2 near_z = ray.inverse_z < 0.0f ? upper_yz.zw : lower_z_upper_x.xy;
    const uint2 far_x = ray.inverse_x < 0.0f ? lower_xy.xy : lower_z_upper_x.zw;
    const uint2 far_y = ray.inverse_y < 0.0f ? lower_xy.zw : upper_yz.xy;
    const uint2 far_z = ray.inverse_z < 0.0f ? lower_z_upper_x.xy : upper_yz.zw;
    const uint entered = entered_children(ray, octant, t_limit, origin, exponent, (uint3)(near_x.x, near_y.x, near_z.x),
                                          (uint3)(far_x.x, far_y.x, far_z.x), links.z) |
                         entered_children(ray, octant, t_limit, origin, exponent, (uint3)(near_x.y, near_y.y, near_z.y),
                                          (uint3)(far_x.y, far_y.y, far_z.y), links.w);
    NodeVisit visit;
    visit.nodes = (NodeGroup)(links.x, (entered & 0xff000000u) | exponents.w);
    visit.first_primitive = links.y;
    visit.primitives = entered & 0x00ffffffu;
    return visit;
}

// Takes the nearest child out of a group, which is not spent, and pushes the rest of it. Returns the child's node.
CASTOR_INLINE uint take_nearest_child(NodeGroup *group, const uint octant, NodeGroup *waiting, int *waiting_count)
{
    const uint nearest = 31u - clz(group->y);
    group->y &= ~(1u << nearest);
    if (!is_spent(*group)) waiting[(*waiting_count)++] = *group;
    const uint place = (nearest & 7u) ^ octant;
    return group->x + popcount(group->y & ((1u << place) - 1u));
}

// Returns the nearest hit in the tree of root `root`, if better than `best`; with `wants_any` (a constant): the first
// one found.
CASTOR_INLINE Hit search_tree(const SceneColumns scene, const TraceRay ray, const uint root, Hit best,
                              const int wants_any)
{
    const uint octant = octant_of(ray);
    NodeGroup waiting[CASTOR_SIMT_STACK];
    int waiting_count = 0;
    // The root, as the only child of a node above it.
    NodeGroup group = (NodeGroup)(root, 1u << 31);
    while (!is_spent(group)) {
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
        const uint child = take_nearest_child(&group, octant, waiting, &waiting_count);
        CASTOR_COUNT(scene, COMPRESSED_NODE);
        const NodeVisit visit = visit_node(ray, octant, best.t, scene.compressed_nodes + child);
        for (uint left = visit.primitives; left; left &= left - 1) {
            const uint primitive = scene.compressed_primitives[visit.first_primitive + lowest_bit(left)];
            best = nearer_hit(best, intersect_bounded(scene, ray, primitive), primitive);
        }
        group = visit.nodes;
        if (is_spent(group) && waiting_count > 0) group = waiting[--waiting_count];
    }
    return best;
}

// Returns the best hit, beginning with `start`; with `wants_any` (a constant): the first one found.
CASTOR_INLINE Hit search_simt(const SceneColumns scene, const TraceRay ray, const Hit start, const int wants_any)
{
    Hit best = nearest_plane(scene, ray, start);
#if CASTOR_HAS_INSTANCES
    const uint root = scene.compressed_roots[0];
    if (root != CASTOR_INVALID_INDEX) best = search_tree(scene, ray, root, best, wants_any);
    InstanceWalk walk;
    begin_instance_walk(&walk, scene, ray, best.t);
    while (!wants_any || best.primitive == CASTOR_INVALID_INDEX) {
        const uint i = next_instance(&walk, scene, best.t);
        if (i == CASTOR_INVALID_INDEX) break;
        const uint geometry = scene.instances[i].geometry;
        const TraceRay object =
            make_object_ray(ray, scene.instances + i, scene.geometries[geometry].largest_coordinate);
        if (!object.valid) continue;
        best = better_of_instances(
            best, search_tree(scene, object, scene.compressed_roots[geometry], best_to_beat(best, i), wants_any), i);
    }
#else
    if (scene.params.node_count > 0) best = search_tree(scene, ray, 0, best, wants_any);
#endif
    return best;
}

// Returns the nearest hit. `answer` is where the caller stores it.
CASTOR_INLINE Hit nearest_simt(const SceneColumns scene, const TraceRay ray, const global Hit *answer)
{
    if (!ray.valid) return miss();
    const Hit start = no_hit_yet(search_limit(scene, ray.t_max, answer));
    return finished_hit(scene, ray.t_scale, search_simt(scene, ray, start, 0), answer);
}

CASTOR_INLINE int any_simt(const SceneColumns scene, const TraceRay ray, const global uchar *answer)
{
    if (goes_on(scene) && *answer) return 1;
    return ray.valid && search_simt(scene, ray, no_hit_yet(ray.t_max), 1).primitive != CASTOR_INVALID_INDEX;
}
