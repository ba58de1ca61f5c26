// Traverses the compressed 8-wide tree for all crossings of one ray: as traverse_simt.cl does for its nearest hit.
#include "castor/shared/layout.h"
#include "device/crossings.cl"
#include "device/traverse_simt.cl"

// Adds the crossings within the tree of root `root` that are no farther than crossings->t_limit.
CASTOR_INLINE void cross_compressed_tree(Crossings *crossings, const SceneColumns scene, const TraceRay ray,
                                         const uint root)
{
    const uint octant = octant_of(ray);
    NodeGroup waiting[CASTOR_SIMT_STACK];
    int waiting_count = 0;
    NodeGroup group = (NodeGroup)(root, 1u << 31);
    while (!is_spent(group)) {
        const uint child = take_nearest_child(&group, octant, waiting, &waiting_count);
        CASTOR_COUNT(scene, COMPRESSED_NODE);
        const NodeVisit visit = visit_node(ray, octant, crossings->t_limit, scene.compressed_nodes + child);
        for (uint left = visit.primitives; left; left &= left - 1)
            cross_bounded(crossings, scene, ray, scene.compressed_primitives[visit.first_primitive + lowest_bit(left)]);
        group = visit.nodes;
        if (is_spent(group) && waiting_count > 0) group = waiting[--waiting_count];
    }
}

CASTOR_INLINE void cross_tree_simt(Crossings *crossings, const SceneColumns scene, const TraceRay ray,
                                   const uint instance, const uint root)
{
    crossings->instance = instance;
    begin_tree(crossings, ray.t_max);
    do cross_compressed_tree(crossings, scene, ray, root);
    while (end_traversal(crossings, scene, ray.t_max));
}

// Adds the crossings of a chunk.
CASTOR_INLINE void cross_simt(Crossings *crossings, const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return;
    cross_planes(crossings, scene, ray);
#if CASTOR_HAS_INSTANCES
    const uint root = scene.compressed_roots[0];
    if (root != CASTOR_INVALID_INDEX) cross_tree_simt(crossings, scene, ray, 0, root);
    InstanceWalk walk;
    begin_instance_walk(&walk, scene, ray, ray.t_max);
    for (uint i; (i = next_instance(&walk, scene, ray.t_max)) != CASTOR_INVALID_INDEX;) {
        const uint geometry = scene.instances[i].geometry;
        const TraceRay object =
            make_object_ray(ray, scene.instances + i, scene.geometries[geometry].largest_coordinate);
        if (object.valid) cross_tree_simt(crossings, scene, object, i, scene.compressed_roots[geometry]);
    }
#else
    if (scene.params.node_count > 0) cross_tree_simt(crossings, scene, ray, 0, 0);
#endif
}
