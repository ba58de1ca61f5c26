// One ray down the binary tree, nearer child first. `build_bvh` bounds the tree's depth, and a stack of as many entries cannot overflow:
// at each level one sibling waits.
#include "castor/shared/layout.h"
#include "device/scene.cl"

typedef struct NodeVisit {
    uint node;
    float entry;
} NodeVisit;

// When the ray enters the node, or INFINITY if it does not before t_limit. A node entered exactly at t_limit counts: it may hold an
// equal t with a smaller number.
CASTOR_INLINE float node_entry(const SceneColumns scene, const TraceRay ray, const BvhNode node, const float t_limit)
{
    CASTOR_COUNT(scene, BOX);
    const float2 interval = box_interval(ray, (float3)(node.lower[0], node.lower[1], node.lower[2]),
                                         (float3)(node.upper[0], node.upper[1], node.upper[2]));
    const float entry = larger(interval.x, ray.t_min);
    return entry <= smaller(interval.y, t_limit) ? entry : INFINITY;
}

CASTOR_INLINE Hit nearest_in_leaf(const SceneColumns scene, const TraceRay ray, const BvhNode leaf, Hit best)
{
    for (uint i = leaf.first; i < leaf.first + leaf.count; ++i) {
        const uint primitive = scene.bvh_primitives[i];
        best = nearer_hit(best, intersect_bounded(scene, ray, primitive), primitive);
    }
    return best;
}

CASTOR_INLINE int any_in_leaf(const SceneColumns scene, const TraceRay ray, const BvhNode leaf)
{
    for (uint i = leaf.first; i < leaf.first + leaf.count; ++i)
        if (is_candidate(intersect_bounded(scene, ray, scene.bvh_primitives[i]))) return 1;
    return 0;
}

CASTOR_INLINE Hit nearest_bvh(const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return miss();
    Hit best = nearest_plane(scene, ray, no_hit_yet(ray));
    if (scene.params.node_count == 0) return finished_hit(ray.t_scale, best);

    NodeVisit waiting[CASTOR_MAX_STACK];
    int waiting_count = 0;
    uint index = 0;
    int go_on = node_entry(scene, ray, scene.bvh_nodes[0], best.t) < INFINITY;
    while (go_on) {
        const BvhNode node = scene.bvh_nodes[index];
        int descends = 0;
        if (node.count > 0) {
            best = nearest_in_leaf(scene, ray, node, best);
        } else {
            const float left = node_entry(scene, ray, scene.bvh_nodes[node.first], best.t);
            const float right = node_entry(scene, ray, scene.bvh_nodes[node.first + 1], best.t);
            const int right_first = right < left;
            const float farther = right_first ? left : right;
            descends = (right_first ? right : left) < INFINITY;
            if (descends) index = node.first + right_first;
            if (farther < INFINITY) {
                waiting[waiting_count].node = node.first + 1 - right_first;
                waiting[waiting_count].entry = farther;
                ++waiting_count;
            }
        }
        // The next waiting node that is not entered later than the best hit.
        while (!descends && waiting_count > 0) {
            --waiting_count;
            index = waiting[waiting_count].node;
            descends = waiting[waiting_count].entry <= best.t;
        }
        go_on = descends;
    }
    return finished_hit(ray.t_scale, best);
}

CASTOR_INLINE int any_bvh(const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return 0;
    if (any_plane(scene, ray)) return 1;
    if (scene.params.node_count == 0) return 0;

    uint waiting[CASTOR_MAX_STACK];
    int waiting_count = 0;
    waiting[waiting_count++] = 0;
    while (waiting_count > 0) {
        const BvhNode node = scene.bvh_nodes[waiting[--waiting_count]];
        if (!(node_entry(scene, ray, node, ray.t_max) < INFINITY)) continue;
        if (node.count > 0) {
            if (any_in_leaf(scene, ray, node)) return 1;
        } else {
            waiting[waiting_count++] = node.first + 1;
            waiting[waiting_count++] = node.first;
        }
    }
    return 0;
}
