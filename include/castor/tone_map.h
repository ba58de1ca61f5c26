#pragma once

#include <string_view>

#include "castor/api.h"
#include "castor/film.h"
#include "castor/scene.h"

namespace castor {

/// Returns the film as an image of 8 bits, as the tone map says. Values are computed in double precision, sums taken in
/// the order of pixels, and results truncated to integers. A channel that is NaN or negative counts as 0, one that is
/// infinite as the largest float; a pixel without luminance stays black, except that AgX has no black. `burn_percent` 0
/// makes the largest luminance white, and photographic then never saturates: L / (1 + L). Throws UsageError for a film
/// without pixels, and for a key or gamma that is not positive, a negative saturation, or a burn_percent outside [0,
/// 100].
CASTOR_API Image apply_tone_map(const Film& film, const ToneMap& tone_map);

/// Throws UsageError, listing the names, unless the word is one of them: photographic, aces, filmic, linear, agx.
CASTOR_API ToneOperator tone_operator_from_string(std::string_view word);
CASTOR_API std::string_view to_string(ToneOperator tone_operator);

}  // namespace castor
