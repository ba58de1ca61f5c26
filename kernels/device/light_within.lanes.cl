// The light of lights that no ray meets, at points within solids that scatter light, for CASTOR_LANES lanes (see
// lanes.cl).
#include "device/path_lights.lanes.cl"

// A light seen from a point: the ray to it, and what arrives of it unless something is in the way.
typedef struct LANES(LightsWithin) {
    LANES(Vectors) direction;
    Real t_max, distance;
    LANES(Vectors) irradiance;
} LANES(LightsWithin);

// Returns the phase function of Henyey and Greenstein (1941): the density, by solid angle, of directions to which light
// is turned by an angle with this cosine.
CASTOR_INLINE Real LANES(phase_function)(const Real g, const Real cosine)
{
    const Real one = (Real)(1.0f);
    const Real nearest = one - fabs(g);
    const Real base = LANES(larger)(fma(g, g, one) - 2.0f * g * cosine, nearest * nearest);  // whatever is rounded
    return LANES(divide)(0.07957747f * fma(-g, g, one), base * LANES(square_root)(base));    // 1 / (4 pi)
}

// Returns what lights with these numbers send to points, where `counts`, with what scattering there leaves of it for a
// path that came along `direction`, unit. Nothing of lights that rays can meet. `at`: which point of an area.
CASTOR_INLINE LANES(LightsWithin)
    LANES(lights_within)(const global Light *restrict lights, const Whole number, const Mask counts,
                         const LANES(Vectors) origin, const LANES(Vectors) direction, const Real g,
                         const LANES(Points) at)
{
    LANES(LightSamples) sample = LANES(no_light_samples)();
    uint numbers[CASTOR_LANES];
    LANES(store_wholes)(number, numbers);
    for (uint left = LANES(mask_of)(counts); left;) {
        const uint next = numbers[lowest_bit(left)];
        const Mask is_next = number == next;
        const uint kind = lights[next].kind;
        if (kind < CASTOR_LIGHT_AREA && !CASTOR_IS_SUN(lights[next]))
            sample = LANES(choose_light_samples)(is_next, LANES(sample_light)(lights[next], origin), sample);
        if (kind == CASTOR_LIGHT_AREA)
            sample = LANES(choose_light_samples)(is_next, LANES(sample_area)(lights[next], origin, at), sample);
        left &= ~LANES(mask_of)(is_next);
    }
    const Mask is_far = sample.distance > FLT_MAX;
    const Real phase = LANES(phase_function)(g, LANES(dot_products)(direction, sample.wi));
    LANES(LightsWithin) light;
    light.direction = LANES(choose_vectors)(is_far, sample.wi, LANES(difference_of_vectors)(sample.point, origin));
    light.t_max = is_far ? (Real)(INFINITY) : (Real)(CASTOR_LIGHT_TMAX);
    light.distance = is_far ? (Real)(0.0f) : sample.distance;  // in the solid, if the light is
    light.irradiance = LANES(scaled_vectors)(sample.irradiance, counts ? phase : (Real)(0.0f));
    return light;
}
