#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <vector>

#include "castor/film.h"
#include "render/pixel_blocks.h"
#include "render/wave_aovs.h"

namespace castor {

/// Makes planes of these names (of aov_names()) but those of lights, filled with a miss's values. Throws UsageError for
/// an unknown name, or one given twice.
std::vector<FilmPlane> make_planes(const std::vector<std::string>& names, std::uint32_t width, std::uint32_t height);

/// Copies what the eye rays of a wave of these blocks met into the film's planes.
void store_aovs(Film& film, const PixelBlocks& blocks, std::span<const std::uint32_t> numbers, const WaveAovs& aovs);

// Planes that are not of eye rays through the pixels' centres, but of the picture's own samples: "samples", the sums of
// which "variance" and means are made, and those that have rows of their own among the sums.

bool has_planes_of_eye_rays(const std::vector<FilmPlane>& planes);
/// Whether any plane is made of sums, also of those of blocks that are done.
bool has_planes_of_sums(const std::vector<FilmPlane>& planes);
/// Returns how many rows the sums of samples have: see Wave::sums.
std::uint32_t rows_of_sums(const std::vector<FilmPlane>& planes);
/// Writes the planes of samples of a block. `sums`: a row after the other, a slot of the block each; empty if no plane
/// is made of sums.
void store_sums(Film& film, const PixelBlocks& blocks, std::uint32_t block, std::uint32_t samples,
                std::span<const glm::vec4> sums);

}  // namespace castor
