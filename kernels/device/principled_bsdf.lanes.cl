// How physically based surfaces scatter light, for CASTOR_LANES lanes (see lanes.cl): the material model of glTF 2.0
// (appendix B) and of its extensions, of the parameters in PrincipledMaterial (principled_material.h).
//
// Frame and directions: z is the normal on the side of wo, x the direction of anisotropy; wo is where the path came
// from and wi where it goes on, both unit and away from the surface. wi.z < 0: the light passes the surface.
//
// From the outside to the inside the surface has
//   clearcoat   GGX with f0 = 0.04, perhaps with a normal of its own; what is below gets 1 less its albedo along wo
//   sheen       Charlie; what is below gets 1 less the larger of its albedos along wo and wi
//   base        a mixture by `metallic` and `transmission` of
//     metal       GGX with Schlick's Fresnel term from f0 = base_color, or with that of n + ik
//     dielectric  GGX with Schlick's Fresnel term from the refraction index; below it a diffuse lobe, Lambert's or EON,
//                 which gets (1 - albedo along wo) (1 - albedo along wi) / (1 - average albedo): together they keep all
//                 energy. A share of it may pass to the other side.
//     glass       GGX that reflects and refracts by Fresnel's equations; or a thin wall, with the light that is
//                 reflected to and fro in it
// Where the base has a thin film, what the film reflects (thin_film.lanes.cl) stands for all these Fresnel terms. The
// diffuse lobe then gets no more than what is left along wo and wi by the largest channel.
// Metal, dielectric and glass are scaled so that rough surfaces keep all energy (Turquin 2019). That depends on wo
// alone, as the factor below the clearcoat does: with them the model is not reciprocal; energy is kept. Glass with
// anisotropy or a specular colour depends on too much for a table: what it scatters is integrated where it is met.
//
// What is carried is basic radiance, L / n^2: no factor is due where light enters or leaves a dielectric, and a
// path's throughput stays at most 1. Seen from where the index is 1, that makes no difference.
//
// Glass with dispersion has an index of refraction for each of red, green and blue. What is refracted is drawn with one
// of those in which the path carries light, as probable as they transmit; value and density are those of all of them
// together (the balance heuristic of Veach, Guibas 1995). Of smooth glass no other way leads to the direction: the path
// carries the one channel from there on, and so many times as much as there were to choose from.
//
// A coat with a normal of its own counts its cosine itself, and reflects to wherever is above that normal: what it adds
// to value * cosine stands beside the value.
//
// A lobe narrower than CASTOR_LEAST_ALPHA is a delta: it is only sampled, and evaluate_bsdf leaves it out. No input
// within its ranges gives NaN or infinity; where wo or wi grazes by less than CASTOR_LEAST_COSINE, nothing
// is scattered.
#include "castor/shared/principled_material.h"
#include "device/albedo.lanes.cl"
#include "device/diffuse.lanes.cl"
#include "device/features.cl"
#include "device/frame.lanes.cl"
#include "device/microfacets.lanes.cl"
#include "device/sheen.lanes.cl"
#include "device/thin_film.lanes.cl"

#define CASTOR_LEAST_COSINE 1e-6f
#define CASTOR_CLEARCOAT_F0 0.04f
// The cosine of wo with a normal that it sees of facets of roughness 1, on the average of all wo.
#define CASTOR_MEAN_FACING 0.7f

// The materials of surfaces: see PrincipledMaterial.
typedef struct LANES(PrincipledMaterials) {
    LANES(Vectors) base_color, specular_color, sheen_color, diffuse_transmission_color;
    Real metallic, specular, sheen_roughness, diffuse_transmission;
    Real roughness, anisotropy, diffuse_roughness, transmission;
    Real refraction_index, absorption_index, clearcoat, clearcoat_roughness;
    Real anisotropy_cosine, anisotropy_sine;  // where x of the frame is
    LANES(Films) film;
    Real dispersion;
    // What is not of the material alone, but where it is met:
    LANES(Vectors) carried;      // a channel in which a path carries light is above 0
    LANES(Vectors) coat_normal;  // in the frame, unit, on the side of wo; means nothing where the coat has not its own
    Mask has_coat_normal;
    Mask is_thin;
    Whole flags;
} LANES(PrincipledMaterials);

#define CASTOR_PRINCIPLED_MATERIAL_ROWS 14u  // principled_material.h asserts the size

// Loads row `row` of the materials with these numbers. `is_same`: it is one material.
CASTOR_INLINE LANES(Rows) LANES(rows_of_materials)(const global PrincipledMaterial *restrict materials,
                                                   const Whole number, const int is_same, const uint row)
{
    const global float4 *const rows = (const global float4 *)materials;
#if CASTOR_LANES > 1
    if (is_same) return LANES(same_rows)(rows[LANES(first_lane)(number) * CASTOR_PRINCIPLED_MATERIAL_ROWS + row]);
#endif
    return LANES(gather_rows)(rows, number * CASTOR_PRINCIPLED_MATERIAL_ROWS + row);
}

// Loads the materials with these numbers. Neighbours mostly have the same.
CASTOR_INLINE LANES(PrincipledMaterials)
    LANES(load_principled_materials)(const global PrincipledMaterial *restrict materials, const Whole number)
{
    const int is_same = LANES(are_same)(number);
    const LANES(Rows) base = LANES(rows_of_materials)(materials, number, is_same, 0),
                      specular = LANES(rows_of_materials)(materials, number, is_same, 1),
                      sheen = LANES(rows_of_materials)(materials, number, is_same, 2),
                      passed = LANES(rows_of_materials)(materials, number, is_same, 3),
                      rough = LANES(rows_of_materials)(materials, number, is_same, 4),
                      coat = LANES(rows_of_materials)(materials, number, is_same, 5),
                      flags = LANES(rows_of_materials)(materials, number, is_same, 6),
                      turn = LANES(rows_of_materials)(materials, number, is_same, 7);
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
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
    material.flags = LANES(as_uint)(flags.x);
    material.is_thin = (material.flags & CASTOR_PRINCIPLED_THIN) != (Whole)(0);
    material.anisotropy_cosine = turn.x;
    material.anisotropy_sine = turn.y;
    material.dispersion = turn.w;
    material.film.share = material.film.index = material.film.thickness = zero;
#if CASTOR_HAS_OPTICS
    const LANES(Rows) film = LANES(rows_of_materials)(materials, number, is_same, 8);
    material.film.share = film.x;
    material.film.index = film.y;
    material.film.thickness = film.w;
#endif
    material.carried = LANES(vectors)(one, one, one);
    material.coat_normal = LANES(vectors)(zero, zero, one);
    material.has_coat_normal = (Whole)(0) != 0u;
    return material;
}

// What is known of scattering at surfaces when wo is: see prepare_bsdf. Gains are what lobes are multiplied by; a
// probability is that of drawing a lobe.
typedef struct LANES(Bsdfs) {
    LANES(Microfacets) base, coat;
    Mask is_smooth, is_smooth_glass, is_smooth_coat;  // deltas
    Mask is_thin, is_within;                          // within: wo is inside of glass
    Real eta;                                         // of what is behind the surface, against what wo is in
    Mask is_dispersive;
    Real eta_red, eta_blue;              // eta is that of green
    LANES(Vectors) channel_probability;  // of drawing the index of each channel
    LANES(Films) film;
    Real roughness;
    LANES(Vectors) metal_f0, metal_head_on, metal_gain;
    Real metal_n, metal_k;
    LANES(Vectors) dielectric_f0;
    Real dielectric_f90, largest_f0;
    LANES(Vectors) dielectric_gain;
    LANES(Vectors) specular_color;  // of glass
    Mask has_specular;              // it reflects other shares than Fresnel's equations say
    Real glass_gain;
    LANES(Vectors) glass_transmitted;  // gain of what is refracted
    LANES(Vectors) diffuse_color;
    Real diffuse_gain, diffuse_roughness;
    LANES(Vectors) passed_gain;
    LANES(Vectors) sheen_gain;
    Real sheen_roughness, sheen_albedo, sheen_largest;
    Real coat_gain;
    LANES(Vectors) coat_normal;  // where the coat has its own
    Mask has_coat_normal;
    Real base_probability, glass_probability, diffuse_probability, passed_probability, coat_probability,
        sheen_probability;
} LANES(Bsdfs);

typedef struct LANES(BsdfValues) {
    LANES(Vectors) value;  // the BSDF, without the cosine of wi
    Real coat;             // of coats with a normal of their own, cosine included: what is added to value * |cos|
    Real pdf;              // with which sample_bsdf draws wi, over solid angle
} LANES(BsdfValues);

typedef struct LANES(BsdfSamples) {
    LANES(Vectors) wi;      // unit
    LANES(Vectors) weight;  // value * |cos| / pdf; 0 where nothing is drawn
    Real coat;              // coat / pdf: see BsdfValues
    Real pdf;        // as evaluate_bsdf gives it; 0: nothing is drawn. Of a delta, the probability of drawing it.
    Mask is_delta;   // no other technique finds this direction: its weight in multiple importance sampling is 1
    Mask is_passed;  // a delta through a smooth thin wall: the only one that rays to lights follow, see passed_panes
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

CASTOR_INLINE LANES(Vectors) LANES(metal_terms)(const LANES(Bsdfs) * bsdf, const Real cos_half, const Real weight)
{
    LANES(Vectors) terms = LANES(schlick_terms)(bsdf->metal_f0, (Real)(1.0f), weight);
    const Mask is_exact = bsdf->metal_k > 0.0f;
    if (LANES(mask_of)(is_exact))
        terms = LANES(choose_vectors)(
            is_exact,
            LANES(scaled_vectors)(bsdf->metal_f0, LANES(conductor_reflectance)(bsdf->metal_n, bsdf->metal_k, cos_half)),
            terms);
    return terms;
}

// Returns a + share (b - a).
CASTOR_INLINE LANES(Vectors) LANES(mixed_vectors)(const LANES(Vectors) a, const Real share, const LANES(Vectors) b)
{
    return LANES(points_on_rays)(a, share, LANES(difference_of_vectors)(b, a));
}

// Returns what metal and dielectric reflect, gains included; to be multiplied by D G2 / (4 cos cos).
CASTOR_INLINE LANES(Vectors) LANES(base_terms)(const LANES(Bsdfs) * bsdf, const Real cos_half)
{
    const Real weight = LANES(schlick_weight)(cos_half);
    LANES(Vectors) metal = LANES(metal_terms)(bsdf, cos_half, weight);
    LANES(Vectors) dielectric = LANES(schlick_terms)(bsdf->dielectric_f0, bsdf->dielectric_f90, weight);
    const Mask has_film = bsdf->film.share > 0.0f;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(has_film)) {
        const LANES(FilmLights) light = LANES(meet_films)(bsdf->film, cos_half);
        metal = LANES(choose_vectors)(
            has_film, LANES(mixed_vectors)(metal, bsdf->film.share, LANES(film_terms)(light, bsdf->metal_head_on)),
            metal);
        dielectric = LANES(choose_vectors)(
            has_film, LANES(mixed_vectors)(dielectric, bsdf->film.share, LANES(film_terms)(light, bsdf->dielectric_f0)),
            dielectric);
    }
    return LANES(sum_of_vectors)(LANES(product_of_vectors)(bsdf->metal_gain, metal),
                                 LANES(product_of_vectors)(bsdf->dielectric_gain, dielectric));
}

// Returns the share of light along a direction that facets of the dielectric reflect, by the largest channel.
// `albedo`: of the facets without Fresnel's term; `lost`: (1 - E) / E, of their energy scale.
CASTOR_INLINE Real LANES(facet_albedo)(const LANES(Bsdfs) * bsdf, const Real cosine,
                                       const LANES(MicrofacetAlbedos) albedo, const Real lost)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    Real f0 = bsdf->largest_f0, f90 = bsdf->dielectric_f90;
    const Mask has_film = bsdf->film.share > 0.0f;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(has_film)) {
        // Schlick's term that agrees with the film where most of the facets that are seen face.
        const Real facing = fma(bsdf->roughness, (Real)(CASTOR_MEAN_FACING)-cosine, cosine);
        const Real weight = LANES(schlick_weight)(facing);
        const Real most =
            LANES(largest_component)(LANES(film_terms)(LANES(meet_films)(bsdf->film, facing), bsdf->dielectric_f0));
        const Real of_film =
            LANES(larger)(LANES(divide)(most - weight, LANES(larger)(1.0f - weight, (Real)(1e-6f))), zero);
        f0 = has_film ? fma(bsdf->film.share, of_film - f0, f0) : f0;
        f90 = has_film ? fma(bsdf->film.share, one - f90, f90) : f90;
    }
    return LANES(fresnel_albedo)(albedo, f0, f90, lost);
}

// Returns the share of light along a direction that facets of the dielectric do not reflect.
CASTOR_INLINE Real LANES(below_facets)(const LANES(Bsdfs) * bsdf, const Real cosine)
{
    const Mask has_facets = (bsdf->dielectric_f90 > 0.0f) | (bsdf->film.share > 0.0f);
    if (!LANES(mask_of)(has_facets)) return (Real)(1.0f);
    const LANES(MicrofacetAlbedos) albedo = LANES(microfacet_albedo)(cosine, bsdf->roughness);
    return 1.0f - LANES(facet_albedo)(bsdf, cosine, albedo, LANES(lost_energy)(albedo));
}

// What glass does with light that meets facets.
typedef struct LANES(GlassTerms) {
    LANES(Vectors) reflected;  // shares
    Real choice;               // probability of reflection, their largest; the rest is transmitted
    Real ratio, cos_there;     // see Interfaces
} LANES(GlassTerms);

// Returns what walls reflect of which each side reflects these shares.
CASTOR_INLINE LANES(Vectors) LANES(reflected_by_walls)(const LANES(Vectors) share)
{
    return LANES(vectors)(LANES(divide)(2.0f * share.x, 1.0f + share.x), LANES(divide)(2.0f * share.y, 1.0f + share.y),
                          LANES(divide)(2.0f * share.z, 1.0f + share.z));
}

// Returns what glass with `specular` and `specular_color` reflects (KHR_materials_specular): these scale what is
// reflected head-on, and `specular` alone at grazing angles. Between them lies what Fresnel's equations say, `once`.
CASTOR_INLINE LANES(Vectors) LANES(specular_reflectance)(const LANES(Bsdfs) * bsdf, const Real eta, const Real once)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real root = LANES(divide)(eta - 1.0f, eta + 1.0f), head_on = root * root;
    const Real grazing = LANES(divide)(once - head_on, 1.0f - head_on);
    const LANES(Vectors) f0 = LANES(scaled_vectors)(
        LANES(components_up_to_one)(LANES(scaled_vectors)(bsdf->specular_color, head_on)), bsdf->dielectric_f90);
    const Real from_f90 = bsdf->dielectric_f90 * grazing, from_f0 = 1.0f - grazing;
    return LANES(vectors)(clamp(fma(f0.x, from_f0, from_f90), zero, one),
                          clamp(fma(f0.y, from_f0, from_f90), zero, one),
                          clamp(fma(f0.z, from_f0, from_f90), zero, one));
}

// `eta`: of bsdf, that of the channel in question.
CASTOR_INLINE LANES(GlassTerms) LANES(glass_terms)(const LANES(Bsdfs) * bsdf, const Real eta, const Real cos_half)
{
    const Real one = (Real)(1.0f);
    const LANES(Interfaces) interface = LANES(meet_interface)(one, eta, cos_half);
    const Real once = interface.reflectance;
    const Real share = bsdf->is_thin ? LANES(divide)(2.0f * once, 1.0f + once) : once;
    const Mask is_total = !(share < 1.0f);
    LANES(Vectors) reflected = LANES(vectors)(share, share, share);
    if (LANES(mask_of)(bsdf->has_specular)) {
        const LANES(Vectors) other = LANES(specular_reflectance)(bsdf, eta, once);
        reflected = LANES(choose_vectors)(bsdf->has_specular,
                                          LANES(choose_vectors)(bsdf->is_thin, LANES(reflected_by_walls)(other), other),
                                          reflected);
    }
    const Mask has_film = bsdf->film.share > 0.0f;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(has_film)) {
        // From within, what leaves at an angle is reflected as what comes from there.
        LANES(Vectors)
        of_film = LANES(film_terms)(LANES(meet_films)(bsdf->film, bsdf->is_within ? interface.cos_there : cos_half),
                                    bsdf->dielectric_f0);
        of_film = LANES(choose_vectors)(bsdf->is_thin, LANES(reflected_by_walls)(of_film), of_film);
        reflected =
            LANES(choose_vectors)(has_film, LANES(mixed_vectors)(reflected, bsdf->film.share, of_film), reflected);
    }
    LANES(GlassTerms) terms;
    terms.reflected = LANES(choose_vectors)(is_total, LANES(vectors)(one, one, one), reflected);
    terms.choice = LANES(largest_component)(terms.reflected);
    terms.ratio = interface.ratio;
    terms.cos_there = interface.cos_there;
    return terms;
}

// What glass of all channels does with light that meets facets: that of green, but where there is dispersion.
typedef struct LANES(DrawnGlass) {
    LANES(Vectors) reflected;  // shares
    Real choice;               // probability of reflection
    // One of the ways of what is refracted:
    Real probability;       // of it
    LANES(Vectors) passed;  // its shares of channels: of others than the drawn one none
    Real ratio, cos_there;  // see Interfaces
} LANES(DrawnGlass);

// `rest`: in [0, 1), chooses between reflection and refraction, with the index of one channel.
CASTOR_INLINE LANES(DrawnGlass) LANES(draw_glass)(const LANES(Bsdfs) * bsdf, const Real cos_half, const Real rest)
{
    const LANES(GlassTerms) green = LANES(glass_terms)(bsdf, bsdf->eta, cos_half);
    LANES(DrawnGlass) drawn;
    drawn.reflected = green.reflected;
    drawn.choice = green.choice;
    drawn.probability = 1.0f - green.choice;
    drawn.passed = LANES(vectors)(drawn.probability, drawn.probability, drawn.probability);
    drawn.ratio = green.ratio;
    drawn.cos_there = green.cos_there;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(bsdf->is_dispersive)) {
        const Real zero = (Real)(0.0f);
        const LANES(GlassTerms) red = LANES(glass_terms)(bsdf, bsdf->eta_red, cos_half),
                                blue = LANES(glass_terms)(bsdf, bsdf->eta_blue, cos_half);
        const Real of_red = bsdf->channel_probability.x * (1.0f - red.choice);
        const Real of_green = bsdf->channel_probability.y * (1.0f - green.choice);
        const Real of_blue = bsdf->channel_probability.z * (1.0f - blue.choice);
        const Real choice =
            fma(bsdf->channel_probability.x, red.choice,
                fma(bsdf->channel_probability.y, green.choice, bsdf->channel_probability.z * blue.choice));
        const Real left = rest - choice;
        const Mask is_red = left < of_red, is_blue = !is_red & (left >= of_red + of_green) & (of_blue > 0.0f);
        const Mask is_green = !is_red & !is_blue;
        const Mask is_dispersive = bsdf->is_dispersive;
        drawn.reflected = LANES(choose_vectors)(
            is_dispersive, LANES(vectors)(red.reflected.x, green.reflected.y, blue.reflected.z), drawn.reflected);
        drawn.choice = is_dispersive ? choice : drawn.choice;
        drawn.probability = is_dispersive ? (is_red ? of_red : (is_green ? of_green : of_blue)) : drawn.probability;
        drawn.passed = LANES(choose_vectors)(
            is_dispersive,
            LANES(vectors)(is_red ? 1.0f - red.choice : zero, is_green ? 1.0f - green.choice : zero,
                           is_blue ? 1.0f - blue.choice : zero),
            drawn.passed);
        drawn.ratio = is_dispersive & is_red ? red.ratio : (is_dispersive & is_blue ? blue.ratio : drawn.ratio);
        drawn.cos_there =
            is_dispersive & is_red ? red.cos_there : (is_dispersive & is_blue ? blue.cos_there : drawn.cos_there);
    }
    return drawn;
}

// Returns the directional albedo of rough glass, as glass_albedo, also for two alphas and for what
// KHR_materials_specular changes: an integral over normals that are seen along wo, by points of a spherical Fibonacci
// lattice (Keinert and others 2015). 128 of them leave errors of up to 0.023, 256 of up to 0.01.
CASTOR_ONCE Real LANES(integrated_glass_albedo)(const LANES(Bsdfs) * bsdf, const LANES(Vectors) wo)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const uint count = 256u;
    const int has_specular = LANES(mask_of)(bsdf->has_specular) != 0u;
    const LANES(Microfacets) facets = bsdf->base;
    const Real of_wo = wo.z + facets.stretched;  // of Smith's terms G2 / G1
    const LANES(Vectors) back = LANES(scaled_vectors)(wo, (Real)(-1.0f));
    Real sum = zero;
    for (uint i = 0; i < count; ++i) {
        LANES(Points) point;
        point.x = (Real)((float)(i * 2654435769u) * 0x1p-32f);  // of a turn: the golden ratio's share
        point.y = (Real)(((float)i + 0.5f) / (float)count);
        const LANES(Vectors) h = LANES(sample_normals)(facets, one, wo, point);
        const Real cos_half = LANES(dot_products)(wo, h);
        const LANES(Interfaces) interface = LANES(meet_interface)(one, bsdf->eta, cos_half);
        Real share = interface.reflectance;
        if (has_specular) {
            const Mask is_other = bsdf->has_specular & (share < 1.0f);
            const Real other = LANES(largest_component)(LANES(specular_reflectance)(bsdf, bsdf->eta, share));
            share = is_other ? other : share;
        }
        const LANES(Vectors) reflected = LANES(points_on_rays)(back, 2.0f * cos_half, h);
        const LANES(Vectors) passed =
            LANES(points_on_rays)(LANES(scaled_vectors)(wo, interface.ratio),
                                  interface.cos_there - interface.ratio * cos_half, h);  // against the refracted way
        const Real out = reflected.z, in = passed.z;
        const Real shown = LANES(divide)(
            out * of_wo,
            fma(out, facets.stretched, wo.z * LANES(stretched_length)(facets.alpha_x, facets.alpha_y, reflected)));
        const Real shone = LANES(divide)(
            in * of_wo,
            fma(in, facets.stretched, wo.z * LANES(stretched_length)(facets.alpha_x, facets.alpha_y, passed)));
        sum += out > 0.0f ? share * shown : zero;
        sum += in > 0.0f ? (1.0f - share) * shone : zero;
    }
    return LANES(larger)(sum * (1.0f / (float)count), (Real)(0.01f));
}

// Returns what is known when wo is. `is_inside`: wo is inside of the solid that the surface bounds; it matters where
// this transmits light and is not thin.
CASTOR_ONCE void LANES(prepare_bsdf)(const LANES(PrincipledMaterials) * material, const LANES(Vectors) wo,
                                     const Mask is_inside, LANES(Bsdfs) * bsdf)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Mask is_within = is_inside & (material->transmission > 0.0f) & !material->is_thin;
    bsdf->is_thin = material->is_thin;
    bsdf->is_within = is_within;
    bsdf->film = material->film;
    bsdf->film.share = material->film.thickness > 0.0f ? clamp(material->film.share, zero, one) : zero;
    bsdf->film.index = clamp(material->film.index, one, (Real)(1e3f));
    bsdf->film.thickness = LANES(smaller)(material->film.thickness, (Real)(1e9f));

    // Facets: alpha along x is larger by the anisotropy (KHR_materials_anisotropy).
    const Real roughness = clamp(material->roughness, zero, one), alpha = roughness * roughness;
    const Real stretch = material->anisotropy * material->anisotropy;
    const Real alpha_x = fma(1.0f - alpha, stretch, alpha);
    bsdf->base = LANES(see_microfacets)(alpha_x, alpha, wo);
    bsdf->is_smooth = alpha_x < CASTOR_LEAST_ALPHA;
    bsdf->roughness = bsdf->is_smooth ? zero : roughness;
    // Where no facet reflects, their albedo is not asked for.
    const Mask has_facets = (material->metallic > 0.0f) | (material->specular > 0.0f) |
                            (material->transmission > 0.0f) | (bsdf->film.share > 0.0f);
    LANES(MicrofacetAlbedos) albedo = {one, one};
    if (LANES(mask_of)(has_facets)) albedo = LANES(microfacet_albedo)(wo.z, bsdf->roughness);
    Real lost = LANES(lost_energy)(albedo);
    const Mask is_stretched = stretch > 0.0f;
    if (LANES(mask_of)(is_stretched)) {
        const Real squared = fma(wo.x, wo.x, wo.y * wo.y);
        const Mask is_tilted = squared > 1e-12f;
        const Real along_x =
            is_tilted ? LANES(divide)(fabs(wo.x), LANES(square_root)(is_tilted ? squared : one)) : zero;
        const Real all = LANES(stretched_albedo)(wo.z, along_x, bsdf->roughness, material->anisotropy);
        lost = is_stretched ? LANES(divide)(1.0f - all, all) : lost;
    }

    // What the clearcoat lets pass.
    bsdf->has_coat_normal = material->has_coat_normal;
    bsdf->coat_normal = material->coat_normal;
    LANES(Vectors) coat_wo = wo;
    Mask has_coat = !is_within;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(bsdf->has_coat_normal)) {
        coat_wo =
            LANES(choose_vectors)(bsdf->has_coat_normal, LANES(in_frame)(LANES(frames)(bsdf->coat_normal), wo), wo);
        has_coat &= !bsdf->has_coat_normal | (coat_wo.z >= CASTOR_LEAST_COSINE);
    }
    const Real clearcoat = has_coat ? material->clearcoat : zero;
    const Real coat_roughness = clamp(material->clearcoat_roughness, zero, one);
    const Real coat_alpha = coat_roughness * coat_roughness;
    bsdf->coat = LANES(see_microfacets)(coat_alpha, coat_alpha, coat_wo);
    bsdf->is_smooth_coat = coat_alpha < CASTOR_LEAST_ALPHA;
    bsdf->coat_gain = clearcoat;
    Real coat_albedo = zero;
    if (LANES(mask_of)(clearcoat > 0.0f)) {
        const LANES(MicrofacetAlbedos) of_coat =
            LANES(microfacet_albedo)(coat_wo.z, bsdf->is_smooth_coat ? zero : coat_roughness);
        coat_albedo = clearcoat * LANES(fresnel_albedo)(of_coat, (Real)(CASTOR_CLEARCOAT_F0), one, zero);
    }
    const Real below_coat = 1.0f - coat_albedo;

    // Sheen.
    bsdf->sheen_roughness = LANES(larger)(material->sheen_roughness, (Real)(CASTOR_LEAST_SHEEN_ROUGHNESS));
    const LANES(Vectors) no_color = LANES(vectors)(zero, zero, zero);
    bsdf->sheen_gain =
        LANES(choose_vectors)(is_within, no_color, LANES(scaled_vectors)(material->sheen_color, below_coat));
    bsdf->sheen_largest = is_within ? zero : LANES(largest_component)(material->sheen_color);
    bsdf->sheen_albedo = zero;
    if (LANES(mask_of)(bsdf->sheen_largest > 0.0f))
        bsdf->sheen_albedo = LANES(sheen_albedo)(wo.z, bsdf->sheen_roughness);
    const Real sheen_reflected = bsdf->sheen_largest * LANES(smaller)(bsdf->sheen_albedo, one);

    // Metal.
    const Real metallic = clamp(material->metallic, zero, one);
    const Real metal_share = metallic * below_coat, other_share = (1.0f - metallic) * below_coat;
    bsdf->metal_f0 = material->base_color;
    bsdf->metal_n = material->refraction_index;
    bsdf->metal_k = material->absorption_index;
    LANES(Vectors) f0 = material->base_color;
    const Mask is_conductor = bsdf->metal_k > 0.0f;
    if (LANES(mask_of)(is_conductor))
        f0 = LANES(choose_vectors)(
            is_conductor, LANES(scaled_vectors)(f0, LANES(conductor_reflectance)(bsdf->metal_n, bsdf->metal_k, one)),
            f0);
    bsdf->metal_head_on = f0;
    bsdf->metal_gain =
        LANES(vectors)(metal_share * LANES(energy_scale)(f0.x, lost), metal_share * LANES(energy_scale)(f0.y, lost),
                       metal_share * LANES(energy_scale)(f0.z, lost));

    // Dielectrics.
    const Real transmission = clamp(material->transmission, zero, one);
    const Real index = clamp(is_conductor ? (Real)(1.5f) : material->refraction_index, (Real)(1e-3f), (Real)(1e3f));
    const Real ratio = LANES(divide)(index - 1.0f, index + 1.0f);
    bsdf->dielectric_f90 = clamp(material->specular, zero, one);
    bsdf->dielectric_f0 = LANES(scaled_vectors)(
        LANES(components_up_to_one)(LANES(scaled_vectors)(material->specular_color, ratio * ratio)),
        bsdf->dielectric_f90);
    bsdf->largest_f0 = LANES(largest_component)(bsdf->dielectric_f0);
    const Real opaque = other_share * (1.0f - transmission);
    bsdf->dielectric_gain = LANES(vectors)(opaque * LANES(energy_scale)(bsdf->dielectric_f0.x, lost),
                                           opaque * LANES(energy_scale)(bsdf->dielectric_f0.y, lost),
                                           opaque * LANES(energy_scale)(bsdf->dielectric_f0.z, lost));
    const Real of_facets = LANES(facet_albedo)(bsdf, wo.z, albedo, lost);

    // What is diffuse below them. Of films no more is known than that the average is not below that of f0 = 0.
    const Mask has_film = bsdf->film.share > 0.0f;
    const Real least_f0 = has_film ? bsdf->largest_f0 * (1.0f - bsdf->film.share) : bsdf->largest_f0;
    const Real mean_rest = 1.0f - LANES(mean_fresnel_albedo)(bsdf->roughness, least_f0, bsdf->dielectric_f90);
    const Mask has_rest = mean_rest > 1e-4f;
    const Real diffuse = has_rest ? opaque * LANES(divide)(1.0f - of_facets, has_rest ? mean_rest : one) : zero;
    const Real passed = clamp(material->diffuse_transmission, zero, one);
    bsdf->diffuse_color = LANES(components_up_to_one)(material->base_color);
    bsdf->diffuse_gain = diffuse * (1.0f - passed);
    bsdf->diffuse_roughness = clamp(material->diffuse_roughness, zero, one);
    bsdf->passed_gain =
        LANES(scaled_vectors)(material->diffuse_transmission_color, diffuse * passed * CASTOR_INVERSE_PI);

    // Glass.
    const Real glass = other_share * transmission;
    bsdf->eta = is_within ? LANES(divide)(one, index) : index;
    bsdf->specular_color = material->specular_color;
    bsdf->has_specular = (glass > 0.0f) & ((material->specular_color.x != 1.0f) | (material->specular_color.y != 1.0f) |
                                           (material->specular_color.z != 1.0f) | (bsdf->dielectric_f90 != 1.0f));
    bsdf->is_smooth_glass = bsdf->is_smooth | (!bsdf->is_thin & (fabs(bsdf->eta - 1.0f) * bsdf->base.alpha_y < 1e-5f));
    Real lost_in_glass = lost;
    const Mask is_rough_solid = (glass > 0.0f) & !bsdf->is_thin;
    if (LANES(mask_of)(is_rough_solid)) {
        Real all = LANES(glass_albedo)(wo.z, bsdf->roughness, bsdf->eta);
        const Mask has_no_table = is_stretched | bsdf->has_specular;
        if (CASTOR_HAS_OPTICS && LANES(mask_of)(has_no_table & is_rough_solid & !bsdf->is_smooth_glass))
            all = has_no_table ? LANES(integrated_glass_albedo)(bsdf, wo) : all;
        Real lost_in_solid = LANES(divide)(1.0f - all, all);
        // Neither the table nor the integral knows of films.
        lost_in_solid *= 1.0f - bsdf->film.share;
        lost_in_glass = is_rough_solid ? (bsdf->is_smooth_glass ? zero : lost_in_solid) : lost_in_glass;
    }
    bsdf->glass_gain = glass * (1.0f + lost_in_glass);
    bsdf->glass_transmitted = LANES(scaled_vectors)(material->base_color, bsdf->glass_gain);
    bsdf->is_dispersive = (material->dispersion > 0.0f) & (glass > 0.0f) & !bsdf->is_thin;
    bsdf->eta_red = bsdf->eta_blue = bsdf->eta;
    bsdf->channel_probability = LANES(vectors)(zero, one, zero);
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(bsdf->is_dispersive)) {
        // KHR_materials_dispersion: (n - 1) / V between the lines F and C, with V = 20 / dispersion.
        const Real above = LANES(larger)(index - 1.0f, zero);
        const Real half_spread = LANES(smaller)(0.025f * above * material->dispersion, above);
        const Real red = index - half_spread, blue = index + half_spread;
        bsdf->eta_red = is_within ? LANES(divide)(one, red) : red;
        bsdf->eta_blue = is_within ? LANES(divide)(one, blue) : blue;
        const Real has_red = material->carried.x > 0.0f ? one : zero,
                   has_green = material->carried.y > 0.0f ? one : zero,
                   has_blue = material->carried.z > 0.0f ? one : zero;
        const Real share = LANES(divide)(one, LANES(larger)(has_red + has_green + has_blue, one));
        bsdf->channel_probability = LANES(choose_vectors)(
            bsdf->is_dispersive, LANES(vectors)(has_red * share, has_green * share, has_blue * share),
            bsdf->channel_probability);
    }

    // Lobes are drawn in proportion to about what they scatter of uniform light.
    const Real below_sheen = 1.0f - sheen_reflected;
    const LANES(Vectors) metal_albedo =
        LANES(vectors)(LANES(fresnel_albedo)(albedo, f0.x, one, lost), LANES(fresnel_albedo)(albedo, f0.y, one, lost),
                       LANES(fresnel_albedo)(albedo, f0.z, one, lost));
    const Real plain_metal = LANES(mean_component)(metal_albedo);
    const Real of_metal = has_film ? fma(bsdf->film.share, albedo.all - plain_metal, plain_metal) : plain_metal;
    const Real of_base = below_sheen * fma(metal_share, of_metal, opaque * of_facets);
    const Real reflected = LANES(glass_terms)(bsdf, bsdf->eta, wo.z).choice;
    const Real of_glass =
        below_sheen * glass * fma(1.0f - reflected, LANES(mean_component)(material->base_color), reflected);
    const Real of_diffuse = below_sheen * opaque * (1.0f - of_facets);
    const Real of_reflected = of_diffuse * (1.0f - passed) * LANES(mean_component)(bsdf->diffuse_color);
    const Real of_passed = of_diffuse * passed * LANES(mean_component)(material->diffuse_transmission_color);
    const Real of_sheen = LANES(mean_component)(bsdf->sheen_gain) * LANES(smaller)(bsdf->sheen_albedo, one);
    const Real sum = of_base + of_glass + of_reflected + of_passed + coat_albedo + of_sheen;
    const Mask is_seen = (wo.z >= CASTOR_LEAST_COSINE) & (sum > 1e-20f) & (sum <= FLT_MAX);
    const Real inverse = is_seen ? LANES(divide)(one, is_seen ? sum : one) : zero;
    bsdf->base_probability = of_base * inverse;
    bsdf->glass_probability = of_glass * inverse;
    bsdf->diffuse_probability = of_reflected * inverse;
    bsdf->passed_probability = of_passed * inverse;
    bsdf->coat_probability = coat_albedo * inverse;
    bsdf->sheen_probability = of_sheen * inverse;
}

// Returns the share of light that passes the sheen, along wo and wi.
CASTOR_INLINE Real LANES(below_sheen)(const LANES(Bsdfs) * bsdf, const Real albedo_wi)
{
    const Real largest = LANES(smaller)(LANES(larger)(bsdf->sheen_albedo, albedo_wi), (Real)(1.0f));
    return fma(-bsdf->sheen_largest, largest, (Real)(1.0f));
}

// Returns what is left of light that passes smooth thin walls straight, or the surfaces of solids of index 1, for wo;
// (0,0,0) of all others. Where
// sample_bsdf draws this direction, its weight is this, divided by the probability.
CASTOR_INLINE LANES(Vectors) LANES(passed_panes)(const LANES(Bsdfs) * bsdf, const LANES(Vectors) wo)
{
    const Real zero = (Real)(0.0f);
    Mask is_pane = bsdf->is_thin;
#if CASTOR_HAS_MATCHED_SOLIDS
    is_pane |= bsdf->eta == 1.0f;
#endif
    is_pane &= bsdf->is_smooth_glass & (bsdf->glass_probability > 0.0f);
    const Real share = 1.0f - LANES(glass_terms)(bsdf, bsdf->eta, wo.z).choice;
    return LANES(scaled_vectors)(bsdf->glass_transmitted, is_pane ? share * LANES(below_sheen)(bsdf, zero) : zero);
}

// What a rough interface refracts with one index, for a gain of 1: the BSDF, and the density of drawing it.
typedef struct LANES(PassedLight) {
    Real value, pdf;
} LANES(PassedLight);

CASTOR_INLINE LANES(PassedLight)
    LANES(pass_interface)(const LANES(Bsdfs) * bsdf, const Real index, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real eta = bsdf->is_thin ? one : index;
    const LANES(Vectors) beyond = LANES(vectors)(wi.x, wi.y, bsdf->is_thin ? -wi.z : wi.z);
    const LANES(Vectors) sum = LANES(points_on_rays)(wo, eta, beyond);
    const LANES(Vectors) h = LANES(normalized_vectors)(LANES(scaled_vectors)(sum, sum.z < 0.0f ? (Real)(-1.0f) : one));
    const Real cos_wo = LANES(dot_products)(wo, h), cos_wi = LANES(dot_products)(beyond, h);
    const Mask is_thick = !bsdf->is_thin;
    const Mask is_possible = (cos_wo > 0.0f) & ((bsdf->is_thin & (cos_wi > 0.0f)) | (is_thick & (cos_wi < 0.0f)));
    const Real density = LANES(density_of_normals)(bsdf->base, h);
    const Real transmitted = 1.0f - LANES(glass_terms)(bsdf, index, cos_wo).choice;
    // Of directions for each direction of h, times |wo.h|; of a mirror 1/4.
    const Real width = fma(eta, cos_wi, cos_wo);
    const Mask has_width = width * width > 1e-20f;
    const Real jacobian = LANES(divide)(eta * eta * cos_wo * fabs(cos_wi), has_width ? width * width : one);
    const Real factor = bsdf->is_thin ? (Real)(0.25f) : jacobian;
    const Mask is_scattered = is_possible & has_width & (transmitted > 0.0f);
    const Real both = is_scattered ? transmitted * density * factor : zero;
    LANES(PassedLight) result;
    result.value = 4.0f * both * LANES(visibility)(bsdf->base, wo.z, wi);
    result.pdf = 4.0f * LANES(reflection_pdf)(bsdf->base, one, wo.z, both);
    return result;
}

// Evaluates what is refracted, or passes a thin wall, and is not a delta.
CASTOR_INLINE LANES(BsdfValues)
    LANES(evaluate_transmission)(const LANES(Bsdfs) * bsdf, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const LANES(PassedLight) green = LANES(pass_interface)(bsdf, bsdf->eta, wo, wi);
    LANES(Vectors) value = LANES(vectors)(green.value, green.value, green.value);
    Real pdf = green.pdf;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(bsdf->is_dispersive)) {
        const LANES(PassedLight) red = LANES(pass_interface)(bsdf, bsdf->eta_red, wo, wi),
                                 blue = LANES(pass_interface)(bsdf, bsdf->eta_blue, wo, wi);
        value = LANES(choose_vectors)(bsdf->is_dispersive, LANES(vectors)(red.value, green.value, blue.value), value);
        const Real of_all = fma(bsdf->channel_probability.x, red.pdf,
                                fma(bsdf->channel_probability.y, green.pdf, bsdf->channel_probability.z * blue.pdf));
        pdf = bsdf->is_dispersive ? of_all : pdf;
    }
    LANES(BsdfValues) result;
    result.value = LANES(product_of_vectors)(bsdf->glass_transmitted, value);
    result.coat = (Real)(0.0f);
    result.pdf = bsdf->glass_probability * pdf;
    return result;
}

// What clearcoats reflect, cosine not included, and the density with which that is drawn; in the coat's own frame.
// `h`: the half vector, whose cosine with wo is `cos_half`.
typedef struct LANES(CoatLights) {
    Real value, pdf;
} LANES(CoatLights);

CASTOR_INLINE LANES(CoatLights)
    LANES(evaluate_coat)(const LANES(Bsdfs) * bsdf, const Mask has_coat, const LANES(Vectors) wo,
                         const LANES(Vectors) wi, const LANES(Vectors) h, const Real cos_half)
{
    const Real density = has_coat ? LANES(density_of_normals)(bsdf->coat, h) : (Real)(0.0f);
    const Real term =
        fma((Real)(1.0f - CASTOR_CLEARCOAT_F0), LANES(schlick_weight)(cos_half), (Real)(CASTOR_CLEARCOAT_F0));
    LANES(CoatLights) coat;
    coat.value = bsdf->coat_gain * term * density * LANES(visibility)(bsdf->coat, wo.z, wi);
    coat.pdf = LANES(reflection_pdf)(bsdf->coat, bsdf->coat.bound, wo.z, density);
    return coat;
}

// Evaluates what is reflected and is not a delta.
CASTOR_INLINE LANES(BsdfValues)
    LANES(evaluate_reflection)(const LANES(Bsdfs) * bsdf, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Vectors) h = LANES(normalized_vectors)(LANES(sum_of_vectors)(wo, wi));
    const Real cos_half = LANES(dot_products)(wo, h);
    LANES(BsdfValues) result;
    result.value = LANES(vectors)(zero, zero, zero);
    result.coat = zero;
    result.pdf = zero;

    // Metal, dielectric and glass.
    const Mask is_glass = bsdf->glass_probability > 0.0f;
    if (LANES(mask_of)((!bsdf->is_smooth) & ((bsdf->base_probability > 0.0f) | is_glass))) {
        const Real density = LANES(density_of_normals)(bsdf->base, h);
        const Real base = bsdf->is_smooth ? zero : density;
        LANES(Vectors) reflected = LANES(scaled_vectors)(LANES(base_terms)(bsdf, cos_half), base);
        result.pdf = bsdf->base_probability * LANES(reflection_pdf)(bsdf->base, bsdf->base.bound, wo.z, base);
        if (LANES(mask_of)(is_glass)) {
            const LANES(DrawnGlass) terms = LANES(draw_glass)(bsdf, cos_half, zero);
            const Real glass = (is_glass & !bsdf->is_smooth_glass) ? density : zero;
            reflected = LANES(points_on_rays)(reflected, bsdf->glass_gain * glass, terms.reflected);
            result.pdf = fma(bsdf->glass_probability * terms.choice,
                             LANES(reflection_pdf)(bsdf->base, one, wo.z, glass), result.pdf);
        }
        result.value = LANES(scaled_vectors)(reflected, LANES(visibility)(bsdf->base, wo.z, wi));
    }

    // What is diffuse.
    if (LANES(mask_of)(bsdf->diffuse_gain > 0.0f)) {
        const Real rest = LANES(below_facets)(bsdf, wi.z);
        const Mask is_rough = bsdf->diffuse_roughness > 0.0f;
        LANES(Vectors) diffuse = LANES(scaled_vectors)(bsdf->diffuse_color, (Real)(CASTOR_INVERSE_PI));
        Real pdf = CASTOR_INVERSE_PI * wi.z;
        if (LANES(mask_of)(is_rough)) {
            diffuse = LANES(choose_vectors)(
                is_rough, LANES(eon_value)(bsdf->diffuse_color, bsdf->diffuse_roughness, wo, wi), diffuse);
            pdf = is_rough ? LANES(eon_pdf)(bsdf->diffuse_roughness, wo, wi) : pdf;
        }
        result.value = LANES(points_on_rays)(result.value, bsdf->diffuse_gain * rest, diffuse);
        result.pdf = fma(bsdf->diffuse_probability, pdf, result.pdf);
    }

    // Sheen.
    if (LANES(mask_of)(bsdf->sheen_largest > 0.0f)) {
        const Mask has_sheen = bsdf->sheen_largest > 0.0f;
        const Real albedo_wi = LANES(sheen_albedo)(wi.z, bsdf->sheen_roughness);
        const Real sheen = LANES(sheen_value)(bsdf->sheen_roughness, wo, wi, bsdf->sheen_albedo, albedo_wi);
        const LANES(Vectors) layered = LANES(points_on_rays)(
            LANES(scaled_vectors)(result.value, LANES(below_sheen)(bsdf, albedo_wi)), sheen, bsdf->sheen_gain);
        result.value = LANES(choose_vectors)(has_sheen, layered, result.value);
        result.pdf = has_sheen ? fma(bsdf->sheen_probability, CASTOR_INVERSE_PI * wi.z, result.pdf) : result.pdf;
    }

    // Clearcoat.
    const Mask has_coat = (bsdf->coat_gain > 0.0f) & !bsdf->is_smooth_coat & !bsdf->has_coat_normal;
    if (LANES(mask_of)(has_coat)) {
        const LANES(CoatLights) coat = LANES(evaluate_coat)(bsdf, has_coat, wo, wi, h, cos_half);
        const Real value = has_coat ? coat.value : zero;
        result.value = LANES(sum_of_vectors)(result.value, LANES(vectors)(value, value, value));
        result.pdf = has_coat ? fma(bsdf->coat_probability, coat.pdf, result.pdf) : result.pdf;
    }
    return result;
}

// Returns the BSDF and the density with which sample_bsdf draws wi, without deltas.
CASTOR_ONCE LANES(BsdfValues)
    LANES(evaluate_bsdf)(const LANES(Bsdfs) * bsdf, const LANES(Vectors) wo, const LANES(Vectors) wi)
{
    const Real zero = (Real)(0.0f);
    const Mask is_reflected = (wo.z >= CASTOR_LEAST_COSINE) & (wi.z >= CASTOR_LEAST_COSINE);
    const Mask is_through = (wo.z >= CASTOR_LEAST_COSINE) & (wi.z <= -CASTOR_LEAST_COSINE);
    LANES(BsdfValues) result;
    result.value = LANES(vectors)(zero, zero, zero);
    result.coat = zero;
    result.pdf = zero;
    if (LANES(mask_of)(is_reflected)) {
        const LANES(BsdfValues) reflected = LANES(evaluate_reflection)(bsdf, wo, wi);
        result.value = LANES(choose_vectors)(is_reflected, reflected.value, result.value);
        result.pdf = is_reflected ? reflected.pdf : result.pdf;
    }
    const Mask is_glass = is_through & (bsdf->glass_probability > 0.0f) & !bsdf->is_smooth_glass;
    if (LANES(mask_of)(is_glass)) {
        const LANES(BsdfValues) transmitted = LANES(evaluate_transmission)(bsdf, wo, wi);
        result.value = LANES(choose_vectors)(is_glass, transmitted.value, result.value);
        result.pdf = is_glass ? transmitted.pdf : result.pdf;
    }
    const Mask is_passed = is_through & (bsdf->passed_probability > 0.0f);
    if (LANES(mask_of)(is_passed)) {
        const Real rest = LANES(below_facets)(bsdf, -wi.z);
        const LANES(Vectors) sum = LANES(points_on_rays)(result.value, rest, bsdf->passed_gain);
        result.value = LANES(choose_vectors)(is_passed, sum, result.value);
        result.pdf = is_passed ? fma(bsdf->passed_probability, CASTOR_INVERSE_PI * -wi.z, result.pdf) : result.pdf;
    }
    const Real passed = is_through ? LANES(below_sheen)(bsdf, zero) : (Real)(1.0f);
    result.value = LANES(scaled_vectors)(result.value, passed);
    const Mask has_own_coat = bsdf->has_coat_normal & (bsdf->coat_gain > 0.0f) & !bsdf->is_smooth_coat;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(has_own_coat)) {
        const LANES(Frames) frame = LANES(frames)(bsdf->coat_normal);
        const LANES(Vectors) seen = LANES(in_frame)(frame, wo), lit = LANES(in_frame)(frame, wi);
        const Mask is_lit = has_own_coat & (wo.z >= CASTOR_LEAST_COSINE) & (lit.z >= CASTOR_LEAST_COSINE);
        const LANES(Vectors) h = LANES(normalized_vectors)(LANES(sum_of_vectors)(seen, lit));
        const LANES(CoatLights) coat = LANES(evaluate_coat)(bsdf, is_lit, seen, lit, h, LANES(dot_products)(seen, h));
        result.coat = is_lit ? coat.value * lit.z : zero;
        result.pdf = is_lit ? fma(bsdf->coat_probability, coat.pdf, result.pdf) : result.pdf;
    }
    return result;
}

// Draws directions. `choice`: chooses the lobe, in [0, 1), and independent of `point`.
CASTOR_ONCE LANES(BsdfSamples)
    LANES(sample_bsdf)(const LANES(Bsdfs) * bsdf, const LANES(Vectors) wo, const Real choice, const LANES(Points) point)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    // Base, glass, diffuse, passed, coat, sheen, side by side.
    const Real end_base = bsdf->base_probability, end_glass = end_base + bsdf->glass_probability;
    const Real end_diffuse = end_glass + bsdf->diffuse_probability, end_passed = end_diffuse + bsdf->passed_probability;
    const Real end_coat = end_passed + bsdf->coat_probability;
    const Mask in_base = choice < end_base, in_glass = !in_base & (choice < end_glass);
    const Mask in_diffuse = (choice >= end_glass) & (choice < end_diffuse);
    const Mask in_passed = (choice >= end_diffuse) & (choice >= end_glass) & (choice < end_passed);
    const Mask in_coat = (choice >= end_passed) & (choice >= end_glass) & (choice < end_coat);
    const Mask in_facets = in_base | in_glass | in_coat;
    const Real begin = in_glass ? end_base : end_glass;
    const Real share = in_glass ? bsdf->glass_probability : bsdf->diffuse_probability;
    const Mask is_chosen = (in_glass | in_diffuse) & (share > 0.0f);
    // What is left of the choice within the lobe.
    const Real rest = clamp(LANES(divide)(choice - begin, is_chosen ? share : one), zero, (Real)(0x1.fffffep-1f));

    LANES(BsdfSamples) sample;
    sample.is_delta =
        (in_base & bsdf->is_smooth) | (in_glass & bsdf->is_smooth_glass) | (in_coat & bsdf->is_smooth_coat);
    const LANES(Vectors) up = LANES(vectors)(zero, zero, one);
    sample.wi = up;
    LANES(DrawnGlass) glass = {{zero, zero, zero}, zero, zero, {zero, zero, zero}, zero, zero};
    Mask is_through = in_passed;
    sample.is_passed = (Whole)(0) != 0u;
    const Mask in_own_coat = in_coat & bsdf->has_coat_normal;
    LANES(Vectors) seen = wo;      // in the frame of the lobe
    Real cos_coat = (Real)(1.0f);  // of wi, where a coat with its own normal is drawn
    if (LANES(mask_of)(in_facets)) {
        LANES(Microfacets) facets;
        facets.alpha_x = in_coat ? bsdf->coat.alpha_x : bsdf->base.alpha_x;
        facets.alpha_y = in_coat ? bsdf->coat.alpha_y : bsdf->base.alpha_y;
        facets.stretched = in_coat ? bsdf->coat.stretched : bsdf->base.stretched;
        const Real bound = in_glass ? one : (in_coat ? bsdf->coat.bound : bsdf->base.bound);
        const LANES(Frames) coat_frame = LANES(frames)(bsdf->coat_normal);
        if (CASTOR_HAS_OPTICS && LANES(mask_of)(in_own_coat))
            seen = LANES(choose_vectors)(in_own_coat, LANES(in_frame)(coat_frame, wo), wo);
        const LANES(Vectors) h =
            LANES(choose_vectors)(sample.is_delta, up, LANES(sample_normals)(facets, bound, seen, point));
        const Real cos_half = LANES(dot_products)(seen, h);
        LANES(Vectors) mirrored = LANES(difference_of_vectors)(LANES(scaled_vectors)(h, 2.0f * cos_half), seen);
        if (CASTOR_HAS_OPTICS && LANES(mask_of)(in_own_coat)) {
            cos_coat = in_own_coat ? mirrored.z : cos_coat;
            mirrored = LANES(choose_vectors)(in_own_coat, LANES(out_of_frame)(coat_frame, mirrored), mirrored);
        }
        sample.wi = LANES(choose_vectors)(in_facets, mirrored, sample.wi);
        if (LANES(mask_of)(in_glass)) {
            glass = LANES(draw_glass)(bsdf, cos_half, rest);
            const Mask is_refracted = in_glass & (rest >= glass.choice);
            const LANES(Vectors) bent = LANES(normalized_vectors)(
                LANES(difference_of_vectors)(LANES(scaled_vectors)(h, fma(glass.ratio, cos_half, -glass.cos_there)),
                                             LANES(scaled_vectors)(wo, glass.ratio)));
            const LANES(Vectors) through = LANES(vectors)(mirrored.x, mirrored.y, -mirrored.z);
            const LANES(Vectors) passed = LANES(choose_vectors)(bsdf->is_thin, through, bent);
            sample.wi = LANES(choose_vectors)(is_refracted, passed, sample.wi);
            is_through = is_through | is_refracted;
            sample.is_passed = is_refracted & bsdf->is_thin & bsdf->is_smooth_glass;
        }
    }
    if (LANES(mask_of)(!in_facets)) {
        const LANES(Vectors) around = LANES(sample_cosine)(point);
        sample.wi = LANES(choose_vectors)(in_facets, sample.wi,
                                          LANES(vectors)(around.x, around.y, in_passed ? -around.z : around.z));
        const Mask is_rough = in_diffuse & (bsdf->diffuse_roughness > 0.0f);
        if (LANES(mask_of)(is_rough))
            sample.wi =
                LANES(choose_vectors)(is_rough, LANES(sample_eon)(bsdf->diffuse_roughness, wo, rest, point), sample.wi);
    }

    const Real cos_wi = in_own_coat ? cos_coat : (is_through ? -sample.wi.z : sample.wi.z);
    const Mask is_there = (wo.z >= CASTOR_LEAST_COSINE) & (cos_wi >= CASTOR_LEAST_COSINE);
    const LANES(BsdfValues) found = LANES(evaluate_bsdf)(bsdf, wo, sample.wi);
    const Mask is_found = is_there & (found.pdf > 0.0f) & (found.pdf <= FLT_MAX);
    sample.pdf = is_found ? found.pdf : zero;
    const Real factor = is_found ? LANES(divide)(fabs(sample.wi.z), is_found ? found.pdf : one) : zero;
    sample.weight = LANES(scaled_vectors)(found.value, factor);
    sample.coat = zero;
    if (CASTOR_HAS_OPTICS && LANES(mask_of)(bsdf->has_coat_normal))
        sample.coat = is_found ? LANES(divide)(found.coat, is_found ? found.pdf : one) : zero;

    if (LANES(mask_of)(sample.is_delta)) {
        // The lobe's share of the light that goes this way, divided by the probability.
        const Real coat_term = bsdf->coat_gain * fma((Real)(1.0f - CASTOR_CLEARCOAT_F0), LANES(schlick_weight)(seen.z),
                                                     (Real)(CASTOR_CLEARCOAT_F0));
        const Mask is_refracted = in_glass & is_through;
        const Real reflected_glass = glass.choice > 0.0f ? bsdf->glass_gain : zero;
        const LANES(Vectors) of_glass =
            LANES(choose_vectors)(is_refracted, LANES(product_of_vectors)(bsdf->glass_transmitted, glass.passed),
                                  LANES(scaled_vectors)(glass.reflected, reflected_glass));
        const LANES(Vectors) of_base = LANES(base_terms)(bsdf, wo.z);
        const LANES(Vectors) of_coat = LANES(vectors)(coat_term, coat_term, coat_term);
        const LANES(Vectors) scattered =
            LANES(choose_vectors)(in_glass, of_glass, LANES(choose_vectors)(in_coat, of_coat, of_base));
        const Real passed = in_coat ? one : LANES(below_sheen)(bsdf, is_refracted ? zero : bsdf->sheen_albedo);
        const Real probability = in_glass ? bsdf->glass_probability * (is_refracted ? glass.probability : glass.choice)
                                          : (in_coat ? bsdf->coat_probability : bsdf->base_probability);
        const Mask is_drawn = sample.is_delta & is_there & (probability > 0.0f);
        const Real delta_factor = is_drawn ? LANES(divide)(passed, is_drawn ? probability : one) : zero;
        sample.weight =
            LANES(choose_vectors)(sample.is_delta, LANES(scaled_vectors)(scattered, delta_factor), sample.weight);
        sample.pdf = sample.is_delta ? (is_drawn ? probability : zero) : sample.pdf;
        const Mask is_own_coat = sample.is_delta & in_own_coat;
        sample.coat = is_own_coat ? sample.weight.x : (sample.is_delta ? zero : sample.coat);
        sample.weight = LANES(choose_vectors)(is_own_coat, LANES(vectors)(zero, zero, zero), sample.weight);
    }
    return sample;
}
