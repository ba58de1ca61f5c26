// Microfacets of GGX's distribution, for CASTOR_LANES lanes (see lanes.cl): Walter and others 2007, "Microfacet Models
// for Refraction through Rough Surfaces"; the height-correlated Smith term of Heitz 2014, "Understanding the
// Masking-Shadowing Function in Microfacet-Based BRDFs". Directions are unit and lie in a frame with z along the normal
// and x along the direction of alpha_x.
#include "castor/shared/principled_material.h"
#include "device/elementary.lanes.cl"
#include "device/fresnel.lanes.cl"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

// Microfacets as they are seen along wo.
typedef struct LANES(Microfacets) {
    Real alpha_x, alpha_y;  // not below CASTOR_LEAST_ALPHA, nor above 1
    Real inverse_x, inverse_y;
    Real stretched;  // length of wo after x and y are multiplied by alpha
    Real bound;      // of the spherical cap for rays that are reflected: see sample_normals
} LANES(Microfacets);

CASTOR_INLINE Real LANES(stretched_length)(const Real alpha_x, const Real alpha_y, const LANES(Vectors) v)
{
    const Real x = alpha_x * v.x, y = alpha_y * v.y;
    return LANES(square_root)(fma(x, x, fma(y, y, v.z * v.z)));
}

// The bound is that of Eto, Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX Reflections", equation 5.
CASTOR_INLINE LANES(Microfacets) LANES(see_microfacets)(const Real alpha_x, const Real alpha_y, const LANES(Vectors) wo)
{
    const Real one = (Real)(1.0f), least = (Real)(CASTOR_LEAST_ALPHA);
    LANES(Microfacets) facets;
    facets.alpha_x = clamp(alpha_x, least, one);
    facets.alpha_y = clamp(alpha_y, least, one);
    facets.inverse_x = LANES(divide)(one, facets.alpha_x);
    facets.inverse_y = LANES(divide)(one, facets.alpha_y);
    facets.stretched = LANES(stretched_length)(facets.alpha_x, facets.alpha_y, wo);
    const Real a = LANES(smaller)(facets.alpha_x, facets.alpha_y), a2 = a * a;
    const Real s = 1.0f + LANES(square_root)(fma(wo.x, wo.x, wo.y * wo.y)), s2 = s * s;
    facets.bound = LANES(divide)((1.0f - a2) * s2, fma(a2, wo.z * wo.z, s2));
    return facets;
}

// Returns D, the density of normals h of microfacets.
CASTOR_INLINE Real LANES(density_of_normals)(const LANES(Microfacets) facets, const LANES(Vectors) h)
{
    const Real x = h.x * facets.inverse_x, y = h.y * facets.inverse_y;
    const Real q = fma(x, x, fma(y, y, h.z * h.z));
    return LANES(divide)(CASTOR_INVERSE_PI * facets.inverse_x * facets.inverse_y, q * q);
}

// Returns G2 / (4 cos_wo |cos_wi|), both cosines being positive.
CASTOR_INLINE Real LANES(visibility)(const LANES(Microfacets) facets, const Real cos_wo, const LANES(Vectors) wi)
{
    const Real cos_wi = fabs(wi.z);
    const Real stretched_wi = LANES(stretched_length)(facets.alpha_x, facets.alpha_y, wi);
    return LANES(divide)((Real)(0.5f), fma(cos_wi, facets.stretched, cos_wo * stretched_wi));
}

// Draws normals of those that are seen along wo (Dupuy, Benyoub 2023, "Sampling Visible GGX Normals with Spherical
// Caps"). `bound`: 1, or that of the microfacets, which leaves out normals that reflect wo into the surface.
CASTOR_INLINE LANES(Vectors) LANES(sample_normals)(const LANES(Microfacets) facets, const Real bound,
                                                   const LANES(Vectors) wo, const LANES(Points) point)
{
    const Real inverse = LANES(divide)((Real)(1.0f), facets.stretched);
    const LANES(Vectors) std =
        LANES(vectors)(facets.alpha_x * wo.x * inverse, facets.alpha_y * wo.y * inverse, wo.z * inverse);
    const Real below_top = point.y * fma(bound, std.z, (Real)(1.0f));  // 1 - z of the cap's point
    const Real radius = LANES(square_root)(below_top * LANES(larger)(2.0f - below_top, (Real)(0.0f)));
    const Real angle = 6.2831855f * point.x;
    const Real x = fma(radius, LANES(cosine)(angle), std.x), y = fma(radius, LANES(sine)(angle), std.y);
    return LANES(normalized_vectors)(
        LANES(vectors)(facets.alpha_x * x, facets.alpha_y * y, (1.0f - below_top) + std.z));
}

// Returns the density of the directions in which normals so drawn reflect wo. `density`: D of the normal.
CASTOR_INLINE Real LANES(reflection_pdf)(const LANES(Microfacets) facets, const Real bound, const Real cos_wo,
                                         const Real density)
{
    return LANES(divide)(0.5f * density, fma(bound, cos_wo, facets.stretched));
}
