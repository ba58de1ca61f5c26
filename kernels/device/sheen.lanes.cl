// Sheen of fibres that stand upright, for CASTOR_LANES lanes (see lanes.cl): Estevez, Kulla 2017, "Production Friendly
// Microfacet Sheen BRDF", as glTF's KHR_materials_sheen asks. Directions are unit, in a frame with z along the normal.
#include "device/albedo.lanes.cl"
#include "device/elementary.lanes.cl"
#include "device/fresnel.lanes.cl"
#include "device/vector.lanes.cl"

// Returns the exponent of the fitted Lambda; t = (1 - alpha)^2.
CASTOR_INLINE Real LANES(sheen_exponent)(const Real cosine, const Real t)
{
    const Real a = fma(t, (Real)(25.3245f - 21.5473f), (Real)(21.5473f));
    const Real b = fma(t, (Real)(3.32435f - 3.82987f), (Real)(3.82987f));
    const Real c = fma(t, (Real)(0.16801f - 0.19823f), (Real)(0.19823f));
    const Real d = fma(t, (Real)(-1.27393f + 1.97760f), (Real)(-1.97760f));
    const Real e = fma(t, (Real)(-4.85967f + 4.32054f), (Real)(-4.32054f));
    return LANES(divide)(a, fma(b, LANES(power)(cosine, c), (Real)(1.0f))) + fma(d, cosine, e);
}

CASTOR_INLINE Real LANES(sheen_lambda)(const Real cosine, const Real t)
{
    const Mask is_steep = cosine < 0.5f;
    const Real exponent = LANES(sheen_exponent)(is_steep ? cosine : LANES(larger)(1.0f - cosine, (Real)(0.0f)), t);
    return LANES(exponential)(is_steep ? exponent : 2.0f * LANES(sheen_exponent)((Real)(0.5f), t) - exponent);
}

// Returns the BRDF of colour 1. `roughness`: not below CASTOR_LEAST_SHEEN_ROUGHNESS. The visibility is at most 1, as in
// Khronos' viewer, and where the albedo of one of the directions is still above 1, that is divided out.
CASTOR_ONCE Real LANES(sheen_value)(const Real roughness, const LANES(Vectors) wo, const LANES(Vectors) wi,
                                    const Real albedo_wo, const Real albedo_wi)
{
    const Real one = (Real)(1.0f);
    const Real alpha = roughness * roughness, inverse = LANES(divide)(one, alpha);
    const LANES(Vectors) sum = LANES(sum_of_vectors)(wo, wi);
    const Real aside = fma(sum.x, sum.x, sum.y * sum.y), all = fma(sum.z, sum.z, aside);
    const Real sine_squared = LANES(divide)(aside, all > 0.0f ? all : one);
    const Real density =
        (0.5f * CASTOR_INVERSE_PI) * (2.0f + inverse) * LANES(power)(LANES(smaller)(sine_squared, one), 0.5f * inverse);
    const Real t = (1.0f - alpha) * (1.0f - alpha);
    const Real lambdas = 1.0f + LANES(sheen_lambda)(wo.z, t) + LANES(sheen_lambda)(wi.z, t);
    const Real seen = LANES(divide)(one, LANES(larger)(4.0f * lambdas * (wo.z * wi.z), one));
    return LANES(divide)(density * seen, LANES(larger)(LANES(larger)(albedo_wo, albedo_wi), one));
}
