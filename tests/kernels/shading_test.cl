// What arrives from a light, the falloff of a spot light, and what a material reflects: one row of 16 floats a case.
#include "device/shading.x1.cl"

kernel void shading_test(const uint count, const global Light *restrict lights,
                         const global Material *restrict materials, const global uint *restrict rules,
                         const global float4 *restrict positions, const global float4 *restrict normal_cos_angle,
                         const global float4 *restrict wos, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Light light = lights[i];
    const Materials material = load_materials(materials, i);
    const float4 normal_cos = normal_cos_angle[i];
    const Vectors normal = vectors(normal_cos.x, normal_cos.y, normal_cos.z);
    const LightSamples sample = sample_light(light, load_vectors(positions + i));
    const Vectors reflected = blinn_phong(material, rules[i], normal, load_vectors(wos + i), sample);
    const Vectors mirror = mirror_factor(material, rules[i], normal_cos.w);
    global float4 *result = (global float4 *)results + 4 * i;
    store_rows(sample.wi.x, sample.wi.y, sample.wi.z, sample.distance, result);
    store_rows(sample.irradiance.x, sample.irradiance.y, sample.irradiance.z, spot_falloff(light, normal_cos.w),
               result + 1);
    store_rows(reflected.x, reflected.y, reflected.z,
               conductor_reflectance(material.refraction_index, material.absorption_index, normal_cos.w), result + 2);
    store_rows(mirror.x, mirror.y, mirror.z, 0.0f, result + 3);
}
