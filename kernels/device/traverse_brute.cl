// Every primitive, in order: the reference that all other strategies equal bit for bit.
#include "castor/shared/layout.h"
#include "device/scene.cl"

CASTOR_INLINE Hit nearest_brute(const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return miss();
    Hit best = nearest_plane(scene, ray, no_hit_yet(ray));
    const uint bounded_count = scene.params.triangle_count + scene.params.sphere_count;
    for (uint i = 0; i < bounded_count; ++i) best = nearer_hit(best, intersect_bounded(scene, ray, i), i);
    return finished_hit(ray.t_scale, best);
}

CASTOR_INLINE int any_brute(const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return 0;
    if (any_plane(scene, ray)) return 1;
    const uint bounded_count = scene.params.triangle_count + scene.params.sphere_count;
    for (uint i = 0; i < bounded_count; ++i)
        if (is_candidate(intersect_bounded(scene, ray, i))) return 1;
    return 0;
}
