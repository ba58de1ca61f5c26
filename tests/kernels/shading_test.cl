// What arrives from a light, the falloff of a spot light, and what a material reflects: one row of 16 floats a case.
#include "device/shading.cl"

kernel void shading_test(const uint count, const global Light *restrict lights,
                         const global Material *restrict materials, const global uint *restrict rules,
                         const global float4 *restrict positions, const global float4 *restrict normal_cos_angle,
                         const global float4 *restrict wos, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const Light light = lights[i];
    const Material material = materials[i];
    const float cos_angle = normal_cos_angle[i].w;
    const LightSample sample = sample_light(light, positions[i].xyz);
    const float3 reflected = blinn_phong(material, rules[i], normal_cos_angle[i].xyz, wos[i].xyz, sample);
    const float reflectance = conductor_reflectance(material.refraction_index, material.absorption_index, cos_angle);
    global float *result = results + 16 * i;
    vstore3(sample.wi, 0, result);
    result[3] = sample.distance;
    vstore3(sample.irradiance, 0, result + 4);
    result[7] = spot_falloff(light, cos_angle);
    vstore3(reflected, 0, result + 8);
    result[11] = reflectance;
    vstore3(mirror_factor(material, rules[i], cos_angle), 0, result + 12);
}
