// One work-item a path. Adds to the film what the surface that its ray met (material CASTOR_INVALID_INDEX: none) sends
// without a light ray: the ambient term, or at `depth` 0 the background.
#include "castor/shared/wave_columns.h"
#include "device/film.cl"
#include "device/shading.cl"

kernel void shade(const RenderParams params, const uint depth, const global Material *restrict materials,
                  CASTOR_READ(path_slot), CASTOR_READ(ray_direction_tmax), CASTOR_READ(surface_material),
                  CASTOR_READ(path_throughput), CASTOR_WRITE(path_terms), CASTOR_WRITE(film_sum),
                  CASTOR_WRITE(film_terms), CASTOR_WRITE(surface_wo))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    const uint slot = path_slot[place];
    const uint terms_of_bounce = 1 + params.light_count;
    const int is_met = surface_material[place] != CASTOR_INVALID_INDEX;
    if (!is_met && depth > 0) return;
    float3 sent = to_float3(params.background);
    if (is_met) {
        const Material material = materials[surface_material[place]];
        sent = path_throughput[slot].xyz * (to_float3(material.ambient) * to_float3(params.ambient));
        surface_wo[place] = (float4)(-normalized(ray_direction_tmax[place].xyz), 0.0f);
    }
    if (params.flags & CASTOR_RENDER_KEEPS_TERMS)
        path_terms[slot] = depth * terms_of_bounce + (is_met ? terms_of_bounce : 1);
    add_term(params, slot, depth * terms_of_bounce, (float4)(sent, 0.0f), film_sum, film_terms);
}
