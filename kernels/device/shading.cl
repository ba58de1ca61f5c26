// Lights, reflection and the Blinn-Phong model of the course's format.
#include "castor/shared/types.h"
#include "device/elementary.cl"
#include "device/vector.cl"

CASTOR_INLINE float3 to_float3(const float *const a) { return (float3)(a[0], a[1], a[2]); }

// The largest irradiance: more than any picture needs, and small enough that a product with reflectances stays finite,
// since infinity times a black reflectance would be NaN.
#define CASTOR_LARGEST_IRRADIANCE 1e30f

// The light that arrives at a point unless something is in the way.
typedef struct LightSample {
    float3 wi;          // unit, towards the light
    float distance;     // INFINITY for directional lights
    float3 irradiance;  // on a surface that faces the light
} LightSample;

CASTOR_INLINE float spot_falloff(const Light light, const float cos_angle)
{
    if (cos_angle >= light.cos_falloff) return 1.0f;
    if (!(cos_angle > light.cos_coverage)) return 0.0f;
    const float s = divide(cos_angle - light.cos_coverage, light.cos_falloff - light.cos_coverage);
    return (s * s) * (s * s);
}

CASTOR_INLINE LightSample sample_light(const Light light, const float3 position)
{
    LightSample sample;
    if (light.kind == CASTOR_LIGHT_DIRECTIONAL) {
        sample.wi = -to_float3(light.direction);
        sample.distance = INFINITY;
        sample.irradiance = to_float3(light.intensity);
        return sample;
    }
    const float3 to_light = to_float3(light.position) - position;
    const float distance_squared = dot_product(to_light, to_light);
    sample.wi = normalized(to_light);
    sample.distance = square_root(distance_squared);
    // A light on the surface itself, or so near that the square vanishes, has no direction and lights nothing.
    const float falloff = distance_squared >= FLT_MIN ? divide(1.0f, distance_squared) : 0.0f;
    sample.irradiance =
        clamp(to_float3(light.intensity) * falloff, -CASTOR_LARGEST_IRRADIANCE, CASTOR_LARGEST_IRRADIANCE);
    if (light.kind == CASTOR_LIGHT_SPOT)
        sample.irradiance *= spot_falloff(light, -dot_product(sample.wi, to_float3(light.direction)));
    return sample;
}

// Computes what a surface reflects towards wo from one light: kd E n.l + ks E (n.h)^p. The highlight is not multiplied
// by n.l.
CASTOR_INLINE float3 blinn_phong(const Material material, const uint rules, const float3 normal, const float3 wo,
                                 const LightSample light)
{
    const float cos_light = dot_product(normal, light.wi);
    const int is_lit = cos_light > 0.0f;
    if (!is_lit && !(rules & CASTOR_RULE_HIGHLIGHT_BEHIND)) return (float3)(0.0f);
    const float3 half_vector = normalized(light.wi + wo);
    const float cos_half = dot_product(normal, half_vector);
    const float highlight = cos_half > 0.0f ? power(cos_half, material.phong_exponent) : 0.0f;
    float3 reflected = to_float3(material.specular) * highlight;
    if (is_lit) reflected += to_float3(material.diffuse) * cos_light;
    return reflected * light.irradiance;
}

// Divides the parts of a Fresnel term; gives 1, the limit, where both are zero or too large for a float.
CASTOR_INLINE float fresnel_term(const float numerator, const float denominator)
{
    return denominator > 0.0f && denominator <= FLT_MAX ? divide(numerator, denominator) : 1.0f;
}

// Computes the unpolarised Fresnel reflectance of a conductor of index n + ik (Born, Wolf, Principles of Optics §14.2,
// for n^2 + k^2 >> 1).
CASTOR_INLINE float conductor_reflectance(const float n, const float k, const float cos_angle)
{
    const float n2_k2 = fma(n, n, k * k);
    const float cos2 = cos_angle * cos_angle;
    const float twice = 2.0f * n * cos_angle;
    const float perpendicular = fresnel_term(n2_k2 - twice + cos2, n2_k2 + twice + cos2);
    const float parallel = fresnel_term(fma(n2_k2, cos2, 1.0f) - twice, fma(n2_k2, cos2, 1.0f) + twice);
    return 0.5f * (perpendicular + parallel);
}

// Returns the factor by which a surface multiplies what a mirror ray brings; (0,0,0) where it does not reflect.
CASTOR_INLINE float3 mirror_factor(const Material material, const uint rules, const float cos_wo)
{
    const float3 mirror = to_float3(material.mirror);
    if (rules & CASTOR_RULE_MIRROR_ANY_MATERIAL) return mirror;
    if (material.kind == CASTOR_MATERIAL_MIRROR) return mirror;
    if (material.kind == CASTOR_MATERIAL_CONDUCTOR && (rules & CASTOR_RULE_MIRROR_CONDUCTOR))
        return mirror * conductor_reflectance(material.refraction_index, material.absorption_index, fabs(cos_wo));
    return (float3)(0.0f);
}
