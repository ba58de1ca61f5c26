// One work-item a slot, whose place is the same, with one sample a pixel. Writes what the eye ray met. A miss: position
// and normal 0, depth infinite, indices CASTOR_INVALID_INDEX, albedo 0, uv 0.
#include "device/albedo_of_hit.cl"
#include "device/slots.cl"
#include "device/vector.cl"

kernel void write_aovs(const RenderParams params, const global Material *restrict materials,
                       CASTOR_READ(ray_origin_tmin), CASTOR_READ(hits), CASTOR_READ(surface_position),
                       CASTOR_READ(surface_normal), CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse),
                       CASTOR_READ(surface_uv), CASTOR_WRITE(aov_position_depth), CASTOR_WRITE(aov_normal),
                       CASTOR_WRITE(aov_barycentric_t), CASTOR_WRITE(aov_primitive_instance_material),
                       CASTOR_WRITE(aov_albedo), CASTOR_WRITE(aov_uv))
{
    const uint slot = get_global_id(0);
    if (slot >= params.pixel_count) return;
    const uint pixel = pixel_on_curve(params, slot);
    const Hit hit = hits[slot];
    const int is_hit = hit.primitive != CASTOR_INVALID_INDEX;
    const float3 position = is_hit ? surface_position[slot].xyz : (float3)(0.0f);
    const float depth = is_hit ? vector_length(position - ray_origin_tmin[slot].xyz) : INFINITY;
    aov_position_depth[pixel] = (float4)(position, depth);
    aov_normal[pixel] = is_hit ? (float4)(surface_normal[slot].xyz, 0.0f) : (float4)(0.0f);
    aov_barycentric_t[pixel] = (float4)(hit.u, hit.v, hit.t, 0.0f);
    const float3 albedo = is_hit ? albedo_of_hit(materials, surface_material, surface_diffuse, slot) : (float3)(0.0f);
    aov_albedo[pixel] = (float4)(albedo, 0.0f);
    aov_uv[pixel] = (float4)(surface_uv[slot], 0.0f, 0.0f);
    const uint material = is_hit ? materials[surface_material[slot]].number : CASTOR_INVALID_INDEX;
    aov_primitive_instance_material[pixel] = (uint4)(hit.primitive, hit.instance, material, 0u);
}
