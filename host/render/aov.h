#pragma once

#include <string>
#include <vector>

#include "base/range.h"
#include "castor/film.h"
#include "render/pixel_blocks.h"
#include "render/wave_aovs.h"

namespace castor {

/// Makes planes of these names (of aov_names()) but those of lights, filled with a miss's values. Throws UsageError for
/// an unknown name, or one given twice.
std::vector<FilmPlane> make_planes(const std::vector<std::string>& names, std::uint32_t width, std::uint32_t height);

/// Copies what the eye rays of a wave of these blocks met into the film's planes.
void store_aovs(Film& film, const PixelBlocks& blocks, const Range& numbers, const WaveAovs& aovs);

}  // namespace castor
