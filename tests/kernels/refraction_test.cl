// Fresnel's reflectance, the refracted direction, what an absorbing way leaves, and a rough direction: three rows of
// floats a case.
#include "device/refraction.x1.cl"

kernel void refraction_test(const uint count, const global float4 *restrict normal_index,
                            const global float4 *restrict wo_length, const global float4 *restrict absorption_roughness,
                            const global float2 *restrict points, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Vectors normal = load_vectors(normal_index + i), wo = load_vectors(wo_length + i);
    const Refractions refraction = refract(normal_index[i].w, normal, wo, dot_products(normal, wo));
    const Vectors left = transmittance(load_vectors(absorption_roughness + i), wo_length[i].w);
    Points point;
    point.x = points[i].x;
    point.y = points[i].y;
    const Vectors rough = rough_directions(wo, absorption_roughness[i].w, point);
    global float4 *result = (global float4 *)results + 3 * i;
    store_rows(refraction.direction.x, refraction.direction.y, refraction.direction.z, refraction.reflectance, result);
    store_rows(left.x, left.y, left.z, 0.0f, result + 1);
    store_rows(rough.x, rough.y, rough.z, 0.0f, result + 2);
}
