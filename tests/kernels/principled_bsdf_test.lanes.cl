// Draws directions from physically based materials, and evaluates them, for CASTOR_LANES lanes (see device/lanes.cl).
// `count` is a multiple of the lanes.
#include "device/principled_bsdf.lanes.cl"

// Rows: wo and the choice of a lobe; a point of the unit square, the number of a material, and whether wo is inside.
// Results are three rows: wi and pdf, weight and whether it is a delta, and what evaluate_bsdf says of wi.
kernel CASTOR_IN_LANES void LANES(sample_bsdf_test)(const uint count,
                                                    const global PrincipledMaterial *restrict materials,
                                                    const global float4 *restrict wo_choice,
                                                    const global float4 *restrict point_material,
                                                    global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) first = LANES(load_rows)(wo_choice + i), second = LANES(load_rows)(point_material + i);
    const LANES(Vectors) wo = LANES(vectors_of_rows)(first);
    const LANES(PrincipledMaterials) material =
        LANES(gather_principled_materials)(materials, LANES(convert_uint)(second.z));
    const LANES(Bsdfs) bsdf = LANES(prepare_bsdf)(material, wo, second.w != 0.0f);
    LANES(Points) point;
    point.x = second.x;
    point.y = second.y;
    const LANES(BsdfSamples) sample = LANES(sample_bsdf)(bsdf, wo, first.w, point);
    const LANES(BsdfValues) found = LANES(evaluate_bsdf)(bsdf, wo, sample.wi);
    const Real is_delta = sample.is_delta ? (Real)(1.0f) : (Real)(0.0f);
    const Whole number = (LANES(lane_numbers)() + i) * 3u;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    LANES(scatter_rows)(sample.wi.x, sample.wi.y, sample.wi.z, sample.pdf, number, all, results);
    LANES(scatter_rows)(sample.weight.x, sample.weight.y, sample.weight.z, is_delta, number + 1u, all, results);
    LANES(scatter_rows)(found.value.x, found.value.y, found.value.z, found.pdf, number + 2u, all, results);
}

// Rows: wo and the number of a material; wi and whether wo is inside. Results: the value and pdf of wi.
kernel CASTOR_IN_LANES void LANES(evaluate_bsdf_test)(const uint count,
                                                      const global PrincipledMaterial *restrict materials,
                                                      const global float4 *restrict wo_material,
                                                      const global float4 *restrict wi_inside,
                                                      global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) first = LANES(load_rows)(wo_material + i), second = LANES(load_rows)(wi_inside + i);
    const LANES(Vectors) wo = LANES(vectors_of_rows)(first);
    const LANES(PrincipledMaterials) material =
        LANES(gather_principled_materials)(materials, LANES(convert_uint)(first.w));
    const LANES(Bsdfs) bsdf = LANES(prepare_bsdf)(material, wo, second.w != 0.0f);
    const LANES(BsdfValues) found = LANES(evaluate_bsdf)(bsdf, wo, LANES(vectors_of_rows)(second));
    LANES(store_rows)(found.value.x, found.value.y, found.value.z, found.pdf, results + i);
}

// Rows: a cosine, a roughness. Results: the directional albedo of GGX, its part with Schlick's weight, that of sheen,
// and the average of the first less the second.
kernel CASTOR_IN_LANES void LANES(albedo_test)(const uint count, const global float4 *restrict cosine_roughness,
                                               global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) row = LANES(load_rows)(cosine_roughness + i);
    const LANES(MicrofacetAlbedos) albedo = LANES(microfacet_albedo)(row.x, row.y);
    LANES(store_rows)
    (albedo.all, albedo.grazing, LANES(sheen_albedo)(row.x, row.y), LANES(mean_albedo_part)(0, row.y), results + i);
}
