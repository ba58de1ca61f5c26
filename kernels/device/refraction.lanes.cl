// Reflection and refraction of rays, for CASTOR_LANES lanes (see lanes.cl).
#include "device/elementary.lanes.cl"
#include "device/frame.lanes.cl"
#include "device/fresnel.lanes.cl"
#include "device/random.lanes.cl"
#include "device/vector.lanes.cl"

// What becomes of light that meets a dielectric.
typedef struct LANES(Refractions) {
    Real reflectance;          // F: the share that is reflected; the rest is refracted
    LANES(Vectors) direction;  // of the refracted ray, unit; means nothing where all is reflected
} LANES(Refractions);

// Refracts by Snell's law, and gives Fresnel's reflectance. `index`: of the dielectric, against that of what is around
// it. `wo`: back along the ray, unit. `cos_wo`: its cosine with `normal`; the ray is inside where it is not positive.
CASTOR_ONCE LANES(Refractions)
    LANES(refract)(const Real index, const LANES(Vectors) normal, const LANES(Vectors) wo, const Real cos_wo)
{
    const Mask enters = cos_wo > 0.0f;
    const Real one = (Real)(1.0f);
    const Real here = enters ? one : index, there = enters ? index : one;
    const Real cos_here = fabs(cos_wo);
    const LANES(Interfaces) interface = LANES(meet_interface)(here, there, cos_here);
    LANES(Refractions) result;
    result.reflectance = interface.reflectance;
    const Real along_normal = fma(interface.ratio, cos_here, -interface.cos_there);
    const LANES(Vectors) bent =
        LANES(difference_of_vectors)(LANES(scaled_vectors)(normal, enters ? along_normal : -along_normal),
                                     LANES(scaled_vectors)(wo, interface.ratio));
    result.direction = LANES(normalized_vectors)(bent);
    return result;
}

// Returns what is left of light after a way inside a dielectric (Beer's law). An infinite way is possible.
CASTOR_INLINE LANES(Vectors) LANES(transmittance)(const LANES(Vectors) absorption, const Real length)
{
    const Real one = (Real)(1.0f);
    return LANES(vectors)(absorption.x > 0.0f ? LANES(exponential)(-absorption.x * length) : one,
                          absorption.y > 0.0f ? LANES(exponential)(-absorption.y * length) : one,
                          absorption.z > 0.0f ? LANES(exponential)(-absorption.z * length) : one);
}

// Returns unit directions d with an offset: normalize(d + roughness (x u + y v)), with (x, y) the points less 1/2 and
// u, v unit and perpendicular to d.
CASTOR_INLINE LANES(Vectors)
    LANES(rough_directions)(const LANES(Vectors) d, const Real roughness, const LANES(Points) point)
{
    const LANES(Frames) frame = LANES(frames)(d);
    const Real x = roughness * (point.x - 0.5f), y = roughness * (point.y - 0.5f);
    const LANES(Vectors) moved = LANES(points_on_rays)(LANES(points_on_rays)(d, x, frame.x), y, frame.y);
    return LANES(choose_vectors)(roughness > 0.0f, LANES(normalized_vectors)(moved), d);
}
