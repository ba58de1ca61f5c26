// How physically based surfaces scatter light, for CASTOR_LANES lanes (see lanes.cl): the material model of glTF 2.0
// (appendix B) and of its extensions, of the parameters in PrincipledMaterial (principled_material.h).
//
// Frame and directions: z is the normal on the side of wo, x the direction of anisotropy; wo is where the path came
// from and wi where it goes on, both unit and away from the surface. wi.z < 0: the light passes the surface.
//
// From the outside to the inside the surface has
//   clearcoat   GGX with f0 = 0.04; what is below gets 1 less its albedo along wo
//   sheen       Charlie; what is below gets 1 less the larger of its albedos along wo and wi
//   base        a mixture by `metallic` and `transmission` of
//     metal       GGX with Schlick's Fresnel term from f0 = base_color, or with that of n + ik
//     dielectric  GGX with Schlick's Fresnel term from the refraction index; below it a diffuse lobe, Lambert's or EON,
//                 which gets (1 - albedo along wo) (1 - albedo along wi) / (1 - average albedo): together they keep all
//                 energy. A share of it may pass to the other side.
//     glass       GGX that reflects and refracts by Fresnel's equations; or a thin wall, with the light that is
//                 reflected to and fro in it
// Metal, dielectric and thin walls are scaled so that rough surfaces keep all energy (Turquin 2019). That depends on wo
// alone, as the factor below the clearcoat does: with them the model is not reciprocal; energy is kept. The tables of
// albedos are those of isotropic surfaces: the scale fades with the strength of anisotropy.
//
// What is carried is basic radiance, L / n^2: no factor is due where light enters or leaves a dielectric, and a
// path's throughput stays at most 1. Seen from where the index is 1, that makes no difference.
//
// A lobe narrower than CASTOR_LEAST_ALPHA is a delta: it is only sampled, and evaluate_bsdf leaves it out. No input
// within its ranges gives NaN or infinity; where wo or wi grazes by less than CASTOR_LEAST_COSINE, nothing
// is scattered.
#include "castor/shared/principled_material.h"
#include "device/albedo.lanes.cl"
#include "device/diffuse.lanes.cl"
#include "device/microfacets.lanes.cl"
#include "device/sheen.lanes.cl"

#define CASTOR_LEAST_COSINE 1e-6f
#define CASTOR_CLEARCOAT_F0 0.04f

// The materials of surfaces: see PrincipledMaterial.
typedef struct LANES(PrincipledMaterials) {
    LANES(Vectors) base_color, specular_color, sheen_color, diffuse_transmission_color;
    Real metallic, specular, sheen_roughness, diffuse_transmission;
    Real roughness, anisotropy, diffuse_roughness, transmission;
    Real refraction_index, absorption_index, clearcoat, clearcoat_roughness;
    Real anisotropy_cosine, anisotropy_sine;  // where x of the frame is
    Mask is_thin;
    Whole flags;
} LANES(PrincipledMaterials);

#define CASTOR_PRINCIPLED_MATERIAL_ROWS 14u  // principled_material.h asserts the size

CASTOR_INLINE LANES(PrincipledMaterials)
    LANES(gather_principled_materials)(const global PrincipledMaterial *restrict materials, const Whole number)
{
    const global float4 *const rows = (const global float4 *)materials;
    const Whole first = number * CASTOR_PRINCIPLED_MATERIAL_ROWS;
    const LANES(Rows) base = LANES(gather_rows)(rows, first), specular = LANES(gather_rows)(rows, first + 1u),
                      sheen = LANES(gather_rows)(rows, first + 2u), passed = LANES(gather_rows)(rows, first + 3u),
                      rough = LANES(gather_rows)(rows, first + 4u), coat = LANES(gather_rows)(rows, first + 5u);
    LANES(PrincipledMaterials) material;
    material.base_color = LANES(vectors_of_rows)(base);
    material.metallic = base.w;
    material.specular_color = LANES(vectors_of_rows)(specular);
    material.specular = specular.w;
    material.sheen_color = LANES(vectors_of_rows)(sheen);
    material.sheen_roughness = sheen.w;
    material.diffuse_transmission_color = LANES(vectors_of_rows)(passed);
    material.diffuse_transmission = passed.w;
    material.roughness = rough.x;
    material.anisotropy = rough.y;
    material.diffuse_roughness = rough.z;
    material.transmission = rough.w;
    material.refraction_index = coat.x;
    material.absorption_index = coat.y;
    material.clearcoat = coat.z;
    material.clearcoat_roughness = coat.w;
    const LANES(Rows) flags = LANES(gather_rows)(rows, first + 6u), turn = LANES(gather_rows)(rows, first + 7u);
    material.flags = LANES(as_uint)(flags.x);
    material.is_thin = (material.flags & CASTOR_PRINCIPLED_THIN) != (Whole)(0);
    material.anisotropy_cosine = turn.x;
    material.anisotropy_sine = turn.y;
    return material;
}

// What is known of scattering at surfaces when wo is: see prepare_bsdf. Gains are what lobes are multiplied by; a
// probability is that of drawing a lobe.
typedef struct LANES(Bsdfs) {
    LANES(Microfacets) base, coat;
    Mask is_smooth, is_smooth_glass, is_smooth_coat;  // deltas
    Mask is_thin;
    Real eta;  // of what is behind the surface, against what wo is in
    Real roughness;
    LANES(Vectors) metal_f0, metal_gain;
    Real metal_n, metal_k;
    LANES(Vectors) dielectric_f0;
    Real dielectric_f90, largest_f0;
    LANES(Vectors) dielectric_gain;
    LANES(Vectors) glass_color;  // of what is reflected
    Real glass_gain;
    LANES(Vectors) glass_transmitted;  // gain of what is refracted
    LANES(Vectors) diffuse_color;
    Real diffuse_gain, diffuse_roughness;
    LANES(Vectors) passed_gain;
    LANES(Vectors) sheen_gain;
    Real sheen_roughness, sheen_albedo, sheen_largest;
    Real coat_gain;
    Real base_probability, glass_probability, diffuse_probability, passed_probability, coat_probability,
        sheen_probability;
} LANES(Bsdfs);

typedef struct LANES(BsdfValues) {
    LANES(Vectors) value;  // the BSDF, without the cosine of wi
    Real pdf;              // with which sample_bsdf draws wi, over solid angle
} LANES(BsdfValues);

typedef struct LANES(BsdfSamples) {
    LANES(Vectors) wi;      // unit
    LANES(Vectors) weight;  // value * |cos| / pdf; 0 where nothing is drawn
    Real pdf;       // as evaluate_bsdf gives it; 0: nothing is drawn. Of a delta, the probability of drawing it.
    Mask is_delta;  // no other technique finds this direction: its weight in multiple importance sampling is 1
} LANES(BsdfSamples);

CASTOR_INLINE Real LANES(largest_component)(const LANES(Vectors) v)
{
    return LANES(larger)(v.x, LANES(larger)(v.y, v.z));
}

CASTOR_INLINE Real LANES(mean_component)(const LANES(Vectors) v) { return (v.x + v.y + v.z) * (1.0f / 3.0f); }

CASTOR_INLINE LANES(Vectors) LANES(components_up_to_one)(const LANES(Vectors) v)
{
    const Real one = (Real)(1.0f);
    return LANES(vectors)(LANES(smaller)(v.x, one), LANES(smaller)(v.y, one), LANES(smaller)(v.z, one));
}

// Returns f0 + (f90 - f0) * weight.
CASTOR_INLINE LANES(Vectors) LANES(schlick_terms)(const LANES(Vectors) f0, const Real f90, const Real weight)
{
    return LANES(vectors)(fma(f90 - f0.x, weight, f0.x), fma(f90 - f0.y, weight, f0.y), fma(f90 - f0.z, weight, f0.z));
}

CASTOR_INLINE LANES(Vectors) LANES(metal_terms)(const LANES(Bsdfs) bsdf, const Real cos_half, const Real weight)
{
    LANES(Vectors) terms = LANES(schlick_terms)(bsdf.metal_f0, (Real)(1.0f), weight);
    const Mask is_exact = bsdf.metal_k > 0.0f;
    if (LANES(mask_of)(is_exact))
        terms = LANES(choose_vectors)(
            is_exact,
            LANES(scaled_vectors)(bsdf.metal_f0, LANES(conductor_reflectance)(bsdf.metal_n, bsdf.metal_k, cos_half)),
            terms);
    return terms;
}

// Returns what metal and dielectric reflect, gains included; to be multiplied by D G2 / (4 cos cos).
CASTOR_INLINE LANES(Vectors) LANES(base_terms)(const LANES(Bsdfs) bsdf, const Real cos_half)
{
    const Real weight = LANES(schlick_weight)(cos_half);
    return LANES(sum_of_vectors)(
        LANES(product_of_vectors)(bsdf.metal_gain, LANES(metal_terms)(bsdf, cos_half, weight)),
        LANES(product_of_vectors)(bsdf.dielectric_gain,
                                  LANES(schlick_terms)(bsdf.dielectric_f0, bsdf.dielectric_f90, weight)));
}

// What glass does with light that meets facets.
typedef struct LANES(GlassTerms) {
    LANES(Vectors) reflected;  // shares
    Real choice;               // probability of reflection, their largest; the rest is transmitted
    Real ratio, cos_there;     // see Interfaces
} LANES(GlassTerms);

CASTOR_INLINE LANES(GlassTerms) LANES(glass_terms)(const LANES(Bsdfs) bsdf, const Real cos_half)
{
    const Real one = (Real)(1.0f);
    const LANES(Interfaces) interface = LANES(meet_interface)(one, bsdf.eta, cos_half);
    const Real once = interface.reflectance;
    const Real share = bsdf.is_thin ? LANES(divide)(2.0f * once, 1.0f + once) : once;
    const Mask is_total = !(share < 1.0f);
    LANES(GlassTerms) terms;
    terms.reflected =
        LANES(choose_vectors)(is_total, LANES(vectors)(one, one, one), LANES(scaled_vectors)(bsdf.glass_color, share));
    terms.choice = LANES(largest_component)(terms.reflected);
    terms.ratio = interface.ratio;
    terms.cos_there = interface.cos_there;
    return terms;
}

// Returns what is known when wo is. `is_inside`: wo is inside of the solid that the surface bounds; it matters where
// this transmits light and is not thin.
CASTOR_ONCE LANES(Bsdfs)
    LANES(prepare_bsdf)(const LANES(PrincipledMaterials) material, const LANES(Vectors) wo, const Mask is_inside)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    LANES(Bsdfs) bsdf;
    const Mask is_within = is_inside & (material.transmission > 0.0f) & !material.is_thin;
    bsdf.is_thin = material.is_thin;

    // Facets: alpha along x is larger by the anisotropy (KHR_materials_anisotropy).
    const Real roughness = clamp(material.roughness, zero, one), alpha = roughness * roughness;
    const Real stretch = material.anisotropy * material.anisotropy;
    const Real alpha_x = fma(1.0f - alpha, stretch, alpha);
    bsdf.base = LANES(see_microfacets)(alpha_x, alpha, wo);
    bsdf.is_smooth = alpha_x < CASTOR_LEAST_ALPHA;
    bsdf.roughness = bsdf.is_smooth ? zero : roughness;
    const LANES(MicrofacetAlbedos) albedo = LANES(microfacet_albedo)(wo.z, bsdf.roughness);
    Real lost = LANES(lost_energy)(albedo);
    const Mask is_stretched = stretch > 0.0f;
    if (LANES(mask_of)(is_stretched)) {
        const Real along = LANES(lost_energy)(LANES(microfacet_albedo)(wo.z, LANES(square_root)(bsdf.base.alpha_x)));
        lost = is_stretched ? LANES(smaller)(lost, along) * (1.0f - clamp(material.anisotropy, zero, one)) : lost;
    }

    // What the clearcoat lets pass.
    const Real clearcoat = is_within ? zero : material.clearcoat;
    const Real coat_roughness = clamp(material.clearcoat_roughness, zero, one);
    const Real coat_alpha = coat_roughness * coat_roughness;
    bsdf.coat = LANES(see_microfacets)(coat_alpha, coat_alpha, wo);
    bsdf.is_smooth_coat = coat_alpha < CASTOR_LEAST_ALPHA;
    bsdf.coat_gain = clearcoat;
    Real coat_albedo = zero;
    if (LANES(mask_of)(clearcoat > 0.0f)) {
        const LANES(MicrofacetAlbedos) of_coat =
            LANES(microfacet_albedo)(wo.z, bsdf.is_smooth_coat ? zero : coat_roughness);
        coat_albedo = clearcoat * LANES(fresnel_albedo)(of_coat, (Real)(CASTOR_CLEARCOAT_F0), one, zero);
    }
    const Real below_coat = 1.0f - coat_albedo;

    // Sheen.
    bsdf.sheen_roughness = LANES(larger)(material.sheen_roughness, (Real)(CASTOR_LEAST_SHEEN_ROUGHNESS));
    const LANES(Vectors) no_color = LANES(vectors)(zero, zero, zero);
    bsdf.sheen_gain =
        LANES(choose_vectors)(is_within, no_color, LANES(scaled_vectors)(material.sheen_color, below_coat));
    bsdf.sheen_largest = is_within ? zero : LANES(largest_component)(material.sheen_color);
    bsdf.sheen_albedo = zero;
    if (LANES(mask_of)(bsdf.sheen_largest > 0.0f)) bsdf.sheen_albedo = LANES(sheen_albedo)(wo.z, bsdf.sheen_roughness);
    const Real sheen_reflected = bsdf.sheen_largest * LANES(smaller)(bsdf.sheen_albedo, one);

    // Metal.
    const Real metallic = clamp(material.metallic, zero, one);
    const Real metal_share = metallic * below_coat, other_share = (1.0f - metallic) * below_coat;
    bsdf.metal_f0 = material.base_color;
    bsdf.metal_n = material.refraction_index;
    bsdf.metal_k = material.absorption_index;
    LANES(Vectors) f0 = material.base_color;
    const Mask is_conductor = bsdf.metal_k > 0.0f;
    if (LANES(mask_of)(is_conductor))
        f0 = LANES(choose_vectors)(
            is_conductor, LANES(scaled_vectors)(f0, LANES(conductor_reflectance)(bsdf.metal_n, bsdf.metal_k, one)), f0);
    bsdf.metal_gain =
        LANES(vectors)(metal_share * LANES(energy_scale)(f0.x, lost), metal_share * LANES(energy_scale)(f0.y, lost),
                       metal_share * LANES(energy_scale)(f0.z, lost));

    // Dielectrics.
    const Real transmission = clamp(material.transmission, zero, one);
    const Real index = clamp(is_conductor ? (Real)(1.5f) : material.refraction_index, (Real)(1e-3f), (Real)(1e3f));
    const Real ratio = LANES(divide)(index - 1.0f, index + 1.0f);
    bsdf.dielectric_f90 = clamp(material.specular, zero, one);
    bsdf.dielectric_f0 = LANES(scaled_vectors)(
        LANES(components_up_to_one)(LANES(scaled_vectors)(material.specular_color, ratio * ratio)),
        bsdf.dielectric_f90);
    bsdf.largest_f0 = LANES(largest_component)(bsdf.dielectric_f0);
    const Real opaque = other_share * (1.0f - transmission);
    bsdf.dielectric_gain = LANES(vectors)(opaque * LANES(energy_scale)(bsdf.dielectric_f0.x, lost),
                                          opaque * LANES(energy_scale)(bsdf.dielectric_f0.y, lost),
                                          opaque * LANES(energy_scale)(bsdf.dielectric_f0.z, lost));
    const Real facet_albedo = LANES(fresnel_albedo)(albedo, bsdf.largest_f0, bsdf.dielectric_f90, lost);

    // What is diffuse below them.
    const Real mean_rest = 1.0f - LANES(mean_fresnel_albedo)(bsdf.roughness, bsdf.largest_f0, bsdf.dielectric_f90);
    const Mask has_rest = mean_rest > 1e-4f;
    const Real diffuse = has_rest ? opaque * LANES(divide)(1.0f - facet_albedo, has_rest ? mean_rest : one) : zero;
    const Real passed = clamp(material.diffuse_transmission, zero, one);
    bsdf.diffuse_color = LANES(components_up_to_one)(material.base_color);
    bsdf.diffuse_gain = diffuse * (1.0f - passed);
    bsdf.diffuse_roughness = clamp(material.diffuse_roughness, zero, one);
    bsdf.passed_gain = LANES(scaled_vectors)(material.diffuse_transmission_color, diffuse * passed * CASTOR_INVERSE_PI);

    // Glass.
    const Real glass = other_share * transmission;
    bsdf.eta = is_within ? LANES(divide)(one, index) : index;
    bsdf.glass_color = LANES(scaled_vectors)(LANES(components_up_to_one)(material.specular_color), bsdf.dielectric_f90);
    bsdf.glass_gain = bsdf.is_thin ? glass * (1.0f + lost) : glass;
    bsdf.glass_transmitted = LANES(scaled_vectors)(material.base_color, bsdf.glass_gain);
    bsdf.is_smooth_glass = bsdf.is_smooth | (!bsdf.is_thin & (fabs(bsdf.eta - 1.0f) * bsdf.base.alpha_y < 1e-5f));

    // Lobes are drawn in proportion to about what they scatter of uniform light.
    const Real below_sheen = 1.0f - sheen_reflected;
    const LANES(Vectors) metal_albedo =
        LANES(vectors)(LANES(fresnel_albedo)(albedo, f0.x, one, lost), LANES(fresnel_albedo)(albedo, f0.y, one, lost),
                       LANES(fresnel_albedo)(albedo, f0.z, one, lost));
    const Real of_base = below_sheen * fma(metal_share, LANES(mean_component)(metal_albedo), opaque * facet_albedo);
    const Real reflected = LANES(glass_terms)(bsdf, wo.z).choice;
    const Real of_glass =
        below_sheen * glass * fma(1.0f - reflected, LANES(mean_component)(material.base_color), reflected);
    const Real of_diffuse = below_sheen * opaque * (1.0f - facet_albedo);
    const Real of_reflected = of_diffuse * (1.0f - passed) * LANES(mean_component)(bsdf.diffuse_color);
    const Real of_passed = of_diffuse * passed * LANES(mean_component)(material.diffuse_transmission_color);
    const Real of_sheen = LANES(mean_component)(bsdf.sheen_gain) * LANES(smaller)(bsdf.sheen_albedo, one);
    const Real sum = of_base + of_glass + of_reflected + of_passed + coat_albedo + of_sheen;
    const Mask is_seen = (wo.z >= CASTOR_LEAST_COSINE) & (sum > 1e-20f) & (sum <= FLT_MAX);
    const Real inverse = is_seen ? LANES(divide)(one, is_seen ? sum : one) : zero;
    bsdf.base_probability = of_base * inverse;
    bsdf.glass_probability = of_glass * inverse;
    bsdf.diffuse_probability = of_reflected * inverse;
    bsdf.passed_probability = of_passed * inverse;
    bsdf.coat_probability = coat_albedo * inverse;
    bsdf.sheen_probability = of_sheen * inverse;
    return bsdf;
}

// Returns the share of light that passes the sheen, along wo and wi.
CASTOR_INLINE Real LANES(below_sheen)(const LANES(Bsdfs) bsdf, const Real albedo_wi)
{
    const Real largest = LANES(smaller)(LANES(larger)(bsdf.sheen_albedo, albedo_wi), (Real)(1.0f));
    return fma(-bsdf.sheen_largest, largest, (Real)(1.0f));
}

// Evaluates what is refracted, or passes a thin wall, and is not a delta.
CASTOR_INLINE LANES(BsdfValues)
    LANES(evaluate_transmission)(const LANES(Bsdfs) bsdf, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real eta = bsdf.is_thin ? one : bsdf.eta;
    const LANES(Vectors) beyond = LANES(vectors)(wi.x, wi.y, bsdf.is_thin ? -wi.z : wi.z);
    const LANES(Vectors) sum = LANES(points_on_rays)(wo, eta, beyond);
    const LANES(Vectors) h = LANES(normalized_vectors)(LANES(scaled_vectors)(sum, sum.z < 0.0f ? (Real)(-1.0f) : one));
    const Real cos_wo = LANES(dot_products)(wo, h), cos_wi = LANES(dot_products)(beyond, h);
    const Mask is_thick = !bsdf.is_thin;
    const Mask is_possible = (cos_wo > 0.0f) & ((bsdf.is_thin & (cos_wi > 0.0f)) | (is_thick & (cos_wi < 0.0f)));
    const Real density = LANES(density_of_normals)(bsdf.base, h);
    const Real transmitted = 1.0f - LANES(glass_terms)(bsdf, cos_wo).choice;
    // Of directions for each direction of h, times |wo.h|; of a mirror 1/4.
    const Real width = fma(eta, cos_wi, cos_wo);
    const Mask has_width = width * width > 1e-20f;
    const Real jacobian = LANES(divide)(eta * eta * cos_wo * fabs(cos_wi), has_width ? width * width : one);
    const Real factor = bsdf.is_thin ? (Real)(0.25f) : jacobian;
    const Mask is_scattered = is_possible & has_width & (transmitted > 0.0f);
    const Real both = is_scattered ? transmitted * density * factor : zero;
    LANES(BsdfValues) result;
    result.value = LANES(scaled_vectors)(bsdf.glass_transmitted, 4.0f * both * LANES(visibility)(bsdf.base, wo.z, wi));
    result.pdf = bsdf.glass_probability * 4.0f * LANES(reflection_pdf)(bsdf.base, one, wo.z, both);
    return result;
}

// Evaluates what is reflected and is not a delta.
CASTOR_INLINE LANES(BsdfValues)
    LANES(evaluate_reflection)(const LANES(Bsdfs) bsdf, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Vectors) h = LANES(normalized_vectors)(LANES(sum_of_vectors)(wo, wi));
    const Real cos_half = LANES(dot_products)(wo, h);
    LANES(BsdfValues) result;
    result.value = LANES(vectors)(zero, zero, zero);
    result.pdf = zero;

    // Metal, dielectric and glass.
    const Mask is_glass = bsdf.glass_probability > 0.0f;
    if (LANES(mask_of)((!bsdf.is_smooth) & ((bsdf.base_probability > 0.0f) | is_glass))) {
        const Real density = LANES(density_of_normals)(bsdf.base, h);
        const Real base = bsdf.is_smooth ? zero : density;
        LANES(Vectors) reflected = LANES(scaled_vectors)(LANES(base_terms)(bsdf, cos_half), base);
        result.pdf = bsdf.base_probability * LANES(reflection_pdf)(bsdf.base, bsdf.base.bound, wo.z, base);
        if (LANES(mask_of)(is_glass)) {
            const LANES(GlassTerms) terms = LANES(glass_terms)(bsdf, cos_half);
            const Real glass = (is_glass & !bsdf.is_smooth_glass) ? density : zero;
            reflected = LANES(points_on_rays)(reflected, bsdf.glass_gain * glass, terms.reflected);
            result.pdf = fma(bsdf.glass_probability * terms.choice, LANES(reflection_pdf)(bsdf.base, one, wo.z, glass),
                             result.pdf);
        }
        result.value = LANES(scaled_vectors)(reflected, LANES(visibility)(bsdf.base, wo.z, wi));
    }

    // What is diffuse.
    if (LANES(mask_of)(bsdf.diffuse_gain > 0.0f)) {
        const LANES(MicrofacetAlbedos) albedo = LANES(microfacet_albedo)(wi.z, bsdf.roughness);
        const Real rest =
            1.0f - LANES(fresnel_albedo)(albedo, bsdf.largest_f0, bsdf.dielectric_f90, LANES(lost_energy)(albedo));
        const Mask is_rough = bsdf.diffuse_roughness > 0.0f;
        LANES(Vectors) diffuse = LANES(scaled_vectors)(bsdf.diffuse_color, (Real)(CASTOR_INVERSE_PI));
        Real pdf = CASTOR_INVERSE_PI * wi.z;
        if (LANES(mask_of)(is_rough)) {
            diffuse = LANES(choose_vectors)(
                is_rough, LANES(eon_value)(bsdf.diffuse_color, bsdf.diffuse_roughness, wo, wi), diffuse);
            pdf = is_rough ? LANES(eon_pdf)(bsdf.diffuse_roughness, wo, wi) : pdf;
        }
        result.value = LANES(points_on_rays)(result.value, bsdf.diffuse_gain * rest, diffuse);
        result.pdf = fma(bsdf.diffuse_probability, pdf, result.pdf);
    }

    // Sheen.
    if (LANES(mask_of)(bsdf.sheen_largest > 0.0f)) {
        const Mask has_sheen = bsdf.sheen_largest > 0.0f;
        const Real albedo_wi = LANES(sheen_albedo)(wi.z, bsdf.sheen_roughness);
        const Real sheen = LANES(sheen_value)(bsdf.sheen_roughness, wo, wi, bsdf.sheen_albedo, albedo_wi);
        const LANES(Vectors) layered = LANES(points_on_rays)(
            LANES(scaled_vectors)(result.value, LANES(below_sheen)(bsdf, albedo_wi)), sheen, bsdf.sheen_gain);
        result.value = LANES(choose_vectors)(has_sheen, layered, result.value);
        result.pdf = has_sheen ? fma(bsdf.sheen_probability, CASTOR_INVERSE_PI * wi.z, result.pdf) : result.pdf;
    }

    // Clearcoat.
    const Mask has_coat = (bsdf.coat_gain > 0.0f) & !bsdf.is_smooth_coat;
    if (LANES(mask_of)(has_coat)) {
        const Real coat = has_coat ? LANES(density_of_normals)(bsdf.coat, h) : zero;
        const Real term =
            fma((Real)(1.0f - CASTOR_CLEARCOAT_F0), LANES(schlick_weight)(cos_half), (Real)(CASTOR_CLEARCOAT_F0));
        const Real value = bsdf.coat_gain * term * coat * LANES(visibility)(bsdf.coat, wo.z, wi);
        result.value = LANES(sum_of_vectors)(result.value, LANES(vectors)(value, value, value));
        result.pdf =
            fma(bsdf.coat_probability, LANES(reflection_pdf)(bsdf.coat, bsdf.coat.bound, wo.z, coat), result.pdf);
    }
    return result;
}

// Returns the BSDF and the density with which sample_bsdf draws wi, without deltas.
CASTOR_ONCE LANES(BsdfValues)
    LANES(evaluate_bsdf)(const LANES(Bsdfs) bsdf, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f);
    const Mask is_reflected = (wo.z >= CASTOR_LEAST_COSINE) & (wi.z >= CASTOR_LEAST_COSINE);
    const Mask is_through = (wo.z >= CASTOR_LEAST_COSINE) & (wi.z <= -CASTOR_LEAST_COSINE);
    LANES(BsdfValues) result;
    result.value = LANES(vectors)(zero, zero, zero);
    result.pdf = zero;
    if (LANES(mask_of)(is_reflected)) {
        const LANES(BsdfValues) reflected = LANES(evaluate_reflection)(bsdf, wo, wi);
        result.value = LANES(choose_vectors)(is_reflected, reflected.value, result.value);
        result.pdf = is_reflected ? reflected.pdf : result.pdf;
    }
    const Mask is_glass = is_through & (bsdf.glass_probability > 0.0f) & !bsdf.is_smooth_glass;
    if (LANES(mask_of)(is_glass)) {
        const LANES(BsdfValues) transmitted = LANES(evaluate_transmission)(bsdf, wo, wi);
        result.value = LANES(choose_vectors)(is_glass, transmitted.value, result.value);
        result.pdf = is_glass ? transmitted.pdf : result.pdf;
    }
    const Mask is_passed = is_through & (bsdf.passed_probability > 0.0f);
    if (LANES(mask_of)(is_passed)) {
        const LANES(MicrofacetAlbedos) albedo = LANES(microfacet_albedo)(-wi.z, bsdf.roughness);
        const Real rest =
            1.0f - LANES(fresnel_albedo)(albedo, bsdf.largest_f0, bsdf.dielectric_f90, LANES(lost_energy)(albedo));
        const LANES(Vectors) sum = LANES(points_on_rays)(result.value, rest, bsdf.passed_gain);
        result.value = LANES(choose_vectors)(is_passed, sum, result.value);
        result.pdf = is_passed ? fma(bsdf.passed_probability, CASTOR_INVERSE_PI * -wi.z, result.pdf) : result.pdf;
    }
    const Real passed = is_through ? LANES(below_sheen)(bsdf, zero) : (Real)(1.0f);
    result.value = LANES(scaled_vectors)(result.value, passed);
    return result;
}

// Draws directions. `choice`: chooses the lobe, in [0, 1), and independent of `point`.
CASTOR_ONCE LANES(BsdfSamples)
    LANES(sample_bsdf)(const LANES(Bsdfs) bsdf, const LANES(Vectors) wo, const Real choice, const LANES(Points) point)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    // Base, glass, diffuse, passed, coat, sheen, side by side.
    const Real end_base = bsdf.base_probability, end_glass = end_base + bsdf.glass_probability;
    const Real end_diffuse = end_glass + bsdf.diffuse_probability, end_passed = end_diffuse + bsdf.passed_probability;
    const Real end_coat = end_passed + bsdf.coat_probability;
    const Mask in_base = choice < end_base, in_glass = !in_base & (choice < end_glass);
    const Mask in_diffuse = (choice >= end_glass) & (choice < end_diffuse);
    const Mask in_passed = (choice >= end_diffuse) & (choice >= end_glass) & (choice < end_passed);
    const Mask in_coat = (choice >= end_passed) & (choice >= end_glass) & (choice < end_coat);
    const Mask in_facets = in_base | in_glass | in_coat;
    const Real begin = in_glass ? end_base : end_glass;
    const Real share = in_glass ? bsdf.glass_probability : bsdf.diffuse_probability;
    const Mask is_chosen = (in_glass | in_diffuse) & (share > 0.0f);
    // What is left of the choice within the lobe.
    const Real rest = clamp(LANES(divide)(choice - begin, is_chosen ? share : one), zero, (Real)(0x1.fffffep-1f));

    LANES(BsdfSamples) sample;
    sample.is_delta = (in_base & bsdf.is_smooth) | (in_glass & bsdf.is_smooth_glass) | (in_coat & bsdf.is_smooth_coat);
    const LANES(Vectors) up = LANES(vectors)(zero, zero, one);
    sample.wi = up;
    LANES(GlassTerms) glass = LANES(glass_terms)(bsdf, wo.z);
    Mask is_through = in_passed;
    if (LANES(mask_of)(in_facets)) {
        LANES(Microfacets) facets;
        facets.alpha_x = in_coat ? bsdf.coat.alpha_x : bsdf.base.alpha_x;
        facets.alpha_y = in_coat ? bsdf.coat.alpha_y : bsdf.base.alpha_y;
        facets.stretched = in_coat ? bsdf.coat.stretched : bsdf.base.stretched;
        const Real bound = in_glass ? one : (in_coat ? bsdf.coat.bound : bsdf.base.bound);
        const LANES(Vectors) h =
            LANES(choose_vectors)(sample.is_delta, up, LANES(sample_normals)(facets, bound, wo, point));
        const Real cos_half = LANES(dot_products)(wo, h);
        const LANES(Vectors) mirrored = LANES(difference_of_vectors)(LANES(scaled_vectors)(h, 2.0f * cos_half), wo);
        sample.wi = LANES(choose_vectors)(in_facets, mirrored, sample.wi);
        if (LANES(mask_of)(in_glass)) {
            glass = LANES(glass_terms)(bsdf, cos_half);
            const Mask is_refracted = in_glass & (rest >= glass.choice);
            const LANES(Vectors) bent = LANES(normalized_vectors)(
                LANES(difference_of_vectors)(LANES(scaled_vectors)(h, fma(glass.ratio, cos_half, -glass.cos_there)),
                                             LANES(scaled_vectors)(wo, glass.ratio)));
            const LANES(Vectors) through = LANES(vectors)(mirrored.x, mirrored.y, -mirrored.z);
            const LANES(Vectors) passed = LANES(choose_vectors)(bsdf.is_thin, through, bent);
            sample.wi = LANES(choose_vectors)(is_refracted, passed, sample.wi);
            is_through = is_through | is_refracted;
        }
    }
    if (LANES(mask_of)(!in_facets)) {
        const LANES(Vectors) around = LANES(sample_cosine)(point);
        sample.wi = LANES(choose_vectors)(in_facets, sample.wi,
                                          LANES(vectors)(around.x, around.y, in_passed ? -around.z : around.z));
        const Mask is_rough = in_diffuse & (bsdf.diffuse_roughness > 0.0f);
        if (LANES(mask_of)(is_rough))
            sample.wi =
                LANES(choose_vectors)(is_rough, LANES(sample_eon)(bsdf.diffuse_roughness, wo, rest, point), sample.wi);
    }

    const Mask is_there = (wo.z >= CASTOR_LEAST_COSINE) &
                          (is_through ? sample.wi.z <= -CASTOR_LEAST_COSINE : sample.wi.z >= CASTOR_LEAST_COSINE);
    const LANES(BsdfValues) found = LANES(evaluate_bsdf)(bsdf, wo, sample.wi);
    const Mask is_found = is_there & (found.pdf > 0.0f) & (found.pdf <= FLT_MAX);
    sample.pdf = is_found ? found.pdf : zero;
    const Real factor = is_found ? LANES(divide)(fabs(sample.wi.z), is_found ? found.pdf : one) : zero;
    sample.weight = LANES(scaled_vectors)(found.value, factor);

    if (LANES(mask_of)(sample.is_delta)) {
        // The lobe's share of the light that goes this way, divided by the probability.
        const Real coat_term = bsdf.coat_gain * fma((Real)(1.0f - CASTOR_CLEARCOAT_F0), LANES(schlick_weight)(wo.z),
                                                    (Real)(CASTOR_CLEARCOAT_F0));
        const Mask is_refracted = in_glass & is_through;
        const Real reflected_glass = glass.choice > 0.0f ? bsdf.glass_gain : zero;
        const LANES(Vectors) of_glass =
            LANES(choose_vectors)(is_refracted, LANES(scaled_vectors)(bsdf.glass_transmitted, 1.0f - glass.choice),
                                  LANES(scaled_vectors)(glass.reflected, reflected_glass));
        const LANES(Vectors) of_base = LANES(base_terms)(bsdf, wo.z);
        const LANES(Vectors) of_coat = LANES(vectors)(coat_term, coat_term, coat_term);
        const LANES(Vectors) scattered =
            LANES(choose_vectors)(in_glass, of_glass, LANES(choose_vectors)(in_coat, of_coat, of_base));
        const Real passed = in_coat ? one : LANES(below_sheen)(bsdf, is_refracted ? zero : bsdf.sheen_albedo);
        const Real probability = in_glass ? bsdf.glass_probability * (is_refracted ? 1.0f - glass.choice : glass.choice)
                                          : (in_coat ? bsdf.coat_probability : bsdf.base_probability);
        const Mask is_drawn = sample.is_delta & is_there & (probability > 0.0f);
        const Real delta_factor = is_drawn ? LANES(divide)(passed, is_drawn ? probability : one) : zero;
        sample.weight =
            LANES(choose_vectors)(sample.is_delta, LANES(scaled_vectors)(scattered, delta_factor), sample.weight);
        sample.pdf = sample.is_delta ? (is_drawn ? probability : zero) : sample.pdf;
    }
    return sample;
}
