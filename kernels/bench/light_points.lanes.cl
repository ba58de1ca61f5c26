// Times the shading of points by a light, for CASTOR_LANES lanes (see device/lanes.cl). Each lane has one point of a
// surface and writes what every light of a list together lets it reflect, without shadows. The number of points is a
// multiple of the lanes.
#include "device/shading.lanes.cl"

kernel CASTOR_IN_LANES void LANES(light_points)(const uint point_count, const uint light_count, const Material material,
                                                const uint rules, const global Light *restrict lights,
                                                const global float4 *restrict surface_position,
                                                const global float4 *restrict surface_normal,
                                                const global float4 *restrict surface_wo,
                                                global float4 *restrict reflected)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= point_count) return;
    const LANES(Materials) materials = LANES(same_materials)(material);
    const LANES(Vectors) position = LANES(load_vectors)(surface_position + i);
    const LANES(Vectors) normal = LANES(load_vectors)(surface_normal + i);
    const LANES(Vectors) wo = LANES(load_vectors)(surface_wo + i);
    LANES(Vectors) sum = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    for (uint k = 0; k < light_count; ++k)
        sum = LANES(sum_of_vectors)(
            sum, LANES(reflected_light)(materials, rules, normal, wo, LANES(sample_light)(lights[k], position)));
    LANES(store_vectors)(sum, reflected + i);
}
