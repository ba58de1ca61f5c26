// One work-item a slot. Writes the surface that its ray met, if the chunk has it; material CASTOR_INVALID_INDEX: the
// ray met nothing.
#include "device/surface.cl"

kernel void find_surface(const uint slot_count, CASTOR_SURFACE_PARAMETERS,
                         const global float4 *restrict ray_origin_tmin,
                         const global float4 *restrict ray_direction_tmax, const global Hit *restrict hits,
                         global float4 *restrict surface_position, global float4 *restrict surface_normal,
                         global uint *restrict surface_material)
{
    const uint slot = get_global_id(0);
    if (slot >= slot_count) return;
    const Hit hit = hits[slot];
    if (hit.primitive == CASTOR_INVALID_INDEX) {
        surface_material[slot] = CASTOR_INVALID_INDEX;
        return;
    }
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const Surface surface =
        surface_of_hit(columns, primitive, hit, ray_origin_tmin[slot].xyz, ray_direction_tmax[slot].xyz);
    surface_position[slot] = (float4)(surface.position, 0.0f);
    surface_normal[slot] = (float4)(surface.normal, 0.0f);
    surface_material[slot] = surface.material;
}
