// One work-item a slot, whose place is the same, with one sample a pixel. Writes the texture coordinates of what the
// eye ray met, if the chunk has it.
#include "castor/shared/wave_columns.h"
#include "device/slots.cl"
#include "device/textured_point.cl"

kernel void write_uvs(const RenderParams render_params, CASTOR_SURFACE_PARAMETERS,
                      const global float *restrict vertex_uv, CASTOR_READ(ray_origin_tmin),
                      CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_WRITE(aov_uv))
{
    const uint slot = get_global_id(0);
    if (slot >= render_params.pixel_count) return;
    const Hit hit = hits[slot];
    if (hit.primitive == CASTOR_INVALID_INDEX) return;
    const SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const TexturedPoint point =
        textured_point(columns, vertex_uv, primitive, hit, ray_origin_tmin[slot].xyz, ray_direction_tmax[slot].xyz, 0);
    aov_uv[pixel_on_curve(render_params, slot)] = (float4)(point.uv, 0.0f, 0.0f);
}
