#pragma once

#include <cstdint>
#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads the triangles of a PLY file: ASCII or binary of either byte order.
/// Vertices: x, y, z, and unit normals where nx, ny, nz are there (one that is zero or not finite becomes (0,0,0), so
/// that a hit there is shaded with the triangle's own normal). Faces: the list vertex_indices (or vertex_index); a
/// polygon of n vertices is the fan (0, k-1, k) for k = 2 … n-1, and faces of fewer than three vertices are left out.
/// Also tristrips, whose index -1 starts a new strip, less the triangles that repeat a vertex. Other properties and
/// elements are skipped. `material` is 0.
/// Throws SceneError where the file is missing, damaged, truncated (with the element at which it ends), or has no
/// triangle, a coordinate that is not finite, an index past the vertices, or data after the last element. Nothing is
/// allocated on the header's word alone: the file must be long enough first.
/// Records are decoded in parallel by blocks of `block_records`; tests choose small ones.
Mesh read_ply(const std::filesystem::path& file, const Progress& progress = {},
              std::uint64_t block_records = std::uint64_t{1} << 14);

}  // namespace castor
