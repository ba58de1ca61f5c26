// Geometry that stands in the world more than once, or in a way that its primitives cannot: its instances, a tree over them, and rays in their spaces.
//
// What an instance hits is what its object-space ray hits, by the rules for all rays; t stays the world's, since the direction is transformed and not
// normalised again. So a hit is a function of ray and instance alone, and the tree over instances only passes over those that have none. InstanceBounds
// (instance_tree.cpp) shows that it does.
#include "castor/shared/layout.h"
#include "device/scene.cl"

#if CASTOR_HAS_INSTANCES
CASTOR_INLINE float affine_row(const global float *row, const float3 p)
{
    return fma(row[0], p.x, fma(row[1], p.y, fma(row[2], p.z, row[3])));
}

CASTOR_INLINE float linear_row(const global float *row, const float3 v) { return fma(row[0], v.x, fma(row[1], v.y, row[2] * v.z)); }

// The ray in the instance's space: with the same t. It must be valid.
CASTOR_INLINE TraceRay make_object_ray(const TraceRay ray, const global Instance *instance, const float largest_coordinate)
{
    const global float *m = &instance->to_object[0][0];
    TraceRay object = ray;
    object.origin = (float3)(affine_row(m, ray.origin), affine_row(m + 4, ray.origin), affine_row(m + 8, ray.origin));
    object.direction = (float3)(linear_row(m, ray.direction), linear_row(m + 4, ray.direction), linear_row(m + 8, ray.direction));
    object.valid = is_traceable(object.origin, object.direction, ray.t_min, ray.t_max);
    return with_slabs_and_shear(object, largest_coordinate);
}

// What the search of an instance begins with. Of equal t the smaller instance wins: no primitive's number is below 0, and every one below CASTOR_INVALID_INDEX.
CASTOR_INLINE Hit best_to_beat(const Hit best, const uint instance)
{
    Hit hit = best;
    if (best.primitive == CASTOR_INVALID_INDEX) return hit;
    hit.primitive = best.instance < instance ? 0 : CASTOR_INVALID_INDEX;
    return hit;
}

// The better of two hits, `found` being the end of a search that began with best_to_beat.
CASTOR_INLINE Hit better_of_instances(const Hit best, const Hit found, const uint instance)
{
    const Hit start = best_to_beat(best, instance);
    if (found.t == start.t && found.primitive == start.primitive) return best;
    Hit hit = found;
    hit.instance = instance;
    return hit;
}

// The nodes that wait, the next one last, and when the ray enters each.
typedef struct InstanceWalk {
    uint count;
    uint node[CASTOR_MAX_INSTANCE_STACK];
    float entry[CASTOR_MAX_INSTANCE_STACK];
} InstanceWalk;

// When the ray enters the node; NaN: not within its limits.
CASTOR_INLINE float instance_node_entry(const TraceRay ray, const global InstanceNode *node, const float t_limit)
{
    const float3 lower = vload3(0, node->lower);
    const float3 upper = vload3(0, node->upper);
    const float3 near_plane = ray.inverse < 0.0f ? upper : lower;
    const float3 far_plane = ray.inverse < 0.0f ? lower : upper;
    const float3 base = -(ray.origin * ray.inverse);
    const float farthest = larger(fabs(ray.origin.x), larger(fabs(ray.origin.y), fabs(ray.origin.z)));
    const float3 pad = (node->slope * farthest) * fabs(ray.inverse);
    const float3 entries = fma(near_plane, ray.inverse, base - pad);
    const float3 exits = fma(far_plane, ray.inverse, base + pad);
    const float entry = larger(larger(entries.x, entries.y), larger(entries.z, ray.t_min));
    const float exit = smaller(smaller(exits.x, exits.y), smaller(exits.z, t_limit));
    return entry <= exit ? entry : NAN;
}

CASTOR_INLINE void push_instance_node(InstanceWalk *walk, const uint node, const float entry)
{
    if (!(entry == entry)) return;
    walk->node[walk->count] = node;
    walk->entry[walk->count++] = entry;
}

CASTOR_INLINE void begin_instance_walk(InstanceWalk *walk, const SceneColumns scene, const TraceRay ray, const float t_limit)
{
    walk->count = 0;
    if (scene.params.instance_node_count > 0) push_instance_node(walk, 0, instance_node_entry(ray, scene.instance_nodes, t_limit));
}

// The next instance that the ray may hit no later than t_limit, near ones first; CASTOR_INVALID_INDEX: none is left. One of two children waits at each level: the stack
// cannot overflow.
CASTOR_INLINE uint next_instance(InstanceWalk *walk, const SceneColumns scene, const TraceRay ray, const float t_limit)
{
    while (walk->count > 0) {
        --walk->count;
        if (walk->entry[walk->count] > t_limit) continue;
        const global InstanceNode *node = scene.instance_nodes + walk->node[walk->count];
        CASTOR_COUNT(scene, INSTANCE_NODE);
        if (node->is_leaf) return node->first;
        const float left = instance_node_entry(ray, scene.instance_nodes + node->first, t_limit);
        const float right = instance_node_entry(ray, scene.instance_nodes + node->first + 1, t_limit);
        const uint near_is_left = !(left > right);
        push_instance_node(walk, node->first + near_is_left, near_is_left ? right : left);
        push_instance_node(walk, node->first + 1 - near_is_left, near_is_left ? left : right);
    }
    return CASTOR_INVALID_INDEX;
}
#endif
