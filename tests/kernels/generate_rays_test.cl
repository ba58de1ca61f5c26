// The eye ray's direction through a point of the image, and the offset of a filter for a point of the unit square.
#include "device/camera.cl"

kernel void generate_rays_test(const uint count, const uint filter, const global Camera *restrict cameras,
                               const global float2 *restrict points, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float2 point = points[i];
    const float3 direction = camera_direction(cameras[0], point.x, point.y);
    const float2 offset = filter_offset(filter, point);
    // Not (float8)(direction, ...): Oclgrind 21.10 crashes where a vector of three is widened, as --uninitialized
    // follows lanes that are undefined.
    vstore3(direction, 0, results + 8 * i);
    vstore2(offset, 0, results + 8 * i + 4);
}
