// In which dielectrics rays are, for CASTOR_LANES lanes (see lanes.cl). A ray knows two: the one in which it is, and
// the one around that. One that enters a dielectric within another is in that again when it has left the inner one; of
// dielectrics around these two nothing is kept.
#include "castor/shared/constants.h"
#include "device/simd.lanes.cl"

typedef struct LANES(Media) {
    Whole medium;  // material of the dielectric in which the ray is; CASTOR_INVALID_INDEX: in none
    Whole outer;   // the dielectric around the medium: in which the ray is when it leaves that
} LANES(Media);

CASTOR_INLINE LANES(Media) LANES(choose_media)(const Mask is_a, const LANES(Media) a, const LANES(Media) b)
{
    LANES(Media) media;
    media.medium = is_a ? a.medium : b.medium;
    media.outer = is_a ? a.outer : b.outer;
    return media;
}

// Returns where rays are that stay on the side of a surface on which they met it. `of`: the surface's material.
// `is_inside`: it is a dielectric's, met from within; also if the ray began there, and nothing is known of it.
CASTOR_INLINE LANES(Media) LANES(media_here)(const LANES(Media) media, const Whole of, const Mask is_inside)
{
    const Mask is_unknown = is_inside & (of != media.medium) & (of != media.outer);
    LANES(Media) here;
    here.medium = is_unknown ? of : media.medium;
    here.outer = is_unknown ? (Whole)(CASTOR_INVALID_INDEX) : media.outer;
    return here;
}

// Returns where rays are that pass the surface of a dielectric. One that enters what it is in already, as between
// triangles that overlap by rounding, is in it once.
CASTOR_INLINE LANES(Media) LANES(media_beyond)(const LANES(Media) media, const Whole of, const Mask is_inside)
{
    const Whole none = (Whole)(CASTOR_INVALID_INDEX);
    const Mask is_medium = of == media.medium;
    const Whole left = is_medium ? media.outer : of == media.outer ? media.medium : none;
    LANES(Media) beyond;
    beyond.medium = is_inside ? left : of;
    beyond.outer = is_inside ? none : is_medium ? media.outer : media.medium;
    return beyond;
}
