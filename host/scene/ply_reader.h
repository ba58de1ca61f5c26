#pragma once

#include <cstdint>
#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads the triangles of a PLY file, ASCII or binary of either byte order.
/// A vertex has x, y, z and, if the file has nx, ny, nz, a unit normal; a normal that is zero or not finite becomes
/// (0,0,0), so that a hit there is shaded with the triangle's own normal. Its texture coordinates are u v, s t or
/// texture_u texture_v, and (0,0) where they are not finite. A face is the list vertex_indices (or
/// vertex_index); a polygon of n vertices is the fan (0, k-1, k) for k = 2 … n-1, and faces of fewer than three
/// vertices are left out. In tristrips the index -1 begins a new strip, and triangles that repeat a vertex are left
/// out. Other properties and elements are skipped. `material` is 0. Throws SceneError if the file is missing, damaged
/// or truncated (with the element at which it ends), or has no triangle, a coordinate that is not finite, an index past
/// the vertices, or data after the last element. Memory is allocated only after the file has proved long enough for the
/// counts in its header. Records are decoded in parallel by blocks of `block_records`; tests choose small ones.
Mesh read_ply(const std::filesystem::path& file, const Progress& progress = {},
              std::uint64_t block_records = std::uint64_t{1} << 14);

}  // namespace castor
