// One ray made ready for traversal: TraceRay.
#include "castor/shared/types.h"
#include "device/ray.x1.cl"

CASTOR_INLINE float3 ray_origin(const TraceRay ray) { return (float3)(ray.origin_x, ray.origin_y, ray.origin_z); }

CASTOR_INLINE float3 ray_direction(const TraceRay ray)
{
    return (float3)(ray.direction_x, ray.direction_y, ray.direction_z);
}

CASTOR_INLINE TraceRay make_trace_ray(const float4 origin_tmin, const float4 direction_tmax,
                                      const float largest_coordinate)
{
    TraceRay ray;
    ray.origin_x = origin_tmin.x;
    ray.origin_y = origin_tmin.y;
    ray.origin_z = origin_tmin.z;
    ray.t_min = origin_tmin.w;
    ray.direction_x = direction_tmax.x;
    ray.direction_y = direction_tmax.y;
    ray.direction_z = direction_tmax.z;
    ray.t_max = direction_tmax.w;
    return prepare_ray(ray, 1, largest_coordinate);
}

// Loads ray i of two columns, or of one buffer of Ray records that is given twice, and makes it ready.
CASTOR_INLINE TraceRay load_ray(const TraceParams params, const uint i, const global float4 *restrict ray_origin_tmin,
                                const global float4 *restrict ray_direction_tmax)
{
    const size_t row = (size_t)i * params.ray_stride;
    return make_trace_ray(ray_origin_tmin[row], ray_direction_tmax[row + params.direction_offset],
                          params.largest_coordinate);
}
