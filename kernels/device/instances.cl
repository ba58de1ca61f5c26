// Instances of geometry, a tree over them, and rays in their spaces.
//
// A ray hits an instance where its object-space ray hits the geometry, by the rules for all rays. t stays the world's,
// since the direction is transformed and not normalised again. So a hit is a function of ray and instance alone, and
// the tree over instances only skips those that the ray cannot hit. InstanceBounds (instance_tree.cpp) shows that it
// does.
#include "castor/shared/layout.h"
#include "device/object_ray.x1.cl"
#include "device/scene.cl"

// Loads ray i as load_ray does, with its time.
CASTOR_INLINE TraceRay load_timed_ray(const SceneColumns scene, const uint i,
                                      const global float4 *restrict ray_origin_tmin,
                                      const global float4 *restrict ray_direction_tmax)
{
    TraceRay ray = load_ray(scene.params, i, ray_origin_tmin, ray_direction_tmax);
#if CASTOR_HAS_MOTION
    ray.time = scene.ray_time[i];
#endif
    return ray;
}

#if CASTOR_HAS_INSTANCES
// Returns the hit with which the search of an instance begins. Of equal t the smaller instance wins: no primitive's
// number is below 0, and every one is below CASTOR_INVALID_INDEX.
CASTOR_INLINE Hit best_to_beat(const Hit best, const uint instance)
{
    Hit hit = best;
    if (best.primitive == CASTOR_INVALID_INDEX) return hit;
    hit.primitive = best.instance < instance ? 0 : CASTOR_INVALID_INDEX;
    return hit;
}

// Returns the better of two hits, `found` being the end of a search that began with best_to_beat.
CASTOR_INLINE Hit better_of_instances(const Hit best, const Hit found, const uint instance)
{
    const Hit start = best_to_beat(best, instance);
    if (found.t == start.t && found.primitive == start.primitive) return best;
    Hit hit = found;
    hit.instance = instance;
    return hit;
}

// The traversal of the instances' tree by one ray: its slabs, and the nodes that wait, the next one last, with when the
// ray enters each.
typedef struct InstanceWalk {
    float3 inverse;
    float3 base;   // the slabs' offsets without enlargement
    float3 reach;  // times a node's slope: its enlargement
    float t_min;
    uint count;
    uint node[CASTOR_MAX_INSTANCE_STACK + 1];  // one more is written above the top
    float entry[CASTOR_MAX_INSTANCE_STACK + 1];
} InstanceWalk;

// Returns when the ray enters the node; NaN: not within its limits.
CASTOR_INLINE float instance_node_entry(const InstanceWalk *walk, const global InstanceNode *node, const float t_limit)
{
    const float3 lower = vload4(0, node->lower).xyz;
    const float3 upper = vload4(0, node->upper).xyz;
    const float3 pad = node->slope * walk->reach;
    const float3 entry = walk->base - pad;
    const float3 exit = walk->base + pad;
    const Slabs slabs = {walk->inverse.x, walk->inverse.y, walk->inverse.z, entry.x, entry.y,
                         entry.z,         exit.x,          exit.y,          exit.z};
    const BoxPlanes planes = box_planes(slabs, lower.x, lower.y, lower.z, upper.x, upper.y, upper.z);
    const Interval interval = slab_test(slabs, planes, walk->t_min, t_limit);
    return interval.entry <= interval.exit ? interval.entry : NAN;
}

// Pushes a node if it is entered, without a branch: none could be predicted.
CASTOR_INLINE void push_instance_node(InstanceWalk *walk, const uint node, const float entry)
{
    walk->node[walk->count] = node;
    walk->entry[walk->count] = entry;
    walk->count += entry == entry ? 1 : 0;
}

CASTOR_INLINE void begin_instance_walk(InstanceWalk *walk, const SceneColumns scene, const TraceRay ray,
                                       const float t_limit)
{
    const float farthest = larger(fabs(ray.origin_x), larger(fabs(ray.origin_y), fabs(ray.origin_z)));
    walk->inverse = (float3)(ray.inverse_x, ray.inverse_y, ray.inverse_z);
    walk->base = -(ray_origin(ray) * walk->inverse);
    walk->reach = farthest * fabs(walk->inverse);
    walk->t_min = ray.t_min;
    walk->count = 0;
    if (scene.params.instance_node_count > 0)
        push_instance_node(walk, 0, instance_node_entry(walk, scene.instance_nodes, t_limit));
}

// Pops a node, of which there must be one. Returns the instance if the node is that of one which the ray may hit no
// later than t_limit. Otherwise returns CASTOR_INVALID_INDEX and pushes the node's children, the nearer one last. There
// is no branch, so that a CPU works on several rays' steps at the same time. One of two children waits at each level:
// the stack cannot overflow.
CASTOR_INLINE uint step_instance_walk(InstanceWalk *walk, const SceneColumns scene, const float t_limit)
{
    --walk->count;
    const global InstanceNode *node = scene.instance_nodes + walk->node[walk->count];
    CASTOR_COUNT(scene, INSTANCE_NODE);
    const uint first = node->first;
    const uint is_near = walk->entry[walk->count] > t_limit ? 0 : 1;
    const uint is_inner = is_near & (node->is_leaf ^ 1);
    const uint left = is_inner ? first : 0;
    const uint right = left + is_inner;
    const float t_children = is_inner ? t_limit : NAN;  // then none is entered
    const float left_entry = instance_node_entry(walk, scene.instance_nodes + left, t_children);
    const float right_entry = instance_node_entry(walk, scene.instance_nodes + right, t_children);
    const uint left_is_near = !(left_entry > right_entry);
    push_instance_node(walk, left_is_near ? right : left, left_is_near ? right_entry : left_entry);
    push_instance_node(walk, left_is_near ? left : right, left_is_near ? left_entry : right_entry);
    return is_near & node->is_leaf ? first : CASTOR_INVALID_INDEX;
}

// Returns the next instance that the ray may hit no later than t_limit, near ones first; CASTOR_INVALID_INDEX: none.
CASTOR_INLINE uint next_instance(InstanceWalk *walk, const SceneColumns scene, const float t_limit)
{
    uint instance = CASTOR_INVALID_INDEX;
    while (instance == CASTOR_INVALID_INDEX && walk->count > 0) instance = step_instance_walk(walk, scene, t_limit);
    return instance;
}
#endif
