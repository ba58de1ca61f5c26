// Tests every primitive of every instance, in order: the reference that all other strategies equal bit for bit.
#include "castor/shared/layout.h"
#include "device/instances.cl"

// Tests primitives [begin, end) of a geometry, or of the whole scene where there are no instances: triangles first,
// from first_triangle on, then spheres, from first_sphere on.
CASTOR_INLINE Hit nearest_of_range(const SceneColumns scene, const TraceRay ray, Hit best, const uint first_triangle,
                                   const uint triangle_count, const uint first_sphere, const uint begin, const uint end,
                                   const int wants_any)
{
    const uint end_triangle = first_triangle + min(end, triangle_count);
    for (uint i = first_triangle + begin; i < end_triangle; ++i) {
        best = nearer_hit(best, intersect_bounded(scene, ray, i), i);
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
    }
    if (!CASTOR_HAS_SPHERES) return best;
    const uint base = scene.params.triangle_count + first_sphere;
    const uint end_sphere = base + end - min(end, triangle_count);
    for (uint i = base + max(begin, triangle_count) - triangle_count; i < end_sphere; ++i) {
        best = nearer_hit(best, intersect_bounded(scene, ray, i), i);
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
    }
    return best;
}

// Returns where the pass begins or ends within `count` primitives that follow `before` others.
CASTOR_INLINE uint pass_edge(const ulong edge, const ulong before, const uint count)
{
    return edge <= before ? 0 : (uint)min(edge - before, (ulong)count);
}

// Returns the best hit, beginning with `start`; with `wants_any` (a constant): the first one found.
CASTOR_INLINE Hit search_brute(const SceneColumns scene, const TraceRay ray, const Hit start, const int wants_any)
{
    const ulong pass_begin = (ulong)scene.params.pass * CASTOR_BRUTE_PASS;
    const ulong pass_end = CASTOR_BRUTE_PASS ? pass_begin + CASTOR_BRUTE_PASS : ULONG_MAX;
    Hit best = pass_begin == 0 ? nearest_plane(scene, ray, start) : start;
    if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
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
        const Hit to_beat = i == 0 ? best : best_to_beat(best, i);
        const Hit found = nearest_of_range(scene, object, to_beat, geometry.first_triangle, geometry.triangle_count,
                                           geometry.first_sphere, begin, end, wants_any);
        best = i == 0 ? found : better_of_instances(best, found, i);
        if (wants_any && best.primitive != CASTOR_INVALID_INDEX) return best;
    }
    return best;
#else
    const uint count = scene.params.triangle_count + scene.params.sphere_count;
    return nearest_of_range(scene, ray, best, 0, scene.params.triangle_count, 0, pass_edge(pass_begin, 0, count),
                            pass_edge(pass_end, 0, count), wants_any);
#endif
}

// Returns the nearest hit. `answer` is where the caller stores it.
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
