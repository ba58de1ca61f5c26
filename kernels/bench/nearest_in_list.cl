// Times one test of a ray against a primitive. Each work-item has one ray, tests it against every primitive of a list
// and writes the nearest hit: its t (INFINITY: none), its number in the list (CASTOR_INVALID_INDEX: none), and how many
// primitives were hit.
//
// CASTOR_TESTED  the function: intersect_triangle, intersect_triangle_plane, intersect_triangle_cramer,
//                intersect_sphere, intersect_plane or box_interval
// CASTOR_ROWS    how many float4 a primitive of the list has: three vertices, centre and radius, a plane's point and
//                normal, or a box's corners
#include "castor/shared/layout.h"
#include "device/intersect_plane.cl"
#include "device/intersect_sphere.cl"
#include "device/intersect_triangle.cl"
#include "device/intersect_triangle_cramer.cl"
#include "device/intersect_triangle_plane.cl"

#ifndef CASTOR_TESTED
#define CASTOR_TESTED intersect_triangle
#define CASTOR_ROWS 3
#endif

// Give all functions one form: test_NAME(ray, rows).
CASTOR_INLINE Candidate test_intersect_triangle(const TraceRay ray, const global float4 *rows)
{
    return intersect_triangle(ray, rows[0].xyz, rows[1].xyz, rows[2].xyz);
}

CASTOR_INLINE Candidate test_intersect_triangle_plane(const TraceRay ray, const global float4 *rows)
{
    return intersect_triangle_plane(ray, rows[0].xyz, rows[1].xyz, rows[2].xyz);
}

CASTOR_INLINE Candidate test_intersect_triangle_cramer(const TraceRay ray, const global float4 *rows)
{
    return intersect_triangle_cramer(ray, rows[0].xyz, rows[1].xyz, rows[2].xyz);
}

CASTOR_INLINE Candidate test_intersect_sphere(const TraceRay ray, const global float4 *rows)
{
    return intersect_sphere(ray, rows[0]);
}

CASTOR_INLINE Candidate test_intersect_plane(const TraceRay ray, const global float4 *rows)
{
    return intersect_plane(ray, rows[0].xyz, rows[1].xyz);
}

CASTOR_INLINE Candidate test_box_interval(const TraceRay ray, const global float4 *rows)
{
    const float2 interval = box_interval(ray, rows[0].xyz, rows[1].xyz);
    Candidate candidate = no_candidate();
    const float entry = larger(interval.x, ray.t_min);
    if (entry <= interval.y) candidate.t = entry;
    return candidate;
}

#define CASTOR_TEST_OF(name) CASTOR_PASTE(test_, name)

kernel void nearest_in_list(const uint ray_count, const uint primitive_count, const float largest_coordinate,
                            const global float4 *restrict rays, const global float4 *restrict primitives,
                            global float *restrict nearest_t, global uint *restrict nearest_number,
                            global uint *restrict hit_count)
{
    const uint i = get_global_id(0);
    if (i >= ray_count) return;
    const TraceRay ray = make_trace_ray(rays[2 * i], rays[2 * i + 1], largest_coordinate);
    float best_t = INFINITY;
    uint best_number = CASTOR_INVALID_INDEX;
    uint hits = 0;
    for (uint k = 0; k < primitive_count; ++k) {
        const Candidate candidate = CASTOR_TEST_OF(CASTOR_TESTED)(ray, primitives + CASTOR_ROWS * k);
        // Some of the functions find t in any range. NaN is not in it.
        const int is_hit = candidate.t >= ray.t_min && candidate.t <= ray.t_max;
        const int is_nearer = is_hit && candidate.t < best_t;
        hits += is_hit;
        best_t = is_nearer ? candidate.t : best_t;
        best_number = is_nearer ? k : best_number;
    }
    nearest_t[i] = best_t * ray.t_scale;
    nearest_number[i] = best_number;
    hit_count[i] = hits;
}
