// Times reflection and refraction by dielectrics, for CASTOR_LANES lanes (see device/lanes.cl). Each lane has one point
// of a surface and writes the sum, over dielectrics of several indices, of the refracted directions times the share of
// light that goes there, and of the reflectances. The number of points is a multiple of the lanes.
#include "device/refraction.lanes.cl"

kernel CASTOR_IN_LANES void LANES(refract_points)(const uint point_count, const uint index_count,
                                                  const global float *restrict indices,
                                                  const global float4 *restrict surface_normal,
                                                  const global float4 *restrict surface_wo,
                                                  global float4 *restrict sums)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= point_count) return;
    const LANES(Vectors) normal = LANES(load_vectors)(surface_normal + i);
    const LANES(Vectors) wo = LANES(load_vectors)(surface_wo + i);
    const Real cos_wo = LANES(dot_products)(normal, wo), zero = (Real)(0.0f);
    LANES(Vectors) refracted = LANES(vectors)(zero, zero, zero);
    Real reflected = zero;
    for (uint k = 0; k < index_count; ++k) {
        const LANES(Refractions) refraction = LANES(refract)((Real)(indices[k]), normal, wo, cos_wo);
        const Real passed = 1.0f - refraction.reflectance;
        const LANES(Vectors) sum = LANES(points_on_rays)(refracted, passed, refraction.direction);
        refracted = LANES(choose_vectors)(passed > 0.0f, sum, refracted);
        reflected += refraction.reflectance;
    }
    LANES(store_rows)(refracted.x, refracted.y, refracted.z, reflected, sums + i);
}
