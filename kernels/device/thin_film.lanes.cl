// What thin films on surfaces reflect, for CASTOR_LANES lanes (see lanes.cl): Belcour, Barla 2017, "A Practical
// Extension to Microfacet Theory for the Modeling of Varying Iridescence", as KHR_materials_iridescence states it.
// Fresnel's terms of both sides of the film are Schlick's. Light that goes to and fro in it once and twice interferes;
// how the eye sees that is the transform of its sensitivity, a sum of Gaussians, in linear sRGB.
#include "device/elementary.lanes.cl"
#include "device/fresnel.lanes.cl"
#include "device/vector.lanes.cl"

// Films in air.
typedef struct LANES(Films) {
    Real share;      // of the surface that has one
    Real index;      // of refraction, at least 1
    Real thickness;  // nanometres
} LANES(Films);

// What films do with light that comes at an angle, whatever is below them.
typedef struct LANES(FilmLights) {
    Real index;
    Real reflected;  // at the film's outer side
    Real weight;     // Schlick's, of the angle within the film
    LANES(Vectors)
    once, twice;  // red, green and blue of light that went to and fro so often, if nothing shifts its phase
} LANES(FilmLights);

CASTOR_INLINE Real LANES(square)(const Real x) { return x * x; }

// Red, green and blue of X, Y, Z.
CASTOR_INLINE LANES(Vectors) LANES(rgb_of_xyz)(const Real x, const Real y, const Real z)
{
    return LANES(vectors)(fma((Real)(3.2404542f), x, fma((Real)(-1.5371385f), y, -0.4985314f * z)),
                          fma((Real)(-0.969266f), x, fma((Real)(1.8760108f), y, 0.041556f * z)),
                          fma((Real)(0.0556434f), x, fma((Real)(-0.2040259f), y, 1.0572252f * z)));
}

// Returns e^(-variance phase^2).
CASTOR_INLINE Real LANES(coherence)(const Real variance, const Real phase)
{
    return LANES(exponential)(-variance * phase * phase);
}

// `outside`: the cosine of the angle of the light there.
CASTOR_ONCE LANES(FilmLights) LANES(meet_films)(const LANES(Films) film, const Real outside)
{
    const Real one = (Real)(1.0f);
    LANES(FilmLights) light;
    // A film of no thickness is air.
    const Real grown = LANES(smaller)(film.thickness * (1.0f / 0.03f), one);
    light.index = fma(film.index - 1.0f, grown * grown * fma((Real)(-2.0f), grown, (Real)(3.0f)), one);
    const Real sine_squared = LANES(divide)(fma(-outside, outside, one), light.index * light.index);
    const Real within = LANES(square_root)(LANES(larger)(1.0f - sine_squared, (Real)(0.0f)));
    const Real ratio = LANES(divide)(light.index - 1.0f, light.index + 1.0f), f0 = ratio * ratio;
    light.reflected = fma(1.0f - f0, LANES(schlick_weight)(outside), f0);
    light.weight = LANES(schlick_weight)(within);

    // Beyond the limit nothing is left of interference.
    const Real way = LANES(smaller)(2.0f * light.index * film.thickness * within, (Real)(16000.0f));  // nanometres
    const Real phase = 6.2831855e-9f * way;
    const Real decay_x = LANES(coherence)((Real)(4.3278e9f), phase),
               decay_y = LANES(coherence)((Real)(9.3046e9f), phase),
               decay_z = LANES(coherence)((Real)(6.6121e9f), phase),
               decay_u = LANES(coherence)((Real)(4.5282e9f), phase);
    const Real wave_x = LANES(cosine)(1.681e6f * phase), wave_y = LANES(cosine)(1.7953e6f * phase),
               wave_z = LANES(cosine)(2.2084e6f * phase), wave_u = LANES(cosine)(2.2399e6f * phase);
    // Values times widths of the Gaussians, of white: X has two.
    const Real x = 0.84659004f, y = 1.0002219f, z = 1.0011225f, u = 0.15386831f;
    light.once =
        LANES(rgb_of_xyz)(fma(x * decay_x, wave_x, u * decay_u * wave_u), y * decay_y * wave_y, z * decay_z * wave_z);
    // cos 2a = 2 cos^2 a - 1, e^(-4b) = (e^-b)^4
    const Real far_x = LANES(square)(LANES(square)(decay_x)), far_y = LANES(square)(LANES(square)(decay_y)),
               far_z = LANES(square)(LANES(square)(decay_z)), far_u = LANES(square)(LANES(square)(decay_u));
    light.twice = LANES(rgb_of_xyz)(
        fma(x * far_x, fma(2.0f * wave_x, wave_x, -one), u * far_u * fma(2.0f * wave_u, wave_u, -one)),
        y * far_y * fma(2.0f * wave_y, wave_y, -one), z * far_z * fma(2.0f * wave_z, wave_z, -one));
    return light;
}

// Returns one channel, in [0, 1]. `f0`: what the surface below the film would reflect head-on in air.
CASTOR_INLINE Real LANES(film_channel)(const LANES(FilmLights) light, const Real once, const Real twice, const Real f0)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real root = LANES(square_root)(clamp(f0, zero, (Real)(0.9999f)));
    const Real below = LANES(divide)(one + root, one - root);  // the index of refraction
    const Real ratio = LANES(divide)(below - light.index, below + light.index);
    const Real r1 = ratio * ratio, inner = fma(1.0f - r1, light.weight, r1);
    const Real both = clamp(light.reflected * inner, (Real)(1e-5f), (Real)(0.9999f));
    const Real passed = 1.0f - light.reflected;
    const Real returned = LANES(divide)(passed * passed * inner, 1.0f - both);
    // At the outer side the phase shifts by half a turn; at the inner one too where what is below has the smaller
    // index.
    const Real in_phase = below < light.index ? once : -once;
    const Real waves = 2.0f * fma(LANES(square_root)(both), in_phase, both * twice);
    return clamp(fma(returned - passed, waves, light.reflected + returned), zero, one);
}

// Returns what surfaces with films reflect.
CASTOR_ONCE LANES(Vectors) LANES(film_terms)(const LANES(FilmLights) light, const LANES(Vectors) f0)
{
    return LANES(vectors)(LANES(film_channel)(light, light.once.x, light.twice.x, f0.x),
                          LANES(film_channel)(light, light.once.y, light.twice.y, f0.y),
                          LANES(film_channel)(light, light.once.z, light.twice.z, f0.z));
}
