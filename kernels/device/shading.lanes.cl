// Lights, reflection and the Blinn-Phong model of the course's format, for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/types.h"
#include "device/elementary.lanes.cl"
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
} LANES(Materials);

// Returns materials whose rows are these: a Material has four (types.h asserts its size).
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
    return same;
}

#if CASTOR_LANES > 1
CASTOR_ONCE LANES(Materials) LANES(gather_materials)(const global Material *materials, const Whole number)
{
    const global float4 *rows = (const global float4 *)materials;  // of a Material: see materials_of_rows
    return LANES(materials_of_rows)(LANES(gather_rows)(rows, 4u * number), LANES(gather_rows)(rows, 4u * number + 1u),
                                    LANES(gather_rows)(rows, 4u * number + 2u),
                                    LANES(gather_rows)(rows, 4u * number + 3u));
}
#endif

// Loads the materials with these numbers. Neighbours mostly have the same.
CASTOR_INLINE LANES(Materials) LANES(load_materials)(const global Material *materials, const Whole number)
{
#if CASTOR_LANES == 1
    return same_materials(materials[number]);
#else
    if (!LANES(mask_of)(number != number.s0)) return LANES(same_materials)(materials[number.s0]);
    return LANES(gather_materials)(materials, number);
#endif
}

// The light that arrives at points unless something is in the way.
typedef struct LANES(LightSamples) {
    LANES(Vectors) wi;          // unit, towards the light
    Real distance;              // INFINITY for directional lights
    LANES(Vectors) irradiance;  // on a surface that faces the light
} LANES(LightSamples);

CASTOR_INLINE Real LANES(spot_falloff)(const Light light, const Real cos_angle)
{
    const Real s = LANES(divide)(cos_angle - light.cos_coverage, (Real)(light.cos_falloff - light.cos_coverage));
    const Real between = cos_angle > light.cos_coverage ? (s * s) * (s * s) : (Real)(0.0f);
    return cos_angle >= light.cos_falloff ? (Real)(1.0f) : between;
}

CASTOR_INLINE Real LANES(limited_irradiance)(const Real irradiance)
{
    return clamp(irradiance, (Real)(-CASTOR_LARGEST_IRRADIANCE), (Real)(CASTOR_LARGEST_IRRADIANCE));
}

CASTOR_INLINE LANES(LightSamples) LANES(sample_light)(const Light light, const LANES(Vectors) position)
{
    LANES(LightSamples) sample;
    if (light.kind == CASTOR_LIGHT_DIRECTIONAL) {
        sample.wi = LANES(scaled_vectors)(LANES(same_vectors)(light.direction), (Real)(-1.0f));
        sample.distance = (Real)(INFINITY);
        sample.irradiance = LANES(same_vectors)(light.intensity);
        return sample;
    }
    const LANES(Vectors) to_light = LANES(difference_of_vectors)(LANES(same_vectors)(light.position), position);
    const Real distance_squared = LANES(dot_products)(to_light, to_light);
    sample.wi = LANES(normalized_vectors)(to_light);
    sample.distance = LANES(square_root)(distance_squared);
    // A light on the surface itself, or so near that the square vanishes, has no direction and lights nothing.
    const Mask is_far = distance_squared >= FLT_MIN;
    const Real falloff = is_far ? LANES(divide)((Real)(1.0f), is_far ? distance_squared : (Real)(1.0f)) : (Real)(0.0f);
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

// Divides the parts of a Fresnel term; gives 1, the limit, where both are zero or too large for a float.
CASTOR_INLINE Real LANES(fresnel_term)(const Real numerator, const Real denominator)
{
    const Mask is_usual = (denominator > 0.0f) & (denominator <= FLT_MAX);
    return is_usual ? LANES(divide)(numerator, is_usual ? denominator : (Real)(1.0f)) : (Real)(1.0f);
}

// Computes the unpolarised Fresnel reflectance of a conductor of index n + ik (Born, Wolf, Principles of Optics §14.2,
// for n^2 + k^2 >> 1).
CASTOR_ONCE Real LANES(conductor_reflectance)(const Real n, const Real k, const Real cos_angle)
{
    const Real n2_k2 = fma(n, n, k * k);
    const Real cos2 = cos_angle * cos_angle;
    const Real twice = 2.0f * n * cos_angle;
    const Real perpendicular = LANES(fresnel_term)(n2_k2 - twice + cos2, n2_k2 + twice + cos2);
    const Real parallel =
        LANES(fresnel_term)(fma(n2_k2, cos2, (Real)(1.0f)) - twice, fma(n2_k2, cos2, (Real)(1.0f)) + twice);
    return 0.5f * (perpendicular + parallel);
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
