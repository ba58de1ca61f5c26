// Every primitive of every instance, in order: the reference that all other strategies equal bit for bit.
#include "castor/shared/layout.h"
#include "device/instances.cl"

// Triangles [first_triangle, end_triangle) and spheres likewise, as all geometries number them.
CASTOR_INLINE Hit nearest_of_ranges(const SceneColumns scene, const TraceRay ray, Hit best, const uint first_triangle, const uint end_triangle,
                                    const uint first_sphere, const uint end_sphere, const int wants_any)
{
    for (uint i = first_triangle; i < end_triangle; ++i) {
        best = nearer_hit(best, intersect_bounded(scene, ray, i), i);
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
    }
    if (!CASTOR_HAS_SPHERES) return best;
    for (uint i = scene.params.triangle_count + first_sphere; i < scene.params.triangle_count + end_sphere; ++i) {
        best = nearer_hit(best, intersect_bounded(scene, ray, i), i);
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
    }
    return best;
}

// The best hit, from `start` on; `wants_any` (a constant): the first one found.
CASTOR_INLINE Hit search_brute(const SceneColumns scene, const TraceRay ray, const Hit start, const int wants_any)
{
    Hit best = nearest_plane(scene, ray, start);
    if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
#if CASTOR_HAS_INSTANCES
    for (uint i = 0; i < scene.params.instance_count; ++i) {
        const Geometry geometry = scene.geometries[scene.instances[i].geometry];
        const TraceRay object = i == 0 ? ray : make_object_ray(ray, scene.instances + i, geometry.largest_coordinate);
        if (!object.valid) continue;
        const Hit to_beat = i == 0 ? best : best_to_beat(best, i);
        const Hit found = nearest_of_ranges(scene, object, to_beat, geometry.first_triangle, geometry.first_triangle + geometry.triangle_count,
                                            geometry.first_sphere, geometry.first_sphere + geometry.sphere_count, wants_any);
        best = i == 0 ? found : better_of_instances(best, found, i);
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
    }
    return best;
#else
    return nearest_of_ranges(scene, ray, best, 0, scene.params.triangle_count, 0, scene.params.sphere_count, wants_any);
#endif
}

// `answer`: where the hit is going to stand.
CASTOR_INLINE Hit nearest_brute(const SceneColumns scene, const TraceRay ray, const global Hit *answer)
{
    if (!ray.valid) return miss();
    const Hit start = no_hit_yet(search_limit(scene, ray.t_max, answer));
    return finished_hit(scene, ray.t_scale, search_brute(scene, ray, start, 0), answer);
}

CASTOR_INLINE int any_brute(const SceneColumns scene, const TraceRay ray, const global uchar *answer)
{
    if (goes_on(scene) && *answer) return 1;
    return ray.valid && search_brute(scene, ray, no_hit_yet(ray.t_max), 1).primitive != CASTOR_INVALID_INDEX;
}
