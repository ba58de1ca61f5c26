// Frames of three perpendicular unit vectors, for CASTOR_LANES lanes (see lanes.cl).
#include "device/elementary.lanes.cl"
#include "device/vector.lanes.cl"

typedef struct LANES(Frames) {
    LANES(Vectors) x, y, z;
} LANES(Frames);

// Returns frames of which z is given, unit (Duff and others 2017, "Building an Orthonormal Basis, Revisited").
CASTOR_INLINE LANES(Frames) LANES(frames)(const LANES(Vectors) z)
{
    const Real sign = z.z < 0.0f ? (Real)(-1.0f) : (Real)(1.0f);
    const Real a = LANES(divide)((Real)(-1.0f), sign + z.z);
    const Real b = z.x * z.y * a;
    LANES(Frames) frame;
    frame.x = LANES(vectors)(fma(sign * z.x * z.x, a, (Real)(1.0f)), sign * b, -sign * z.x);
    frame.y = LANES(vectors)(b, fma(z.y * z.y, a, sign), -z.y);
    frame.z = z;
    return frame;
}

// Returns vectors by their components along the axes of a frame, and back.
CASTOR_INLINE LANES(Vectors) LANES(in_frame)(const LANES(Frames) frame, const LANES(Vectors) v)
{
    return LANES(vectors)(LANES(dot_products)(frame.x, v), LANES(dot_products)(frame.y, v),
                          LANES(dot_products)(frame.z, v));
}

CASTOR_INLINE LANES(Vectors) LANES(out_of_frame)(const LANES(Frames) frame, const LANES(Vectors) v)
{
    return LANES(points_on_rays)(LANES(points_on_rays)(LANES(scaled_vectors)(frame.z, v.z), v.y, frame.y), v.x,
                                 frame.x);
}

// Returns unit directions at an angle from unit axes, of which cosine and sine are given, after a part of a turn around
// them.
CASTOR_ONCE LANES(Vectors)
    LANES(directions_around)(const LANES(Vectors) axis, const Real cos_angle, const Real sin_angle, const Real turn)
{
    const LANES(Frames) frame = LANES(frames)(axis);
    const Real angle = 6.2831855f * turn;
    const LANES(Vectors) aside =
        LANES(points_on_rays)(LANES(scaled_vectors)(frame.y, LANES(sine)(angle)), LANES(cosine)(angle), frame.x);
    return LANES(points_on_rays)(LANES(scaled_vectors)(axis, cos_angle), sin_angle, aside);
}
