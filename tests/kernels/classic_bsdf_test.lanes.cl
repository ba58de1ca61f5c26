// Draws directions from materials of the scene format, and evaluates them, for CASTOR_LANES lanes (see
// device/lanes.cl). `count` is a multiple of the lanes. The normal is z.
#define CASTOR_TRACES_PATHS 1
#define CASTOR_HAS_BRDFS 1
#define CASTOR_HAS_DIELECTRICS 1
#include "device/classic_bsdf.lanes.cl"

// Rows: wo and the choice of a lobe; a point of the unit square and the number of a material; a direction to evaluate
// (w: 0: the one that is drawn). Results are three rows: the direction that is drawn and its density, its weight, and
// value and density of the direction that is evaluated.
kernel CASTOR_IN_LANES void LANES(classic_bsdf_test)(const uint count, const RenderParams params, const PathParams path,
                                                     const global Material *restrict materials,
                                                     const global float4 *restrict wo_choice,
                                                     const global float4 *restrict point_material,
                                                     const global float4 *restrict wi, global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Rows) first = LANES(load_rows)(wo_choice + i), second = LANES(load_rows)(point_material + i);
    const LANES(Rows) third = LANES(load_rows)(wi + i);
    const LANES(Materials) material = LANES(load_materials)(materials, LANES(convert_uint)(second.z));
    const LANES(ClassicBsdfs) bsdf =
        LANES(classic_bsdfs)(params, path, material, LANES(vectors)(zero, zero, one), LANES(vectors_of_rows)(first));
    LANES(Points) at;
    at.x = second.x;
    at.y = second.y;
    const LANES(ClassicSamples) sample = LANES(sample_classic)(bsdf, first.w, at);
    const LANES(Vectors) evaluated =
        LANES(choose_vectors)(third.w != 0.0f, LANES(vectors_of_rows)(third), sample.direction);
    const LANES(Vectors) value = LANES(classic_values)(bsdf, evaluated);
    const Real density = LANES(classic_densities)(bsdf, evaluated);
    const Whole number = (LANES(lane_numbers)() + i) * 3u;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    LANES(scatter_rows)
    (sample.direction.x, sample.direction.y, sample.direction.z, sample.density, number, all, results);
    LANES(scatter_rows)(sample.weight.x, sample.weight.y, sample.weight.z, zero, number + 1u, all, results);
    LANES(scatter_rows)(value.x, value.y, value.z, density, number + 2u, all, results);
}
