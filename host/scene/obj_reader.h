#pragma once

#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads a Wavefront OBJ file with the materials of its MTL files, which are looked for beside it. The scene has
/// meshes, materials and warnings only: no camera and no light (`add_default_view` gives them). A run of consecutive
/// faces of the same material is one mesh with vertices of its own, so triangles stay in the file's order; a polygon of
/// n vertices is the fan (0, k-1, k) for k = 2 … n-1. A run in which every corner has a normal is smooth; any other is
/// flat. Ka, Kd, Ks, Ns become the material's terms (Ka of zero: as Kd); illum 3 and 5 mirror by Ks. A material that
/// emits (Ke) gets an ambient term that looks bright under the default view. Faces without a material, or with one that
/// is not found, are grey, the latter with a warning.
/// Throws SceneError (with the line) where the file is missing or damaged, has no face, a coordinate that is not a
/// finite number, or an index past its data.
Scene read_obj(const std::filesystem::path& file, const Progress& progress = {});

}  // namespace castor
