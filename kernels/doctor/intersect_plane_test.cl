// t of ray and plane, NaN for a miss.
#include "device/intersect_plane.cl"

kernel void intersect_plane_test(const uint count, const global float4 *restrict rays,
                                 const global float *restrict points, const global float *restrict normals,
                                 global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const TraceRay ray = make_trace_ray(rays[2 * i], rays[2 * i + 1], 0.0f);
    results[i] = ray.valid ? intersect_plane(ray, vload3(i, points), vload3(i, normals)).t * ray.t_scale : NAN;
}
