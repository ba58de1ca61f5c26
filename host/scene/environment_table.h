#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/column.h"
#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

/// Tables by which directions to environments are drawn (kernels/device/environment_sampling.lanes.cl).
///
/// The picture is cut into cells, squares of texels: the smallest ones, of a power of two, of which there are at most
/// 2^19. Its light, cut into CASTOR_EMITTER_PARTS equal parts, is dealt out to the cells, at least one part to each
/// that has any. Cells are numbered along Z curves in squares of 2^n x 2^n, of which there is a row or a column, where
/// 2^n is the smaller of the width and height in cells, both rounded up to powers of two.
///
/// A table is a header and two trees. The header: the bits of a cell's column, those of its row, those of the number of
/// a cell's texels along an axis, and the words of a tree. The first tree is of the light itself; the second of what is
/// above the average of all directions (Karlík, Šik, Vévoda, Skřivan, Křivánek 2019, "MIS Compensation: Optimizing
/// Sampling Techniques in Multiple Importance Sampling"), or of the light itself where nothing is. A tree is its
/// levels, the root's children first and the cells last, each twice two halves of the one before; each has the number
/// of the first part of each node, is filled up to four words by CASTOR_EMITTER_PARTS, and the last level is followed
/// by four words of that.
///
/// Light is the sum of the magnitudes of a texel's channels times its solid angle; that of a probe's texel is taken as
/// if it were at the texel's point that is nearest to the middle, so that all texels with light have some. Where all is
/// black, solid angles are dealt out.

/// Returns the words of a table for a picture of this size.
std::uint64_t environment_table_words(std::uint32_t width, std::uint32_t height);

/// Returns the words of the tables of a scene's environments.
std::uint64_t environment_table_words(const Scene& scene);

/// Appends the table of a valid picture and returns where it begins.
std::uint32_t append_environment_table(Column<std::uint32_t>& parts, const Image& image, EnvironmentMapping mapping);

/// Returns the mean over all directions of a valid picture's radiance, of which each texel counts as above; of its
/// channels the mean.
double mean_radiance(const Image& image, EnvironmentMapping mapping);

/// Returns what is wrong with the words of a table for a picture of this size; empty: nothing. A table that is right
/// leads to texels of the picture alone.
std::string problem_of_environment_table(std::span<const std::uint32_t> table, std::uint32_t width,
                                         std::uint32_t height);

}  // namespace castor
