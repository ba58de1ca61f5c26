// Diffuse reflection, for CASTOR_LANES lanes (see lanes.cl): Lambert's, and the energy-preserving Oren-Nayar model
// (EON) of Portsmouth, Kutz, Hill 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF", JCGT 14(1), with its
// clipped linearly transformed cosines (CLTC) for sampling. Directions are unit, in a frame with z along the normal.
#include "device/elementary.lanes.cl"
#include "device/fresnel.lanes.cl"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

// Draws directions with the density cos / pi.
CASTOR_INLINE LANES(Vectors) LANES(sample_cosine)(const LANES(Points) point)
{
    const Real angle = 6.2831855f * point.x, radius = LANES(square_root)(point.y);
    return LANES(vectors)(radius * LANES(cosine)(angle), radius * LANES(sine)(angle),
                          LANES(square_root)(1.0f - point.y));
}

// ---- EON ----

#define CASTOR_FON_1 0.28779343f  // 1/2 - 2/(3 pi)
#define CASTOR_FON_2 0.07248821f  // 2/3 - 28/(15 pi)

// Returns what Fujii's form of the Oren-Nayar model reflects of uniform light where its colour is 1, by the paper's
// approximation, to 0.1 %. a = 1 / (1 + CASTOR_FON_1 r).
CASTOR_INLINE Real LANES(fon_albedo)(const Real cosine, const Real r, const Real a)
{
    const Real x = 1.0f - cosine;
    const Real g = x * fma(fma(fma((Real)(0.0714429953f), x, (Real)(-0.332181442f)), x, (Real)(0.491881867f)), x,
                           (Real)(0.0571085289f));
    return a * fma(r, g, (Real)(1.0f));
}

// Returns the BRDF. `r`: the roughness, in [0, 1].
CASTOR_ONCE LANES(Vectors)
    LANES(eon_value)(const LANES(Vectors) rho, const Real r, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real s = fma(wo.x, wi.x, wo.y * wi.y);
    const Real cosine = LANES(larger)(wo.z, wi.z);
    const Real bent = s > 0.0f ? LANES(divide)(s, cosine > 0.0f ? cosine : one) : s;
    const Real a = LANES(divide)(one, fma((Real)(CASTOR_FON_1), r, one));
    const Real single = CASTOR_INVERSE_PI * a * LANES(larger)(fma(r, bent, one), zero);
    const Real mean = a * fma((Real)(CASTOR_FON_2), r, one), rest = 1.0f - mean;
    const Real lost = LANES(larger)(1.0f - LANES(fon_albedo)(wo.z, r, a), zero) *
                      LANES(larger)(1.0f - LANES(fon_albedo)(wi.z, r, a), zero);
    const Real several =
        rest > 1e-6f ? CASTOR_INVERSE_PI * mean * LANES(divide)(lost, rest > 1e-6f ? rest : one) : zero;
    return LANES(vectors)(fma(single, rho.x, LANES(divide)(several * rho.x * rho.x, fma(-rho.x, rest, one))),
                          fma(single, rho.y, LANES(divide)(several * rho.y * rho.y, fma(-rho.y, rest, one))),
                          fma(single, rho.z, LANES(divide)(several * rho.z * rho.z, fma(-rho.z, rest, one))));
}

// How directions are drawn: uniformly with the probability `uniform`, and else from a cosine lobe that is clipped to
// the side of wo and transformed by the matrix (a 0 b; 0 c 0; d 0 1) in a frame with wo over its x axis.
typedef struct LANES(EonLobes) {
    Real a, b, c, d, determinant;
    Real kept;     // of the disk below the lobe, the share that is not clipped away
    Real x, y;     // direction of the frame's x axis
    Real uniform;  // probability
} LANES(EonLobes);

CASTOR_INLINE LANES(EonLobes) LANES(eon_lobes)(const Real r, const LANES(Vectors) wo)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real mu = wo.z;
    LANES(EonLobes) lobe;
    lobe.a = fma(r,
                 fma(fma((Real)(0.335918f), mu, (Real)(-0.276266f)), r,
                     fma(fma((Real)(0.111709f), mu, (Real)(-0.518982f)), mu, (Real)(0.303392f))),
                 one);
    lobe.b = LANES(divide)(
        r * fma(fma((Real)(-0.150105f), mu, (Real)(0.150815f)), r, fma((Real)(1.15859f), mu, (Real)(-1.16407f))),
        fma(mu * mu, mu, (Real)(-1.43545f)));
    lobe.c = fma(r, fma(fma((Real)(0.261777f), mu, (Real)(-0.506373f)), mu, (Real)(0.20013f)), one);
    lobe.d = LANES(divide)(r * fma(fma((Real)(0.475392f), mu, (Real)(-1.01625f)), mu, (Real)(0.540852f)),
                           fma(mu + 0.0725628f, mu, (Real)(-1.0743f)));
    lobe.determinant = lobe.c * fma(-lobe.b, lobe.d, lobe.a);
    lobe.kept = 0.5f + LANES(divide)((Real)(0.5f), LANES(square_root)(fma(lobe.d, lobe.d, one)));
    const Real radius = LANES(square_root)(fma(wo.x, wo.x, wo.y * wo.y));
    const Mask is_tilted = radius > 1e-6f;
    const Real inverse = LANES(divide)(one, is_tilted ? radius : one);
    lobe.x = is_tilted ? wo.x * inverse : one;
    lobe.y = is_tilted ? wo.y * inverse : zero;
    const Real share =
        fma(fma(fma((Real)(-0.290822f), mu, (Real)(0.538233f)), mu, (Real)(-0.372058f)), mu, (Real)(0.162925f));
    lobe.uniform = share * LANES(power)(r, (Real)(0.1f));
    return lobe;
}

CASTOR_ONCE Real LANES(eon_pdf)(const Real r, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f);
    const LANES(EonLobes) lobe = LANES(eon_lobes)(r, wo);
    const Real x = fma(lobe.x, wi.x, lobe.y * wi.y), y = fma(lobe.x, wi.y, -(lobe.y * wi.x)), z = wi.z;
    const LANES(Vectors) w = LANES(vectors)(lobe.c * fma(-lobe.b, z, x), fma(-lobe.b, lobe.d, lobe.a) * y,
                                            lobe.c * fma(-lobe.d, x, lobe.a * z));
    const Real squared = LANES(dot_products)(w, w);
    const Real inverse = LANES(divide)(lobe.determinant, squared > 0.0f ? squared : (Real)(1.0f));
    const Real clipped = CASTOR_INVERSE_PI * LANES(divide)(inverse * inverse * LANES(larger)(w.z, zero), lobe.kept);
    return fma(lobe.uniform, (Real)(0.5f * CASTOR_INVERSE_PI), (1.0f - lobe.uniform) * clipped);
}

// Draws directions. `choice`: a third uniform number.
CASTOR_ONCE LANES(Vectors)
    LANES(sample_eon)(const Real r, const LANES(Vectors) wo, const Real choice, const LANES(Points) point)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(EonLobes) lobe = LANES(eon_lobes)(r, wo);
    const Real angle = 6.2831855f * point.x, sin_angle = LANES(sine)(angle), cos_angle = LANES(cosine)(angle);
    const Real z = 1.0f - point.y, around = LANES(square_root)(point.y * (1.0f + z));
    const LANES(Vectors) everywhere = LANES(vectors)(around * cos_angle, around * sin_angle, z);

    const Real radius = LANES(square_root)(point.y);
    const Real y = radius * sin_angle, chord = LANES(square_root)(LANES(larger)(fma(-y, y, one), zero));
    const Real x = -fma(lobe.kept, fma(radius, cos_angle, -chord), chord);
    const Real height = LANES(square_root)(LANES(larger)(1.0f - fma(x, x, y * y), zero));
    const Real along = fma(lobe.a, x, lobe.b * height), aside = lobe.c * y;
    const LANES(Vectors) clipped = LANES(normalized_vectors)(LANES(vectors)(
        fma(lobe.x, along, -(lobe.y * aside)), fma(lobe.y, along, lobe.x * aside), fma(lobe.d, x, height)));
    return LANES(choose_vectors)(choice < lobe.uniform, everywhere, clipped);
}
