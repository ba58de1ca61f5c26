// Lights, reflection and the Blinn-Phong model of the course's format, for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/types.h"
#include "device/elementary.lanes.cl"
#include "device/features.cl"
#include "device/fresnel.lanes.cl"
#include "device/vector.lanes.cl"

// The largest irradiance: more than any picture needs, and small enough that a product with reflectances stays finite,
// since infinity times a black reflectance would be NaN.
#define CASTOR_LARGEST_IRRADIANCE 1e30f

// The materials of surfaces: see Material.
typedef struct LANES(Materials) {
    LANES(Vectors) ambient;
    Real phong_exponent;
    LANES(Vectors) diffuse;
    Real refraction_index;
    LANES(Vectors) specular;
    Real absorption_index;
    LANES(Vectors) mirror;
    Whole kind;
#if CASTOR_HAS_DIELECTRICS || CASTOR_HAS_ROUGHNESS
    LANES(Vectors) absorption;
    Real roughness;
#endif
#if CASTOR_HAS_BRDFS
    Whole brdf;
#endif
} LANES(Materials);

// The rows of a Material (types.h asserts its size). Those of every scene are the first four.
#define CASTOR_MATERIAL_ROWS 8u

CASTOR_INLINE LANES(Materials) LANES(materials_of_rows)(const LANES(Rows) first, const LANES(Rows) second,
                                                        const LANES(Rows) third, const LANES(Rows) fourth)
{
    LANES(Materials) material;
    material.ambient = LANES(vectors_of_rows)(first);
    material.phong_exponent = first.w;
    material.diffuse = LANES(vectors_of_rows)(second);
    material.refraction_index = second.w;
    material.specular = LANES(vectors_of_rows)(third);
    material.absorption_index = third.w;
    material.mirror = LANES(vectors_of_rows)(fourth);
    material.kind = LANES(as_uint)(fourth.w);
    return material;
}

// Returns one material, in every lane.
CASTOR_INLINE LANES(Materials) LANES(same_materials)(const Material material)
{
    LANES(Materials) same;
    same.ambient = LANES(same_vectors)(material.ambient);
    same.phong_exponent = (Real)(material.phong_exponent);
    same.diffuse = LANES(same_vectors)(material.diffuse);
    same.refraction_index = (Real)(material.refraction_index);
    same.specular = LANES(same_vectors)(material.specular);
    same.absorption_index = (Real)(material.absorption_index);
    same.mirror = LANES(same_vectors)(material.mirror);
    same.kind = (Whole)(material.kind);
#if CASTOR_HAS_DIELECTRICS || CASTOR_HAS_ROUGHNESS
    same.absorption = LANES(same_vectors)(material.absorption);
    same.roughness = (Real)(material.roughness);
#endif
#if CASTOR_HAS_BRDFS
    same.brdf = (Whole)(material.brdf);
#endif
    return same;
}

#if CASTOR_LANES > 1
CASTOR_ONCE LANES(Materials) LANES(gather_materials)(const global Material *materials, const Whole number)
{
    const global float4 *rows = (const global float4 *)materials;  // of a Material: see materials_of_rows
    const Whole first = CASTOR_MATERIAL_ROWS * number;
    LANES(Materials)
    material = LANES(materials_of_rows)(LANES(gather_rows)(rows, first), LANES(gather_rows)(rows, first + 1u),
                                        LANES(gather_rows)(rows, first + 2u), LANES(gather_rows)(rows, first + 3u));
#if CASTOR_HAS_DIELECTRICS || CASTOR_HAS_ROUGHNESS
    const LANES(Rows) fifth = LANES(gather_rows)(rows, first + 4u);
    material.absorption = LANES(vectors_of_rows)(fifth);
    material.roughness = fifth.w;
#endif
#if CASTOR_HAS_BRDFS
    material.brdf = LANES(as_uint)(LANES(gather_rows)(rows, first + 5u).w);
#endif
    return material;
}
#endif

// Loads the materials with these numbers. Neighbours mostly have the same.
CASTOR_INLINE LANES(Materials) LANES(load_materials)(const global Material *materials, const Whole number)
{
#if CASTOR_LANES == 1
    return same_materials(materials[number]);
#else
    if (LANES(are_same)(number)) return LANES(same_materials)(materials[LANES(first_lane)(number)]);
    return LANES(gather_materials)(materials, number);
#endif
}

#if CASTOR_HAS_TEXTURES
// Tells which surfaces send surface_diffuse itself. `surface_diffuse`: at the first lane's place.
CASTOR_INLINE Mask LANES(sends_texel)(const global float4 *surface_diffuse)
{
    return LANES(load_rows)(surface_diffuse).w != 0.0f;
}

// Returns the materials with the reflectances that textures gave them at these places; where surfaces send a texel
// itself, without those that it takes the place of.
CASTOR_INLINE LANES(Materials)
    LANES(textured_materials)(LANES(Materials) material, const uint rules, const global float4 *surface_diffuse,
                              const global float4 *surface_specular)
{
    material.diffuse = LANES(load_vectors)(surface_diffuse);
#if CASTOR_HAS_OTHER_TEXTURES
    const Real zero = (Real)(0.0f);
    const LANES(Vectors) black = LANES(vectors)(zero, zero, zero);
    const Mask is_black = LANES(sends_texel)(surface_diffuse);
    material.diffuse = LANES(choose_vectors)(is_black, black, material.diffuse);
    material.specular = LANES(load_vectors)(surface_specular);
    if (rules & CASTOR_RULE_TEXEL_IS_DIFFUSE_TERM) return material;
    material.ambient = LANES(choose_vectors)(is_black, black, material.ambient);
    material.specular = LANES(choose_vectors)(is_black, black, material.specular);
    material.mirror = LANES(choose_vectors)(is_black, black, material.mirror);
    material.kind = is_black ? (Whole)(CASTOR_MATERIAL_PLAIN) : material.kind;
#endif
    return material;
}
#endif

// Loads what the materials with these numbers emit.
CASTOR_INLINE LANES(Vectors) LANES(load_emissions)(const global Material *materials, const Whole number)
{
    return LANES(gather_vectors)((const global float4 *)materials, CASTOR_MATERIAL_ROWS * number + 5u);
}

#if CASTOR_TRACES_PATHS
// Words of a Material (types.h asserts its size): `light` and `principled`.
#define CASTOR_MATERIAL_WORDS (4u * CASTOR_MATERIAL_ROWS)
#define CASTOR_WORD_OF_LIGHT 26u
#define CASTOR_WORD_OF_PRINCIPLED 28u
#define CASTOR_ROW_OF_SCATTERING 7u  // `principled` and `scattering_albedo`

CASTOR_INLINE Whole LANES(lights_of_materials)(const global Material *materials, const Whole number)
{
    return LANES(gather_wholes)((const global uint *)materials + CASTOR_WORD_OF_LIGHT, number, CASTOR_MATERIAL_WORDS);
}

CASTOR_INLINE Whole LANES(principled_numbers)(const global Material *materials, const Whole number)
{
    return LANES(gather_wholes)((const global uint *)materials + CASTOR_WORD_OF_PRINCIPLED, number,
                                CASTOR_MATERIAL_WORDS);
}

// Returns of what solids of these materials take from light the share that goes on in another direction.
CASTOR_INLINE LANES(Vectors) LANES(load_scattering_albedos)(const global Material *materials, const Whole number)
{
    const LANES(Rows) row =
        LANES(gather_rows)((const global float4 *)materials, CASTOR_MATERIAL_ROWS * number + CASTOR_ROW_OF_SCATTERING);
    return LANES(vectors)(row.y, row.z, row.w);
}

CASTOR_INLINE Mask LANES(scatter_light)(const global Material *materials, const Whole number)
{
    const LANES(Vectors) albedo = LANES(load_scattering_albedos)(materials, number);
    return (albedo.x > 0.0f) | (albedo.y > 0.0f) | (albedo.z > 0.0f);
}
#endif

// The light that arrives at points unless something is in the way.
typedef struct LANES(LightSamples) {
    LANES(Vectors) wi;          // unit, towards the light
    Real distance;              // INFINITY for directional lights
    LANES(Vectors) irradiance;  // on a surface that faces the light
    LANES(Vectors) point;       // of the light; means nothing for directional lights
#if CASTOR_TRACES_PATHS
    Real density;  // with which wi was drawn, by solid angle; 0 where no ray can meet the light
#if CASTOR_HAS_ATTRIBUTES
    Real u, v;            // of a mesh with a texture of emission: the point's coordinates in that
    Real uvs_per_length;  // as TexturePlaces has it (principled_surface.lanes.cl)
#endif
#endif
} LANES(LightSamples);

CASTOR_INLINE Real LANES(spot_falloff)(const Light light, const Real cos_angle)
{
    const Real s = LANES(divide)(cos_angle - light.cos_coverage, (Real)(light.cos_falloff - light.cos_coverage));
    const Real square = s * s;
    const Real power = light.mapping == CASTOR_SPOT_SQUARE ? square : square * square;
    const Real between = cos_angle > light.cos_coverage ? power : (Real)(0.0f);
    return cos_angle >= light.cos_falloff ? (Real)(1.0f) : between;
}

CASTOR_INLINE Real LANES(limited_irradiance)(const Real irradiance)
{
    return clamp(irradiance, (Real)(-CASTOR_LARGEST_IRRADIANCE), (Real)(CASTOR_LARGEST_IRRADIANCE));
}

CASTOR_INLINE LANES(LightSamples) LANES(sample_light)(const Light light, const LANES(Vectors) position)
{
    LANES(LightSamples) sample;
#if CASTOR_TRACES_PATHS
    sample.density = (Real)(0.0f);
#endif
    sample.point = LANES(same_vectors)(light.position);
    if (light.kind == CASTOR_LIGHT_DIRECTIONAL) {
        sample.wi = LANES(scaled_vectors)(LANES(same_vectors)(light.direction), (Real)(-1.0f));
        sample.distance = (Real)(INFINITY);
        sample.irradiance = LANES(same_vectors)(light.intensity);
        return sample;
    }
    const LANES(Vectors) to_light = LANES(difference_of_vectors)(sample.point, position);
    const Real distance_squared = LANES(dot_products)(to_light, to_light);
    sample.wi = LANES(normalized_vectors)(to_light);
    sample.distance = LANES(square_root)(distance_squared);
    // A light on the surface itself, or so near that the square vanishes, has no direction and lights nothing.
    const Mask is_far = distance_squared >= FLT_MIN;
    Real falloff = is_far ? LANES(divide)((Real)(1.0f), is_far ? distance_squared : (Real)(1.0f)) : (Real)(0.0f);
#if CASTOR_HAS_LIGHT_RANGES
    const Real share = sample.distance * light.size;  // of the range
    const Real squared = share * share;
    falloff *= share < 1.0f ? fma(-squared, squared, (Real)(1.0f)) : (Real)(0.0f);
#endif
    sample.irradiance = LANES(vectors)(LANES(limited_irradiance)(light.intensity[0] * falloff),
                                       LANES(limited_irradiance)(light.intensity[1] * falloff),
                                       LANES(limited_irradiance)(light.intensity[2] * falloff));
    if (light.kind == CASTOR_LIGHT_SPOT)
        sample.irradiance = LANES(scaled_vectors)(
            sample.irradiance,
            LANES(spot_falloff)(light, -LANES(dot_products)(sample.wi, LANES(same_vectors)(light.direction))));
    return sample;
}

// Computes what surfaces reflect towards wo from one light: kd E n.l + ks E (n.h)^p. The highlight is not multiplied
// by n.l.
CASTOR_INLINE LANES(Vectors)
    LANES(blinn_phong)(const LANES(Materials) material, const uint rules, const LANES(Vectors) normal,
                       const LANES(Vectors) wo, const LANES(LightSamples) light)
{
    const Real zero = (Real)(0.0f);
    const LANES(Vectors) nothing = LANES(vectors)(zero, zero, zero);
    const Real cos_light = LANES(dot_products)(normal, light.wi);
    const Mask is_lit = cos_light > 0.0f;
    const Mask all = zero == zero;
    const Mask counts = rules & CASTOR_RULE_HIGHLIGHT_BEHIND ? all : is_lit;
    if (!LANES(mask_of)(counts)) return nothing;
    // A black specular colour reflects no highlight, whatever its power is.
    const LANES(Vectors) ks = material.specular;
    const Mask is_shiny = counts & ((ks.x != 0.0f) | (ks.y != 0.0f) | (ks.z != 0.0f));
    Real highlight = zero;
    if (LANES(mask_of)(is_shiny)) {
        const LANES(Vectors) half_vector = LANES(normalized_vectors)(LANES(sum_of_vectors)(light.wi, wo));
        const Real cos_half = LANES(dot_products)(normal, half_vector);
        const Mask is_seen = is_shiny & (cos_half > 0.0f);
        highlight = is_seen ? LANES(power)(cos_half, material.phong_exponent) : zero;
    }
    const LANES(Vectors) shiny = LANES(scaled_vectors)(ks, highlight);
    const LANES(Vectors) matt = LANES(scaled_vectors)(material.diffuse, cos_light);
    const LANES(Vectors) reflected = LANES(choose_vectors)(is_lit, LANES(sum_of_vectors)(shiny, matt), shiny);
    return LANES(choose_vectors)(counts, LANES(product_of_vectors)(reflected, light.irradiance), nothing);
}

// Tells where surfaces shade what they send themselves: a dielectric, only outside.
CASTOR_INLINE Mask LANES(is_on_shaded_side)(const LANES(Materials) material, const LANES(Vectors) normal,
                                            const LANES(Vectors) wo)
{
    return (material.kind != CASTOR_MATERIAL_DIELECTRIC) | (LANES(dot_products)(normal, wo) > 0.0f);
}

#if CASTOR_HAS_BRDFS
// Computes the microfacet term of Torrance and Sparrow 1967, "Theory for Off-Specular Reflection From Roughened
// Surfaces", times the cosine of the light: D F G / (4 n.wo). `lobe`: (n.h)^p. `fresnel`: F.
CASTOR_INLINE Real LANES(microfacets)(const Real lobe, const Real exponent, const Real fresnel, const Real cos_light,
                                      const Real cos_wo, const Real cos_half, const Real wo_half)
{
    const Mask is_seen = (cos_wo > 0.0f) & (wo_half > 0.0f);
    const Real distribution = (exponent + 2.0f) * (0.5f * CASTOR_INVERSE_PI) * lobe;
    const Real twice = LANES(divide)(2.0f * cos_half, is_seen ? wo_half : (Real)(1.0f));
    const Real shadowed = LANES(smaller)((Real)(1.0f), twice * LANES(smaller)(cos_wo, cos_light));
    const Real share = LANES(divide)(shadowed, is_seen ? 4.0f * cos_wo : (Real)(1.0f));
    return is_seen ? distribution * fresnel * share : (Real)(0.0f);
}

// Computes Schlick's approximation of the Fresnel term (1994) for index n + ik.
CASTOR_INLINE Real LANES(schlick)(const Real n, const Real k, const Real cos_angle)
{
    const Real k2 = k * k;
    const Real at_normal = LANES(fresnel_term)(fma(n - 1.0f, n - 1.0f, k2), fma(n + 1.0f, n + 1.0f, k2));
    const Real rest = 1.0f - cos_angle;
    return fma(1.0f - at_normal, (rest * rest) * (rest * rest) * rest, at_normal);
}

// Computes what surfaces reflect towards wo from one light, by the other models of BrdfModel (scene.h).
CASTOR_ONCE LANES(Vectors) LANES(other_brdfs)(const LANES(Materials) material, const LANES(Vectors) normal,
                                              const LANES(Vectors) wo, const LANES(LightSamples) light)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Whole model = material.brdf & CASTOR_BRDF_MODEL_MASK;
    const Mask is_phong = (model == CASTOR_BRDF_PHONG) | (model == CASTOR_BRDF_MODIFIED_PHONG);
    const Mask is_microfacets = model == CASTOR_BRDF_TORRANCE_SPARROW;
    const Mask is_normalized = (material.brdf & CASTOR_BRDF_NORMALIZED) != 0u;
    const Real p = material.phong_exponent;
    const Real cos_light = LANES(dot_products)(normal, light.wi), cos_wo = LANES(dot_products)(normal, wo);
    const LANES(Vectors) half_vector = LANES(normalized_vectors)(LANES(sum_of_vectors)(light.wi, wo));
    const Real cos_half = LANES(dot_products)(normal, half_vector);
    const LANES(Vectors) mirrored =
        LANES(difference_of_vectors)(LANES(scaled_vectors)(normal, 2.0f * cos_light), light.wi);
    const Real cos_lobe = is_phong ? LANES(dot_products)(mirrored, wo) : cos_half;
    const Real lobe = cos_lobe > 0.0f ? LANES(power)(cos_lobe > 0.0f ? cos_lobe : one, p) : zero;
    const Real wo_half = LANES(dot_products)(wo, half_vector);
    const Real fresnel = LANES(schlick)(material.refraction_index, material.absorption_index, wo_half);
    const Real norm = is_phong ? (p + 2.0f) * (0.5f * CASTOR_INVERSE_PI) : (p + 8.0f) * (0.125f * CASTOR_INVERSE_PI);
    const Real cosine = (model == CASTOR_BRDF_PHONG) ? one : cos_light;
    const Real glossy = LANES(microfacets)(lobe, p, fresnel, cos_light, cos_wo, cos_half, wo_half);
    const Real specular = is_microfacets ? glossy : lobe * cosine * (is_normalized ? norm : one);
    const Real passed = (material.brdf & CASTOR_BRDF_DIFFUSE_FRESNEL) != 0u ? 1.0f - fresnel : one;
    const Real diffuse =
        cos_light * (is_microfacets ? passed * CASTOR_INVERSE_PI : (is_normalized ? (Real)(CASTOR_INVERSE_PI) : one));
    const Mask is_lit = cos_light > 0.0f;
    const LANES(Vectors) reflected = LANES(sum_of_vectors)(LANES(scaled_vectors)(material.specular, specular),
                                                           LANES(scaled_vectors)(material.diffuse, diffuse));
    return LANES(choose_vectors)(is_lit, LANES(product_of_vectors)(reflected, light.irradiance),
                                 LANES(vectors)(zero, zero, zero));
}
#endif

// Computes what surfaces reflect towards wo from one light, by their material's model.
CASTOR_INLINE LANES(Vectors)
    LANES(reflected_light)(const LANES(Materials) material, const uint rules, const LANES(Vectors) normal,
                           const LANES(Vectors) wo, const LANES(LightSamples) light)
{
    LANES(Vectors) reflected = LANES(blinn_phong)(material, rules, normal, wo, light);
#if CASTOR_HAS_BRDFS
    const Mask is_other = (material.brdf & CASTOR_BRDF_MODEL_MASK) != CASTOR_BRDF_BLINN_PHONG;
    if (LANES(mask_of)(is_other))
        reflected = LANES(choose_vectors)(is_other, LANES(other_brdfs)(material, normal, wo, light), reflected);
#endif
    return reflected;
}

// Returns the factor by which surfaces multiply what a mirror ray brings; (0,0,0) where they do not reflect.
CASTOR_INLINE LANES(Vectors) LANES(mirror_factor)(const LANES(Materials) material, const uint rules, const Real cos_wo)
{
    if (rules & CASTOR_RULE_MIRROR_ANY_MATERIAL) return material.mirror;
    const Mask is_mirror = material.kind == CASTOR_MATERIAL_MIRROR;
    const Mask is_conductor = material.kind == CASTOR_MATERIAL_CONDUCTOR;
    Real factor = is_mirror ? (Real)(1.0f) : (Real)(0.0f);
    if ((rules & CASTOR_RULE_MIRROR_CONDUCTOR) && LANES(mask_of)(is_conductor))
        factor = is_conductor
                     ? LANES(conductor_reflectance)(material.refraction_index, material.absorption_index, fabs(cos_wo))
                     : factor;
    return LANES(scaled_vectors)(material.mirror, factor);
}
