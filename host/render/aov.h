#pragma once

#include <string>
#include <vector>

#include "castor/film.h"
#include "render/wave.h"

namespace castor {

/// Empty planes of these names (of aov_names()), filled with a miss's values. Throws UsageError for an unknown name, or one given twice.
std::vector<FilmPlane> make_planes(const std::vector<std::string>& names, std::uint32_t width, std::uint32_t height);

/// Copies what the eye rays of a tile met into the film's planes.
void store_tile(Film& film, const Tile& tile, const TileAovs& aovs);

}  // namespace castor
