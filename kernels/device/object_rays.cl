// The rays of a group in the space of an instance.
#include "castor/shared/layout.h"
#include "device/make_ray_group.cl"
#include "device/object_ray.x16.cl"
#include "device/ray_group.x16.cl"
#include "device/store_rays.x16.cl"

#if CASTOR_HAS_INSTANCES
// Returns what best_to_beat does, for all rays of a group: the primitive of the hit.
CASTOR_INLINE uint16 primitives_to_beat(const RayGroup *rays, const uint instance)
{
    const uint16 primitive = vload16(0, rays->best_primitive);
    const int16 is_beaten_by_less =
        (primitive != CASTOR_INVALID_INDEX) & (vload16(0, rays->best_instance) < (uint16)(instance));
    return is_beaten_by_less ? (uint16)(0) : (uint16)(CASTOR_INVALID_INDEX);
}

// Makes the rays of a group that enter an instance, given as bits, ready in its space. Returns whether there are any
// that can be traced.
CASTOR_INLINE int make_object_rays(RayGroup *objects, const RayGroup *rays, const SceneColumns scene,
                                   const uint entering, const uint number)
{
    const global Instance *instance = scene.instances + number;
    const float largest_coordinate = scene.geometries[instance->geometry].largest_coordinate;
    const TraceRay16 ray = make_object_ray16(world_rays_of_group16(rays, 0), instance, largest_coordinate);
    objects->valid = mask_of16(ray.valid) & entering;
    if (!objects->valid) return 0;
    store_rays16(objects, 0, ray);
    store_reals16(vload16(0, rays->best_t), objects->best_t);
    store_wholes16(primitives_to_beat(rays, number), objects->best_primitive);
    return 1;
}

// Takes over what rays of the group have hit in an instance: see better_of_instances.
CASTOR_INLINE void take_hits_of_instance(RayGroup *rays, const RayGroup *objects, const uint instance)
{
    const float16 best_t = vload16(0, rays->best_t), found_t = vload16(0, objects->best_t);
    const uint16 found_primitive = vload16(0, objects->best_primitive);
    const int16 is_better = lanes_of_mask16(objects->valid) &
                            ((found_t != best_t) | (found_primitive != primitives_to_beat(rays, instance)));
    store_reals16(is_better ? found_t : best_t, rays->best_t);
    store_reals16(is_better ? vload16(0, objects->best_u) : vload16(0, rays->best_u), rays->best_u);
    store_reals16(is_better ? vload16(0, objects->best_v) : vload16(0, rays->best_v), rays->best_v);
    store_wholes16(is_better ? found_primitive : vload16(0, rays->best_primitive), rays->best_primitive);
    store_wholes16(is_better ? (uint16)(instance) : vload16(0, rays->best_instance), rays->best_instance);
}
#endif
