// Fresnel's reflectances of unpolarised light, for CASTOR_LANES lanes (see lanes.cl).
#include "device/simd.lanes.cl"

#define CASTOR_INVERSE_PI 0.31830987f

// Returns half the square of (a - b) / (a + b); 1/2, the limit, where a + b vanishes or is too large.
CASTOR_INLINE Real LANES(half_of_polarised)(const Real a, const Real b)
{
    const Real sum = a + b;
    const Mask is_usual = (sum > 0.0f) & (sum <= FLT_MAX);
    const Real ratio = is_usual ? LANES(divide)(a - b, is_usual ? sum : (Real)(1.0f)) : (Real)(1.0f);
    return 0.5f * ratio * ratio;
}

// Where light meets a plane between two dielectrics.
typedef struct LANES(Interfaces) {
    Real reflectance;  // F: the share that is reflected; the rest is refracted
    Real ratio;        // of the indices, here / there
    Real cos_there;    // of the refracted direction; 0 where all is reflected
} LANES(Interfaces);

// Applies Snell's law and Fresnel's equations (Born, Wolf, Principles of Optics §1.5). `here`, `there`: the indices.
CASTOR_INLINE LANES(Interfaces) LANES(meet_interface)(const Real here, const Real there, const Real cos_here)
{
    const Real one = (Real)(1.0f);
    const Mask is_index = (there > 0.0f) & (there <= FLT_MAX);
    const Real ratio = is_index ? LANES(divide)(here, is_index ? there : one) : (Real)(INFINITY);
    const Real sin_here_squared = fma(-cos_here, cos_here, one);
    const Real sin_there_squared = ratio * ratio * (sin_here_squared > 0.0f ? sin_here_squared : (Real)(0.0f));
    const Mask passes = sin_there_squared < 1.0f;
    LANES(Interfaces) interface;
    interface.ratio = ratio;
    interface.cos_there = LANES(square_root)(passes ? 1.0f - sin_there_squared : (Real)(0.0f));
    interface.reflectance = passes ? LANES(half_of_polarised)(there * cos_here, here * interface.cos_there) +
                                         LANES(half_of_polarised)(here * cos_here, there * interface.cos_there)
                                   : one;
    return interface;
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

// Returns Schlick's weight (1 - cos)^5 (1994, "An Inexpensive BRDF Model for Physically-based Rendering"): what is
// reflected is f0 + (f90 - f0) * weight.
CASTOR_INLINE Real LANES(schlick_weight)(const Real cos_angle)
{
    const Real rest = LANES(larger)(1.0f - cos_angle, (Real)(0.0f));
    return (rest * rest) * (rest * rest) * rest;
}
