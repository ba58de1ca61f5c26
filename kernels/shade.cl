// One work-item a slot. Turns its hit into a surface (material CASTOR_INVALID_INDEX: none), and adds to the film what needs no light ray:
// the ambient term, or at `depth` 0 the background.
#include "device/shading.cl"
#include "device/surface.cl"

kernel void shade(const RenderParams params, const uint depth, CASTOR_SURFACE_PARAMETERS,
                  const global Material *restrict materials, const global float4 *restrict ray_origin_tmin,
                  const global float4 *restrict ray_direction_tmax, const global Hit *restrict hits,
                  const global float4 *restrict path_throughput, global float4 *restrict film_sum,
                  global float4 *restrict surface_position, global float4 *restrict surface_normal,
                  global float4 *restrict surface_wo, global uint *restrict surface_material)
{
    const uint slot = get_global_id(0);
    if (slot >= params.slot_count) return;
    const Hit hit = hits[slot];
    if (hit.primitive == CASTOR_INVALID_INDEX) {
        surface_material[slot] = CASTOR_INVALID_INDEX;
        if (depth == 0) film_sum[slot] += (float4)(to_float3(params.background), 0.0f);
        return;
    }
    const float3 direction = ray_direction_tmax[slot].xyz;
    const Surface surface = surface_of_hit(params, hit, ray_origin_tmin[slot].xyz, direction, CASTOR_SURFACE_ARGUMENTS);
    const Material material = materials[surface.material];
    const float3 ambient = to_float3(material.ambient) * to_float3(params.ambient);
    film_sum[slot] += (float4)(path_throughput[slot].xyz * ambient, 0.0f);
    surface_position[slot] = (float4)(surface.position, 0.0f);
    surface_normal[slot] = (float4)(surface.normal, 0.0f);
    surface_wo[slot] = (float4)(-normalized(direction), 0.0f);
    surface_material[slot] = surface.material;
}
