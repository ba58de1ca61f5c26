// Times the shading of a point by a light. Each work-item has one point of a surface and writes what
// every light of a list together lets it reflect, without shadows.
#include "device/shading.cl"

kernel void light_points(const uint point_count, const uint light_count, const Material material, const uint rules,
                         const global Light *restrict lights, const global float4 *restrict surface_position,
                         const global float4 *restrict surface_normal, const global float4 *restrict surface_wo,
                         global float4 *restrict reflected)
{
    const uint i = get_global_id(0);
    if (i >= point_count) return;
    float3 sum = (float3)(0.0f);
    for (uint k = 0; k < light_count; ++k)
        sum += blinn_phong(material, rules, surface_normal[i].xyz, surface_wo[i].xyz,
                           sample_light(lights[k], surface_position[i].xyz));
    reflected[i] = (float4)(sum, 0.0f);
}
