#pragma once

#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads a Wavefront OBJ file and the MTL files that it names; scenes/README.md describes which dialects. The scene has
/// meshes, materials and warnings, but no camera and no light (`add_default_view` adds them). A run of consecutive
/// faces of the same material is one mesh with vertices of its own, so that triangles keep the order of the file; a
/// polygon of n vertices is the fan (0, k-1, k) for k = 2 … n-1. A run in which every corner has a normal is smooth;
/// any other is flat, or with `smooth` has the normals of compute_smooth_normals by the file's numbers of vertices. A
/// vertex has the texture coordinates u and 1 - v, since v points up in OBJ files. Ka, Kd, Ks, Ns become the terms of
/// the material (a Ka of zero is replaced by Kd), and map_Kd a texture in place of Kd; illum 3 and 5 mirror by Ks. A
/// material that emits light (Ke) gets an ambient term that looks bright under the default view. Faces without a
/// material are grey, and so are those whose material is missing, with a warning. Throws SceneError with the line if
/// the file is missing or damaged, has no triangle, a coordinate that is not a finite number, or a vertex index past
/// the vertices.
Scene read_obj(const std::filesystem::path& file, const Progress& progress = {}, bool smooth = false);

}  // namespace castor
