// The light of lights that no ray meets, at points within solids that scatter light, for CASTOR_LANES lanes (see
// lanes.cl).
#include "device/path_lights.lanes.cl"
#include "device/refraction.lanes.cl"

// Of so many lights each is seen from a point; of more, so many.
#define CASTOR_LIGHTS_SEEN 4u

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

// A point where paths were scattered, from which they see lights.
typedef struct LANES(LightViews) {
    LANES(Vectors) origin;
    LANES(Vectors) direction;   // unit, along which the paths came
    Real g;                     // the anisotropy of scattering
    LANES(Vectors) carried;     // by the paths, from there on
    LANES(Vectors) extinction;  // of the solid
    LANES(Points) drawn;        // x: which lights are seen; y: which one is kept
    LANES(Points) on_area;      // the point of a light that is an area
} LANES(LightViews);

// What paths keep of the lights that they saw.
typedef struct LANES(KeptLights) {
    Mask is_new;  // the light is seen from here; else what follows, but for all_weights, means nothing
    LANES(Vectors) direction;
    Real t_max;
    LANES(Vectors) color;  // for a weight of 1
    Real group;
    Real all_weights;
} LANES(KeptLights);

// Lets paths see lights, where `counts`, and keep one of all that they saw, in proportion to its weight: what would
// arrive, red, green and blue together. `weights_before`: the sum of weights of what they saw before. Of what solids
// leave on the way nothing is counted where rays pass their surfaces.
CASTOR_INLINE LANES(KeptLights)
    LANES(keep_lights)(const global Light *restrict lights, const global uint *restrict light_groups,
                       const PathParams path, const LANES(LightViews) view, const Mask counts,
                       const Real weights_before)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const uint light_count = path.unmet_end - path.first_unmet;
    const uint seen_count = min(light_count, CASTOR_LIGHTS_SEEN);
    const float lights_per_seen = divide((float)light_count, (float)seen_count);
    const LANES(Vectors) carried = LANES(scaled_vectors)(view.carried, (Real)(lights_per_seen));
    LANES(KeptLights) kept;
    kept.is_new = (Whole)(0) != 0u;
    kept.direction = kept.color = LANES(vectors)(zero, zero, zero);
    kept.t_max = kept.group = zero;
    kept.all_weights = weights_before;
    Real choice = view.drawn.y;
    for (uint i = 0; i < seen_count; ++i) {
        const Real among = ((float)i + view.drawn.x) * lights_per_seen;
        const Whole number = path.first_unmet + min(LANES(convert_uint)(among), (Whole)(light_count - 1u));
        const LANES(LightsWithin) light =
            LANES(lights_within)(lights, number, counts, view.origin, view.direction, view.g, view.on_area);
        LANES(Vectors) arriving = LANES(product_of_vectors)(carried, light.irradiance);
#if !CASTOR_HAS_MATCHED_SOLIDS
        arriving = LANES(product_of_vectors)(arriving, LANES(transmittance)(view.extinction, light.distance));
#endif
        const Real weight = arriving.x + arriving.y + arriving.z;
        const Mask has_weight = counts & (weight > 0.0f) & (kept.all_weights + weight <= FLT_MAX);
        kept.all_weights += has_weight ? weight : zero;
        const Real probability = LANES(divide)(has_weight ? weight : zero, has_weight ? kept.all_weights : one);
        const Mask is_better = has_weight & (choice < probability);
        // What is left of the choice is as good as a new one.
        const Real rest = is_better ? choice : choice - probability;
        const Real width = LANES(larger)(is_better ? probability : one - probability, (Real)(1e-7f));
        choice = LANES(smaller)(LANES(divide)(rest, width), (Real)(0x1.fffffep-1f));
        const Real per_weight = LANES(divide)(one, has_weight ? weight : one);
        kept.is_new |= is_better;
        kept.direction = LANES(choose_vectors)(is_better, light.direction, kept.direction);
        kept.t_max = is_better ? light.t_max : kept.t_max;
        kept.color = LANES(choose_vectors)(is_better, LANES(scaled_vectors)(arriving, per_weight), kept.color);
#if CASTOR_HAS_LIGHT_GROUPS
        kept.group = is_better ? LANES(convert_float)(LANES(gather_wholes)(light_groups, number, 1)) : kept.group;
#endif
    }
    return kept;
}
