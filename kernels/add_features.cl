// One work-item a pixel, at the first bounce, where each path is at the place of its slot. Adds what the eye rays of
// the samples met to the rows of film_features, in the order of samples, so that the sums have the same bits however
// the samples are divided: albedo, with the number of samples that met anything as w; shading normal; position in the
// world. A miss adds nothing. `row_length`: pixels of a row.
#include "device/albedo_of_hit.cl"
#include "device/slots.cl"

kernel void add_features(const RenderParams params, const uint row_length, const global Material *restrict materials,
                         CASTOR_READ(hits), CASTOR_READ(surface_position), CASTOR_READ(surface_normal),
                         CASTOR_READ(surface_material), CASTOR_READ(surface_diffuse), CASTOR_WRITE(film_features))
{
    const uint place = get_global_id(0);
    if (place >= params.pixel_count) return;
    const uint pixel = pixel_on_curve(params, place);
    float4 albedo = film_features[CASTOR_FEATURE_ALBEDO * row_length + pixel];
    float4 normal = film_features[CASTOR_FEATURE_NORMAL * row_length + pixel];
    float4 position = film_features[CASTOR_FEATURE_POSITION * row_length + pixel];
    for (uint slot = place << params.sample_shift; slot < (place + 1) << params.sample_shift; ++slot) {
        if (hits[slot].primitive == CASTOR_INVALID_INDEX) continue;
        albedo += (float4)(albedo_of_hit(materials, surface_material, surface_diffuse, slot), 1.0f);
        normal.xyz += surface_normal[slot].xyz;
        position.xyz += surface_position[slot].xyz;
    }
    film_features[CASTOR_FEATURE_ALBEDO * row_length + pixel] = albedo;
    film_features[CASTOR_FEATURE_NORMAL * row_length + pixel] = normal;
    film_features[CASTOR_FEATURE_POSITION * row_length + pixel] = position;
}
