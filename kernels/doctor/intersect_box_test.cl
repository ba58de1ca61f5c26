// (entry, exit) of ray and box, in the caller's units of t.
#include "device/intersect_box.cl"

kernel void intersect_box_test(const uint count, const float largest_coordinate, const global float4 *restrict rays,
                               const global float *restrict lower, const global float *restrict upper,
                               global float2 *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const TraceRay ray = make_trace_ray(rays[2 * i], rays[2 * i + 1], largest_coordinate);
    results[i] = box_interval(ray, vload3(i, lower), vload3(i, upper)) * ray.t_scale;
}
