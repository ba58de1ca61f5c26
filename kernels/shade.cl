// One work-item a slot. Adds to the film what the surface that its ray met (material CASTOR_INVALID_INDEX: none) sends
// without a light ray: the ambient term, or at `depth` 0 the background.
#include "device/shading.cl"

kernel void shade(const RenderParams params, const uint depth, const global Material *restrict materials,
                  const global float4 *restrict ray_direction_tmax, const global uint *restrict surface_material,
                  const global float4 *restrict path_throughput, global float4 *restrict film_sum,
                  global float4 *restrict surface_wo)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    if (surface_material[slot] == CASTOR_INVALID_INDEX) {
        if (depth == 0) film_sum[slot] += (float4)(to_float3(params.background), 0.0f);
        return;
    }
    const Material material = materials[surface_material[slot]];
    const float3 ambient = to_float3(material.ambient) * to_float3(params.ambient);
    film_sum[slot] += (float4)(path_throughput[slot].xyz * ambient, 0.0f);
    surface_wo[slot] = (float4)(-normalized(ray_direction_tmax[slot].xyz), 0.0f);
}
