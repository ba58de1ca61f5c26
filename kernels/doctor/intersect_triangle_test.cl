// One of the three triangle tests, over pairs of a ray and a triangle: (t, u, v, from behind), t = NaN for a miss.
#include "device/intersect_triangle.cl"
#include "device/intersect_triangle_cramer.cl"
#include "device/intersect_triangle_plane.cl"

#define CASTOR_TEST_WATERTIGHT 0u
#define CASTOR_TEST_PLANE 1u
#define CASTOR_TEST_CRAMER 2u

Candidate intersect_by(const uint function, const TraceRay ray, const float3 p0, const float3 p1, const float3 p2)
{
    if (function == CASTOR_TEST_WATERTIGHT) return intersect_triangle(ray, p0, p1, p2);
    const Candidate candidate = function == CASTOR_TEST_PLANE ? intersect_triangle_plane(ray, p0, p1, p2)
                                                              : intersect_triangle_cramer(ray, p0, p1, p2);
    return candidate.t >= ray.t_min && candidate.t <= ray.t_max ? candidate : no_candidate();
}

kernel void intersect_triangle_test(const uint count, const uint function, const float largest_coordinate,
                                    const global float4 *restrict rays, const global float *restrict vertices,
                                    global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const TraceRay ray = make_trace_ray(rays[2 * i], rays[2 * i + 1], largest_coordinate);
    Candidate candidate = no_candidate();
    if (ray.valid)
        candidate = intersect_by(function, ray, vload3(3 * i, vertices), vload3(3 * i + 1, vertices),
                                 vload3(3 * i + 2, vertices));
    results[4 * i] = candidate.t * ray.t_scale;
    results[4 * i + 1] = candidate.u;
    results[4 * i + 2] = candidate.v;
    results[4 * i + 3] = convert_float(candidate.from_behind);
}
