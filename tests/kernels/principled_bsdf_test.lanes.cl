// Draws directions from physically based materials, and evaluates them, for CASTOR_LANES lanes (see device/lanes.cl).
// `count` is a multiple of the lanes. `coat_normals`: one a material; w: whether it is the coat's own.
#include "device/principled_bsdf.lanes.cl"

CASTOR_INLINE LANES(PrincipledMaterials)
    LANES(materials_with_coats)(const global PrincipledMaterial *restrict materials,
                                const global float4 *restrict coat_normals, const Real number)
{
    const Whole index = LANES(convert_uint)(number);
    LANES(PrincipledMaterials) material = LANES(load_principled_materials)(materials, index);
    const LANES(Rows) normal = LANES(gather_rows)(coat_normals, index);
    material.coat_normal = LANES(vectors_of_rows)(normal);
    material.has_coat_normal = normal.w != 0.0f;
    return material;
}

// Returns values with what coats add, for the cosine of wi.
CASTOR_INLINE LANES(Vectors) LANES(values_with_coats)(const LANES(BsdfValues) found, const LANES(Vectors) wi)
{
    const Mask has_coat = found.coat > 0.0f;
    const Real coat = has_coat ? LANES(divide)(found.coat, has_coat ? fabs(wi.z) : (Real)(1.0f)) : (Real)(0.0f);
    return LANES(sum_of_vectors)(found.value, LANES(vectors)(coat, coat, coat));
}

// Rows: wo and the choice of a lobe; a point of the unit square, the number of a material, and whether wo is inside.
// Results are three rows: wi and pdf, weight and whether it is a delta, and what evaluate_bsdf says of wi.
kernel CASTOR_IN_LANES void LANES(sample_bsdf_test)(const uint count,
                                                    const global PrincipledMaterial *restrict materials,
                                                    const global float4 *restrict coat_normals,
                                                    const global float4 *restrict wo_choice,
                                                    const global float4 *restrict point_material,
                                                    global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) first = LANES(load_rows)(wo_choice + i), second = LANES(load_rows)(point_material + i);
    const LANES(Vectors) wo = LANES(vectors_of_rows)(first);
    const LANES(PrincipledMaterials) material = LANES(materials_with_coats)(materials, coat_normals, second.z);
    LANES(Bsdfs) bsdf;
    LANES(prepare_bsdf)(&material, wo, second.w != 0.0f, &bsdf);
    LANES(Points) point;
    point.x = second.x;
    point.y = second.y;
    const LANES(BsdfSamples) sample = LANES(sample_bsdf)(&bsdf, wo, first.w, point);
    const LANES(BsdfValues) found = LANES(evaluate_bsdf)(&bsdf, wo, sample.wi);
    const Real is_delta = sample.is_delta ? (Real)(1.0f) : (Real)(0.0f);
    const Whole number = (LANES(lane_numbers)() + i) * 3u;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    LANES(scatter_rows)(sample.wi.x, sample.wi.y, sample.wi.z, sample.pdf, number, all, results);
    const LANES(Vectors) value = LANES(values_with_coats)(found, sample.wi);
    LANES(scatter_rows)
    (sample.weight.x + sample.coat, sample.weight.y + sample.coat, sample.weight.z + sample.coat, is_delta, number + 1u,
     all, results);
    LANES(scatter_rows)(value.x, value.y, value.z, found.pdf, number + 2u, all, results);
}

// Rows: wo and the number of a material; wi and whether wo is inside. Results: the value and pdf of wi.
kernel CASTOR_IN_LANES void LANES(evaluate_bsdf_test)(
    const uint count, const global PrincipledMaterial *restrict materials, const global float4 *restrict coat_normals,
    const global float4 *restrict wo_material, const global float4 *restrict wi_inside, global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) first = LANES(load_rows)(wo_material + i), second = LANES(load_rows)(wi_inside + i);
    const LANES(Vectors) wo = LANES(vectors_of_rows)(first);
    const LANES(PrincipledMaterials) material = LANES(materials_with_coats)(materials, coat_normals, first.w);
    LANES(Bsdfs) bsdf;
    LANES(prepare_bsdf)(&material, wo, second.w != 0.0f, &bsdf);
    const LANES(Vectors) wi = LANES(vectors_of_rows)(second);
    const LANES(BsdfValues) found = LANES(evaluate_bsdf)(&bsdf, wo, wi);
    const LANES(Vectors) value = LANES(values_with_coats)(found, wi);
    LANES(store_rows)(value.x, value.y, value.z, found.pdf, results + i);
}

// Rows: a cosine, a roughness, an index and an anisotropy. Without an index there is no glass; with an anisotropy there
// is the cosine with x in place of an index. Results: the directional albedo of GGX, its part with Schlick's weight,
// that of sheen, and that of glass.
kernel CASTOR_IN_LANES void LANES(albedo_test)(const uint count, const global float4 *restrict cosine_roughness,
                                               global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) row = LANES(load_rows)(cosine_roughness + i);
    const LANES(MicrofacetAlbedos) albedo = LANES(microfacet_albedo)(row.x, row.y);
    LANES(store_rows)
    (row.w > 0.0f ? LANES(stretched_albedo)(row.x, row.z, row.y, row.w) : albedo.all, albedo.grazing,
     LANES(sheen_albedo)(row.x, row.y), row.z > 0.0f ? LANES(glass_albedo)(row.x, row.y, row.z) : (Real)(1.0f),
     results + i);
}
