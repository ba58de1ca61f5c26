// The columns of a scene, and the test of one primitive by its number.
//
// CASTOR_HAS_SPHERES  0 where the scene has none: their arithmetic then costs no ray anything
// CASTOR_HAS_PLANES   likewise
// CASTOR_HAS_INSTANCES  likewise, beside instance 0
// CASTOR_HAS_MOTION   1 where instances may move: then each ray has a time, in one more column. Else all are where
//                     they are at time 0.
// CASTOR_HAS_CHUNKS   0 where the columns are the whole scene's; 1 where they are one chunk's, with the flags
//                     CASTOR_TRACE_GOES_ON and CASTOR_TRACE_MORE_FOLLOWS
// CASTOR_BRUTE_PASS   primitives that a launch of brute force tests, so that none is long, with the flags as for
//                     chunks; 0: all
// CASTOR_COUNT_WORK   1: trace kernels have one more column, in which each work-item counts its work; the answers
//                     stay the same
#include "castor/shared/layout.h"
#include "castor/shared/scene_columns.h"
#include "device/intersect_plane.cl"
#include "device/intersect_sphere.cl"
#include "device/intersect_triangle.cl"

#ifndef CASTOR_HAS_SPHERES
#define CASTOR_HAS_SPHERES 1
#endif
#ifndef CASTOR_HAS_PLANES
#define CASTOR_HAS_PLANES 1
#endif
#ifndef CASTOR_HAS_INSTANCES
#define CASTOR_HAS_INSTANCES 1
#endif
#ifndef CASTOR_HAS_MOTION
#define CASTOR_HAS_MOTION 0
#endif
#ifndef CASTOR_HAS_CHUNKS
#define CASTOR_HAS_CHUNKS 0
#endif
#ifndef CASTOR_BRUTE_PASS
#define CASTOR_BRUTE_PASS 0
#endif
#define CASTOR_ANSWERS_GO_ON (CASTOR_HAS_CHUNKS || CASTOR_BRUTE_PASS)
#ifndef CASTOR_COUNT_WORK
#define CASTOR_COUNT_WORK 0
#endif

// CASTOR_COUNT(scene, NODE): one more of CASTOR_WORK_NODE.
#if CASTOR_COUNT_WORK
#define CASTOR_COUNT(scene, kind) ++(scene).work[CASTOR_WORK_##kind]
#define CASTOR_WORK_PARAMETER , global uint *restrict work
#define CASTOR_WORK_ARGUMENT , work
#else
#define CASTOR_COUNT(scene, kind)
#define CASTOR_WORK_PARAMETER
#define CASTOR_WORK_ARGUMENT
#endif

#if CASTOR_HAS_MOTION
#define CASTOR_TIME_PARAMETER , const global float *restrict ray_time
#define CASTOR_TIME_ARGUMENT , ray_time
#else
#define CASTOR_TIME_PARAMETER
#define CASTOR_TIME_ARGUMENT
#endif

// A column of scene_columns.h as a parameter, an argument, a member of a struct, and a member that is set: _yes where
// the kernel reads the column, _no where it does not.
#define CASTOR_PARAMETER_yes(name, element) , const global element *restrict name
#define CASTOR_PARAMETER_no(name, element)
#define CASTOR_ARGUMENT_yes(name) , name
#define CASTOR_ARGUMENT_no(name)
#define CASTOR_MEMBER_yes(name, element) const global element *name;
#define CASTOR_MEMBER_no(name, element)
#define CASTOR_SET_MEMBER_yes(name) columns.name = name;
#define CASTOR_SET_MEMBER_no(name)

#define CASTOR_TRACED_PARAMETER(name, host, element, per, place, made, trace, surface) \
    CASTOR_PARAMETER_##trace(name, element)
#define CASTOR_TRACED_ARGUMENT(name, host, element, per, place, made, trace, surface) CASTOR_ARGUMENT_##trace(name)
#define CASTOR_TRACED_MEMBER(name, host, element, per, place, made, trace, surface) CASTOR_MEMBER_##trace(name, element)
#define CASTOR_SET_TRACED_MEMBER(name, host, element, per, place, made, trace, surface) CASTOR_SET_MEMBER_##trace(name)

// The first parameters of every trace kernel: the struct TraceParams, then the columns that trace kernels read.
#define CASTOR_SCENE_PARAMETERS                                            \
    const TraceParams params CASTOR_SCENE_COLUMNS(CASTOR_TRACED_PARAMETER) \
    CASTOR_WORK_PARAMETER CASTOR_TIME_PARAMETER
#define CASTOR_SCENE_ARGUMENTS                          \
    params CASTOR_SCENE_COLUMNS(CASTOR_TRACED_ARGUMENT) \
    CASTOR_WORK_ARGUMENT CASTOR_TIME_ARGUMENT

// The same as a value that functions pass on.
typedef struct SceneColumns {
    TraceParams params;
    CASTOR_SCENE_COLUMNS(CASTOR_TRACED_MEMBER)
#if CASTOR_COUNT_WORK
    global uint *work;  // of this work-item: CASTOR_WORK_KINDS counters
#endif
#if CASTOR_HAS_MOTION
    const global float *ray_time;
#endif
} SceneColumns;

CASTOR_INLINE SceneColumns make_scene(CASTOR_SCENE_PARAMETERS)
{
    SceneColumns columns;
    columns.params = params;
    CASTOR_SCENE_COLUMNS(CASTOR_SET_TRACED_MEMBER)
#if CASTOR_COUNT_WORK
    columns.work = work + get_global_id(0) * CASTOR_WORK_KINDS;
#endif
#if CASTOR_HAS_MOTION
    columns.ray_time = ray_time;
#endif
    return columns;
}

// The range that holds the triangle: the last one that begins at or before it.
CASTOR_INLINE MeshRange mesh_of_triangle(const global MeshRange *restrict mesh_ranges, const uint mesh_count,
                                         const uint triangle)
{
    uint first = 0;
    uint count = mesh_count;
    while (count > 1) {
        const uint half_count = count / 2;
        if (mesh_ranges[first + half_count].first_triangle <= triangle) {
            first += half_count;
            count -= half_count;
        } else {
            count = half_count;
        }
    }
    return mesh_ranges[first];
}

CASTOR_INLINE int is_culled(const SceneColumns scene, const uint triangle, const Candidate candidate)
{
    if (!candidate.from_behind || !(scene.params.flags & CASTOR_TRACE_CULL_BACK_FACES)) return 0;
    return mesh_of_triangle(scene.mesh_ranges, scene.params.mesh_count, triangle).first_normal == CASTOR_INVALID_INDEX;
}

CASTOR_INLINE Candidate intersect_numbered_triangle(const SceneColumns scene, const TraceRay ray, const uint triangle)
{
    CASTOR_COUNT(scene, TRIANGLE);
    const uint3 corner = vload3(triangle, scene.triangle_vertices);
    const Candidate candidate =
        intersect_triangle(ray, vload3(corner.x, scene.vertex_position), vload3(corner.y, scene.vertex_position),
                           vload3(corner.z, scene.vertex_position));
    return is_culled(scene, triangle, candidate) ? no_candidate() : candidate;
}

// Triangles first, then spheres.
CASTOR_INLINE Candidate intersect_bounded(const SceneColumns scene, const TraceRay ray, const uint primitive)
{
    if (!CASTOR_HAS_SPHERES || primitive < scene.params.triangle_count)
        return intersect_numbered_triangle(scene, ray, primitive);
    CASTOR_COUNT(scene, SPHERE);
    return intersect_sphere(ray, scene.sphere_center_radius[primitive - scene.params.triangle_count]);
}

CASTOR_INLINE Hit miss(void)
{
    Hit hit;
    hit.t = INFINITY;
    hit.u = 0.0f;
    hit.v = 0.0f;
    hit.primitive = CASTOR_INVALID_INDEX;
    hit.instance = CASTOR_INVALID_INDEX;
    return hit;
}

// The better of the best hit so far in the same instance (its t in the ray's scaled units, t_max where there is none)
// and a candidate: the smaller t, and of equal ones the smaller primitive. NaN is never better.
CASTOR_INLINE Hit nearer_hit(const Hit best, const Candidate candidate, const uint primitive)
{
    if (!(candidate.t < best.t || (candidate.t == best.t && primitive < best.primitive))) return best;
    Hit hit;
    hit.t = candidate.t;
    hit.u = candidate.u;
    hit.v = candidate.v;
    hit.primitive = primitive;
    hit.instance = best.instance;
    return hit;
}

// Whether the answers hold what earlier chunks or passes gave, t in the rays' scaled units.
CASTOR_INLINE int goes_on(const SceneColumns scene)
{
    return CASTOR_ANSWERS_GO_ON && (scene.params.flags & CASTOR_TRACE_GOES_ON);
}

// How far a search goes: to t_max, or to where earlier chunks or passes have a hit. What is hit there as well may still
// be better.
CASTOR_INLINE float search_limit(const SceneColumns scene, const float t_max, const global Hit *answer)
{
    return goes_on(scene) ? smaller(answer->t, t_max) : t_max;
}

// What a search begins with.
CASTOR_INLINE Hit no_hit_yet(const float limit)
{
    Hit hit = miss();
    hit.t = limit;
    hit.instance = 0;
    return hit;
}

// While a search goes on, triangles are numbered over all geometries, then spheres, then planes; this is the number
// within the instance.
CASTOR_INLINE uint number_in_instance(const SceneColumns scene, const Hit hit)
{
#if CASTOR_HAS_CHUNKS
    return scene.primitive_numbers[hit.primitive];
#elif CASTOR_HAS_INSTANCES
    const Geometry geometry = scene.geometries[scene.instances[hit.instance].geometry];
    if (hit.primitive < scene.params.triangle_count) return hit.primitive - geometry.first_triangle;
    const uint after_triangles = hit.primitive - scene.params.triangle_count;
    if (after_triangles < scene.params.sphere_count)
        return geometry.triangle_count + after_triangles - geometry.first_sphere;
    return geometry.triangle_count + geometry.sphere_count + after_triangles - scene.params.sphere_count;
#else
    return hit.primitive;
#endif
}

// The better of the answers of two chunks or passes.
CASTOR_INLINE Hit better_answer(const Hit a, const Hit b)
{
    if (a.t != b.t) return a.t < b.t ? a : b;
    if (a.instance != b.instance) return a.instance < b.instance ? a : b;
    return a.primitive < b.primitive ? a : b;
}

// The end of a search: t in the caller's units, unless another chunk or pass follows. `answer`: where it is going to
// stand.
CASTOR_INLINE Hit finished_hit(const SceneColumns scene, const float t_scale, Hit best, const global Hit *answer)
{
    if (best.primitive == CASTOR_INVALID_INDEX)
        best = miss();
    else
        best.primitive = number_in_instance(scene, best);
    if (goes_on(scene)) best = better_answer(best, *answer);
    if (CASTOR_ANSWERS_GO_ON && (scene.params.flags & CASTOR_TRACE_MORE_FOLLOWS)) return best;
    best.t *= t_scale;
    return best;
}

// Planes have no box: every ray tests all of them.
CASTOR_INLINE Hit nearest_plane(const SceneColumns scene, const TraceRay ray, Hit best)
{
    if (!CASTOR_HAS_PLANES) return best;
    const uint base = scene.params.triangle_count + scene.params.sphere_count;
    for (uint i = 0; i < scene.params.plane_count; ++i) {
        CASTOR_COUNT(scene, PLANE);
        best = nearer_hit(best, intersect_plane(ray, scene.plane_point[i].xyz, scene.plane_normal[i].xyz), base + i);
    }
    return best;
}
