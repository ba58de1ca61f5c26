// How surfaces of the scene format's materials scatter the light of traced paths, for CASTOR_LANES lanes (see
// lanes.cl). A BSDF is three functions that agree with one another: its value, the directions that are drawn from it,
// and the density of these. A new lobe takes part in all three.
//
// Surfaces have two sides, and the frame is turned to the viewer's; only dielectrics know inside and outside.
#include "device/frame.lanes.cl"
#include "device/random.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/shading.lanes.cl"

#define CASTOR_INVERSE_TWO_PI 0.15915494f

typedef struct LANES(ClassicBsdfs) {
    LANES(Materials) material;
    LANES(Vectors) normal, wo;  // both on the viewer's side
    Real cos_wo;
    Mask is_inside;         // a dielectric that is seen from within
    Mask is_dielectric;     // which reflects and refracts, and does nothing else
    LANES(Vectors) mirror;  // what a mirrored ray's light is multiplied by
    Real mirror_share;      // the probability of drawing the mirrored direction (of dielectrics: that or the refracted)
    Real highlight_share;   // of drawing others from the highlight
    Mask is_drawn_uniformly;  // all but mirrored directions are
} LANES(ClassicBsdfs);

// `normal`: outward, unit. `wo`: unit.
CASTOR_INLINE LANES(ClassicBsdfs)
    LANES(classic_bsdfs)(const RenderParams params, const PathParams path, const LANES(Materials) material,
                         const LANES(Vectors) normal, const LANES(Vectors) wo)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real cos_wo = LANES(dot_products)(normal, wo);
    const Mask is_behind = !(cos_wo > 0.0f);
    LANES(ClassicBsdfs) bsdf;
    bsdf.material = material;
    bsdf.normal = LANES(choose_vectors)(is_behind, LANES(scaled_vectors)(normal, (Real)(-1.0f)), normal);
    bsdf.wo = wo;
    bsdf.cos_wo = fabs(cos_wo);
    bsdf.is_dielectric = material.kind == CASTOR_MATERIAL_DIELECTRIC;
    bsdf.is_inside = bsdf.is_dielectric & is_behind;
    bsdf.mirror = LANES(mirror_factor)(
        material, (params.flags & CASTOR_RULE_MIRROR_ANY_MATERIAL) | CASTOR_RULE_MIRROR_CONDUCTOR, bsdf.cos_wo);
    const Real mirror = LANES(largest_of)(bsdf.mirror), matt = LANES(largest_of)(material.diffuse);
    const Real highlight = LANES(largest_of)(material.specular);
    const Real others = matt + highlight, all = mirror + others;
    bsdf.mirror_share = bsdf.is_dielectric ? one : all > 0.0f ? LANES(divide)(mirror, all > 0.0f ? all : one) : zero;
    bsdf.highlight_share = others > 0.0f ? LANES(divide)(highlight, others > 0.0f ? others : one) : zero;
    bsdf.is_drawn_uniformly = (Whole)(path.flags & CASTOR_PATH_BY_BRDF) == 0u;
    return bsdf;
}

// Tells which surfaces send light to other directions than the mirrored or refracted one.
CASTOR_INLINE Mask LANES(are_matt)(const LANES(ClassicBsdfs) bsdf)
{
    const LANES(Materials) m = bsdf.material;
    return (LANES(largest_of)(m.diffuse) + LANES(largest_of)(m.specular) > 0.0f) & !bsdf.is_dielectric;
}

// Returns the values of the BRDF for light from `wi`, times the cosine of wi; (0,0,0) from below. Mirrors do not count.
CASTOR_ONCE LANES(Vectors) LANES(classic_values)(const LANES(ClassicBsdfs) bsdf, const LANES(Vectors) wi)
{
    const Real one = (Real)(1.0f);
    LANES(LightSamples) light;
    light.wi = wi;
    light.distance = (Real)(INFINITY);
    light.irradiance = LANES(vectors)(one, one, one);
    light.point = wi;
    light.density = one;
    return LANES(reflected_light)(bsdf.material, 0u, bsdf.normal, bsdf.wo, light);
}

// The axis of the highlight is the mirrored direction (Phong), or the normal, around which half vectors lie.
CASTOR_INLINE Mask LANES(are_phong)(const LANES(Materials) material)
{
#if CASTOR_HAS_BRDFS
    const Whole model = material.brdf & CASTOR_BRDF_MODEL_MASK;
    return (model == CASTOR_BRDF_PHONG) | (model == CASTOR_BRDF_MODIFIED_PHONG);
#else
    return (Whole)(0) != 0u;
#endif
}

CASTOR_INLINE LANES(Vectors) LANES(mirrored_directions)(const LANES(ClassicBsdfs) bsdf)
{
    return LANES(difference_of_vectors)(LANES(scaled_vectors)(bsdf.normal, 2.0f * bsdf.cos_wo), bsdf.wo);
}

// Returns the densities with which the highlight draws wi: (p + 1) / (2 pi) cos^p, of half vectors divided by 4 wo.h
// (Walter 2005, "Notes on the Ward BRDF", equation 15).
CASTOR_INLINE Real LANES(highlight_densities)(const LANES(ClassicBsdfs) bsdf, const LANES(Vectors) wi)
{
    const Real one = (Real)(1.0f), zero = (Real)(0.0f);
    const Mask is_phong = LANES(are_phong)(bsdf.material);
    const LANES(Vectors) half_vector = LANES(normalized_vectors)(LANES(sum_of_vectors)(wi, bsdf.wo));
    const Real cos_lobe = is_phong ? LANES(dot_products)(LANES(mirrored_directions)(bsdf), wi)
                                   : LANES(dot_products)(bsdf.normal, half_vector);
    const Real wo_half = LANES(dot_products)(bsdf.wo, half_vector);
    const Real p = bsdf.material.phong_exponent;
    const Mask is_drawn = (cos_lobe > 0.0f) & (is_phong | (wo_half > 0.0f));
    const Real lobe = LANES(power)(is_drawn ? cos_lobe : one, p);
    const Real stretch = LANES(divide)(one, (is_drawn & !is_phong) ? 4.0f * wo_half : one);
    return is_drawn ? CASTOR_INVERSE_TWO_PI * (p + 1.0f) * lobe * stretch : zero;
}

// Returns the densities with which sample_classic draws wi, by solid angle, mirrored and refracted directions apart.
CASTOR_ONCE Real LANES(classic_densities)(const LANES(ClassicBsdfs) bsdf, const LANES(Vectors) wi)
{
    const Real cos_wi = LANES(dot_products)(bsdf.normal, wi);
    Real density = bsdf.is_drawn_uniformly ? (Real)(CASTOR_INVERSE_TWO_PI) : 0.31830987f * cos_wi;
    const Mask has_highlight = (bsdf.highlight_share > 0.0f) & !bsdf.is_drawn_uniformly;
    if (LANES(mask_of)(has_highlight)) {
        const Real both =
            fma(bsdf.highlight_share, LANES(highlight_densities)(bsdf, wi), (1.0f - bsdf.highlight_share) * density);
        density = has_highlight ? both : density;
    }
    return cos_wi > 0.0f ? (1.0f - bsdf.mirror_share) * density : (Real)(0.0f);
}

// Directions in which paths go on.
typedef struct LANES(ClassicSamples) {
    LANES(Vectors) direction;  // unit
    LANES(Vectors) weight;     // value, cosine included, divided by the density; (0,0,0): the path ends
    Real density;              // as classic_densities; 0 for mirrored and refracted directions
    Mask is_refracted;
} LANES(ClassicSamples);

// Draws directions other than mirrored ones. `choice`: of [0, 1), which lobe; `at`: of the unit square.
CASTOR_INLINE LANES(Vectors)
    LANES(sample_matt)(const LANES(ClassicBsdfs) bsdf, const Real choice, const LANES(Points) at)
{
    const Real one = (Real)(1.0f);
    const Mask is_uniform = bsdf.is_drawn_uniformly;
    const Mask is_highlight = (choice < bsdf.highlight_share) & !is_uniform;
    Real cos_angle = is_uniform ? at.x : LANES(square_root)(1.0f - at.x);
    Real sin_squared = is_uniform ? fma(-at.x, at.x, one) : at.x;
    LANES(Vectors) axis = bsdf.normal;
    Mask is_phong = is_highlight;
    if (LANES(mask_of)(is_highlight)) {
        is_phong &= LANES(are_phong)(bsdf.material);
        axis = LANES(choose_vectors)(is_phong, LANES(mirrored_directions)(bsdf), axis);
        const Real cos_lobe = LANES(power)(at.x, LANES(divide)(one, bsdf.material.phong_exponent + 1.0f));
        cos_angle = is_highlight ? cos_lobe : cos_angle;
        sin_squared = is_highlight ? LANES(larger)(fma(-cos_lobe, cos_lobe, one), (Real)(0.0f)) : sin_squared;
    }
    const LANES(Vectors) drawn = LANES(directions_around)(axis, cos_angle, LANES(square_root)(sin_squared), at.y);
    const Mask is_half_vector = is_highlight & !is_phong;
    if (!LANES(mask_of)(is_half_vector)) return drawn;
    const LANES(Vectors) reflected =
        LANES(difference_of_vectors)(LANES(scaled_vectors)(drawn, 2.0f * LANES(dot_products)(drawn, bsdf.wo)), bsdf.wo);
    return LANES(choose_vectors)(is_half_vector, LANES(normalized_vectors)(reflected), drawn);
}

// Draws the mirrored or, of dielectrics by chance, the refracted directions.
CASTOR_INLINE LANES(ClassicSamples)
    LANES(sample_mirror)(const LANES(ClassicBsdfs) bsdf, const Real choice, const LANES(Points) at)
{
    const Real one = (Real)(1.0f);
    LANES(ClassicSamples) sample;
    sample.density = (Real)(0.0f);
    sample.is_refracted = (Whole)(0) != 0u;
    sample.direction = LANES(mirrored_directions)(bsdf);
    const Mask is_mirror = bsdf.mirror_share > 0.0f;
    sample.weight = LANES(scaled_vectors)(bsdf.mirror, LANES(divide)(one, is_mirror ? bsdf.mirror_share : one));
#if CASTOR_HAS_DIELECTRICS
    if (LANES(mask_of)(bsdf.is_dielectric)) {
        const LANES(Vectors) outward =
            LANES(choose_vectors)(bsdf.is_inside, LANES(scaled_vectors)(bsdf.normal, (Real)(-1.0f)), bsdf.normal);
        const LANES(Refractions) refraction = LANES(refract)(bsdf.material.refraction_index, outward, bsdf.wo,
                                                             bsdf.is_inside ? -bsdf.cos_wo : bsdf.cos_wo);
        sample.is_refracted = bsdf.is_dielectric & !(choice < refraction.reflectance);
        sample.direction = LANES(choose_vectors)(sample.is_refracted, refraction.direction, sample.direction);
        sample.weight = LANES(choose_vectors)(bsdf.is_dielectric, LANES(vectors)(one, one, one), sample.weight);
    }
#endif
#if CASTOR_HAS_ROUGHNESS
    if (LANES(mask_of)(bsdf.material.roughness > 0.0f))
        sample.direction = LANES(rough_directions)(sample.direction, bsdf.material.roughness, at);
#endif
    return sample;
}

// Draws directions. `choice`: of [0, 1), which lobe; `at`: of the unit square.
CASTOR_ONCE LANES(ClassicSamples)
    LANES(sample_classic)(const LANES(ClassicBsdfs) bsdf, const Real choice, const LANES(Points) at)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Mask is_mirror = choice < bsdf.mirror_share;
    LANES(ClassicSamples) sample;
    sample.density = zero;
    sample.direction = bsdf.normal;
    sample.weight = LANES(vectors)(zero, zero, zero);
    sample.is_refracted = (Whole)(0) != 0u;
    if (LANES(mask_of)(is_mirror)) {
        const LANES(ClassicSamples) mirror = LANES(sample_mirror)(bsdf, choice, at);
        sample.direction = LANES(choose_vectors)(is_mirror, mirror.direction, sample.direction);
        sample.weight = LANES(choose_vectors)(is_mirror, mirror.weight, sample.weight);
        sample.is_refracted = is_mirror & mirror.is_refracted;
    }
    const Mask is_matt = LANES(are_matt)(bsdf) & !is_mirror;
    if (LANES(mask_of)(is_matt)) {
        const Real rest = 1.0f - bsdf.mirror_share;
        const Real choice_left = LANES(divide)(choice - bsdf.mirror_share, rest > 0.0f ? rest : one);
        const LANES(Vectors) wi = LANES(sample_matt)(bsdf, choice_left, at);
        const Real density = LANES(classic_densities)(bsdf, wi);
        const Mask is_drawn = is_matt & (density > 0.0f) & (density <= FLT_MAX);
        const LANES(Vectors) weight =
            LANES(scaled_vectors)(LANES(classic_values)(bsdf, wi), LANES(divide)(one, is_drawn ? density : one));
        sample.direction = LANES(choose_vectors)(is_drawn, wi, sample.direction);
        sample.weight = LANES(choose_vectors)(is_drawn, weight, sample.weight);
        sample.density = is_drawn ? density : zero;
    }
    return sample;
}
