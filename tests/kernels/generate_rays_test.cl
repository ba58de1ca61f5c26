// The eye ray's direction through a point of the image, and the offset of a filter for a point of the unit square.
#include "device/camera.x1.cl"

kernel void generate_rays_test(const uint count, const uint filter, const global Camera *restrict cameras,
                               const global float2 *restrict points, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Points point = {points[i].x, points[i].y};
    const Vectors direction = camera_direction(cameras[0], point);
    const Points offset = filter_offset(filter, point);
    global float *result = results + 8 * i;
    result[0] = direction.x;
    result[1] = direction.y;
    result[2] = direction.z;
    result[4] = offset.x;
    result[5] = offset.y;
}
