// Which pixel and sample a slot of a wave belongs to. The 2^sample_shift samples of a pixel that a wave has follow one
// another, and the pixels of a block follow its Z curve (Morton 1966, "A Computer Oriented Geodetic Data Base"), so
// that sixteen slots one after another are as near to each other in the picture as they can be: one pixel, or a square.
#include "castor/shared/types.h"
#include "device/curve.x1.cl"

CASTOR_INLINE uint slot_count(const RenderParams params) { return params.pixel_count << params.sample_shift; }

// Returns the number of the pixel that is the `place`-th along the curve of those that are traced now. Pixels are
// numbered as in CASTOR_PIXEL_BLOCK.
CASTOR_INLINE uint pixel_on_curve(const RenderParams params, const uint place)
{
    return params.first_pixel + place / CASTOR_BLOCK_SLOTS * CASTOR_BLOCK_SLOTS +
           y_on_curve(place) * CASTOR_PIXEL_BLOCK + x_on_curve(place);
}
