// The crossings of one ray: their number, and the first ones in the order of (t, instance, primitive).
//
// A tree of high quality may have a triangle in several leaves (CASTOR_HAS_PIECES). Its crossing is then found in each
// leaf that the ray enters, always with the same bits. So the crossings within a tree are taken window by window: a
// window holds the first CASTOR_CROSSINGS_WINDOW of those that come after the window before, each once, and the tree is
// traversed again until a window has room left.
//
// CASTOR_HAS_PIECES  1 where a tree may have a primitive in several leaves
#include "castor/shared/layout.h"
#include "device/crossings.x1.cl"
#include "device/scene.cl"

#ifndef CASTOR_HAS_PIECES
#define CASTOR_HAS_PIECES 0
#endif
#define CASTOR_CROSSINGS_WINDOW 16u

// A crossing within a tree. t is in the ray's scaled units. `leaves`: of a sphere, whether the ray enters or leaves it.
typedef struct Crossing {
    float t;
    uint primitive;
    uint leaves;
    float u;
    float v;
} Crossing;

typedef struct Crossings {
    uint count;
    uint limit;         // how many `first` has room for; 0 (a constant): they are counted alone
    global Hit *first;  // in order, t in the caller's units
    float t_scale;
    uint instance;  // in which the ray is now
    float t_limit;  // farther crossings need not be found now
#if CASTOR_HAS_PIECES
    Crossing before;  // the last one of the window before; t = NaN: there was none
    uint window_count;
    Crossing window[CASTOR_CROSSINGS_WINDOW];
#endif
} Crossings;

CASTOR_INLINE Crossing make_crossing(const Candidate candidate, const uint primitive, const uint leaves)
{
    Crossing crossing;
    crossing.t = candidate.t;
    crossing.primitive = primitive;
    crossing.leaves = leaves;
    crossing.u = candidate.u;
    crossing.v = candidate.v;
    return crossing;
}

// Begins with the answers of earlier chunks or passes, if there are any.
CASTOR_INLINE Crossings begin_crossings(const SceneColumns scene, const TraceRay ray, const uint limit,
                                        global Hit *first, const global uint *count)
{
    Crossings crossings;
    crossings.count = goes_on(scene) ? *count : 0;
    crossings.limit = limit;
    crossings.first = first;
    crossings.t_scale = ray.t_scale;
    crossings.instance = 0;
    crossings.t_limit = ray.t_max;
    return crossings;
}

// Whether a comes before b in a list.
CASTOR_INLINE int comes_before(const Hit a, const Hit b)
{
    if (a.t != b.t) return a.t < b.t;
    if (a.instance != b.instance) return a.instance < b.instance;
    return a.primitive < b.primitive;
}

// Counts a crossing, and lists it if it is one of the first.
CASTOR_INLINE void add_crossing(Crossings *crossings, const SceneColumns scene, const Crossing crossing)
{
    const uint count = crossings->count++;
    if (crossings->limit == 0) return;
    Hit hit;
    hit.t = crossing.t;
    hit.u = crossing.u;
    hit.v = crossing.v;
    hit.primitive = crossing.primitive;
    hit.instance = crossings->instance;
    hit.primitive = number_in_instance(scene, hit);
    hit.t *= crossings->t_scale;
    uint place = min(count, crossings->limit);
    if (place == crossings->limit && !comes_before(hit, crossings->first[--place])) return;
    for (; place > 0 && comes_before(hit, crossings->first[place - 1]); --place)
        crossings->first[place] = crossings->first[place - 1];
    crossings->first[place] = hit;
}

// Fills the rest of a ray's list with misses, once there is no other chunk or pass.
CASTOR_INLINE void finish_list(const Crossings *crossings, const SceneColumns scene)
{
    if (CASTOR_ANSWERS_GO_ON && (scene.params.flags & CASTOR_TRACE_MORE_FOLLOWS)) return;
    for (uint i = crossings->count; i < crossings->limit; ++i) crossings->first[i] = miss();
}

#if CASTOR_HAS_PIECES
// Whether a comes before b within a tree. Two that are equal are the same.
CASTOR_INLINE int comes_before_in_tree(const Crossing a, const Crossing b)
{
    if (a.t != b.t) return a.t < b.t;
    if (a.primitive != b.primitive) return a.primitive < b.primitive;
    return a.leaves < b.leaves;
}

CASTOR_INLINE void add_to_window(Crossings *crossings, const Crossing crossing)
{
    if (crossings->before.t == crossings->before.t && !comes_before_in_tree(crossings->before, crossing)) return;
    const uint count = crossings->window_count;
    uint place = count;
    while (place > 0 && comes_before_in_tree(crossing, crossings->window[place - 1])) --place;
    if (place > 0 && !comes_before_in_tree(crossings->window[place - 1], crossing)) return;  // it is there already
    if (place == CASTOR_CROSSINGS_WINDOW) return;
    for (uint i = min(count, CASTOR_CROSSINGS_WINDOW - 1); i > place; --i)
        crossings->window[i] = crossings->window[i - 1];
    crossings->window[place] = crossing;
    crossings->window_count = min(count + 1, CASTOR_CROSSINGS_WINDOW);
    if (crossings->window_count == CASTOR_CROSSINGS_WINDOW)
        crossings->t_limit = crossings->window[CASTOR_CROSSINGS_WINDOW - 1].t;
}
#endif

// Begins the crossings within a tree, whose ray reaches to t_max.
CASTOR_INLINE void begin_tree(Crossings *crossings, const float t_max)
{
    crossings->t_limit = t_max;
#if CASTOR_HAS_PIECES
    crossings->before.t = NAN;
    crossings->window_count = 0;
#endif
}

// Takes a crossing that was found within the tree. `leaves`: of a sphere, whether the ray leaves it.
CASTOR_INLINE void add_crossing_of_tree(Crossings *crossings, const SceneColumns scene, const Candidate candidate,
                                        const uint primitive, const uint leaves)
{
    const Crossing crossing = make_crossing(candidate, primitive, leaves);
#if CASTOR_HAS_PIECES
    add_to_window(crossings, crossing);
#else
    add_crossing(crossings, scene, crossing);
#endif
}

// Ends a traversal of the tree. Returns whether it must be traversed again.
CASTOR_INLINE int end_traversal(Crossings *crossings, const SceneColumns scene, const float t_max)
{
#if CASTOR_HAS_PIECES
    const uint count = crossings->window_count;
    for (uint i = 0; i < count; ++i) add_crossing(crossings, scene, crossings->window[i]);
    if (count < CASTOR_CROSSINGS_WINDOW) return 0;
    crossings->before = crossings->window[count - 1];
    crossings->window_count = 0;
    crossings->t_limit = t_max;
    return 1;
#else
    return 0;
#endif
}

CASTOR_INLINE void cross_planes(Crossings *crossings, const SceneColumns scene, const TraceRay ray)
{
    if (!CASTOR_HAS_PLANES) return;
    const uint base = scene.params.triangle_count + scene.params.sphere_count;
    for (uint i = 0; i < scene.params.plane_count; ++i) {
        CASTOR_COUNT(scene, PLANE);
        const Candidate candidate = intersect_plane(ray, scene.plane_point[i].xyz, scene.plane_normal[i].xyz);
        if (candidate.t == candidate.t) add_crossing(crossings, scene, make_crossing(candidate, base + i, 0));
    }
}

// Whether the ray crosses a triangle that it hits.
CASTOR_INLINE int crosses_numbered_triangle(const SceneColumns scene, const TraceRay ray, const uint triangle)
{
    const uint3 corner = vload3(triangle, scene.triangle_vertices);
    return crosses_triangle(sheared_triangle(ray, vload3(corner.x, scene.vertex_position),
                                             vload3(corner.y, scene.vertex_position),
                                             vload3(corner.z, scene.vertex_position)));
}

// Adds the crossings of one primitive: triangles first, then spheres.
CASTOR_INLINE void cross_bounded(Crossings *crossings, const SceneColumns scene, const TraceRay ray,
                                 const uint primitive)
{
    if (!CASTOR_HAS_SPHERES || primitive < scene.params.triangle_count) {
        const Candidate hit = intersect_numbered_triangle(scene, ray, primitive);
        if (hit.t == hit.t && crosses_numbered_triangle(scene, ray, primitive))
            add_crossing_of_tree(crossings, scene, hit, primitive, 0);
        return;
    }
    CASTOR_COUNT(scene, SPHERE);
    const float4 center_radius = scene.sphere_center_radius[primitive - scene.params.triangle_count];
    const Spheres sphere = {center_radius.x, center_radius.y, center_radius.z, center_radius.w};
    const Slabs slabs = slabs_of(ray);
    const BoxPlanes planes = planes_of_spheres(slabs, sphere);
    const Interval interval = slab_test(slabs, planes, ray.t_min, ray.t_max);
    if (!(interval.entry <= interval.exit)) return;
    const SphereRoots roots = sphere_roots(sphere_ray_of(ray), sphere);
    for (uint leaves = 0; leaves < 2; ++leaves) {
        const Candidate hit =
            candidate_of(within_own_box(slabs, planes, ray.t_min, ray.t_max, sphere_crossings(roots, leaves)));
        if (hit.t == hit.t) add_crossing_of_tree(crossings, scene, hit, primitive, leaves);
    }
}
