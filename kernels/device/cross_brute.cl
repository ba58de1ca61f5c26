// Tests every primitive of every instance for crossings, in order: the reference that all other strategies equal bit
// for bit.
#include "castor/shared/layout.h"
#include "device/crossings.cl"
#include "device/traverse_brute.cl"

// Adds the crossings of primitives [begin, end) of a geometry: see nearest_of_range.
CASTOR_INLINE void cross_range(Crossings *crossings, const SceneColumns scene, const TraceRay ray,
                               const uint first_triangle, const uint triangle_count, const uint first_sphere,
                               const uint begin, const uint end)
{
    const uint end_triangle = first_triangle + min(end, triangle_count);
    for (uint i = first_triangle + begin; i < end_triangle; ++i) cross_bounded(crossings, scene, ray, i);
    if (!CASTOR_HAS_SPHERES) return;
    const uint base = scene.params.triangle_count + first_sphere;
    const uint end_sphere = base + end - min(end, triangle_count);
    for (uint i = base + max(begin, triangle_count) - triangle_count; i < end_sphere; ++i)
        cross_bounded(crossings, scene, ray, i);
}

// Adds the crossings of a pass.
CASTOR_INLINE void cross_brute(Crossings *crossings, const SceneColumns scene, const TraceRay ray)
{
    if (!ray.valid) return;
    const ulong pass_begin = (ulong)scene.params.pass * CASTOR_BRUTE_PASS;
    const ulong pass_end = CASTOR_BRUTE_PASS ? pass_begin + CASTOR_BRUTE_PASS : ULONG_MAX;
    if (pass_begin == 0) cross_planes(crossings, scene, ray);
#if CASTOR_HAS_INSTANCES
    ulong before = 0;
    for (uint i = 0; i < scene.params.instance_count; ++i) {
        const Geometry geometry = scene.geometries[scene.instances[i].geometry];
        const uint count = geometry.triangle_count + geometry.sphere_count;
        const uint begin = pass_edge(pass_begin, before, count), end = pass_edge(pass_end, before, count);
        before += count;
        if (begin == end) continue;
        const TraceRay object = i == 0 ? ray : make_object_ray(ray, scene.instances + i, geometry.largest_coordinate);
        if (!object.valid) continue;
        crossings->instance = i;
        cross_range(crossings, scene, object, geometry.first_triangle, geometry.triangle_count, geometry.first_sphere,
                    begin, end);
    }
#else
    const uint count = scene.params.triangle_count + scene.params.sphere_count;
    cross_range(crossings, scene, ray, 0, scene.params.triangle_count, 0, pass_edge(pass_begin, 0, count),
                pass_edge(pass_end, 0, count));
#endif
}
