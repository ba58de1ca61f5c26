// t of ray and sphere, NaN for a miss.
#include "device/intersect_sphere.cl"

kernel void intersect_sphere_test(const uint count, const float largest_coordinate, const global float4 *restrict rays,
                                  const global float4 *restrict spheres, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const TraceRay ray = make_trace_ray(rays[2 * i], rays[2 * i + 1], largest_coordinate);
    results[i] = ray.valid ? intersect_sphere(ray, spheres[i]).t * ray.t_scale : NAN;
}
