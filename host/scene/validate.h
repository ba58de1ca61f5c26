#pragma once

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Throws SceneError for the first thing in the scene that tracing and shading cannot take: an index out of range, a
/// number that is not finite or too large, a radius, normal, direction or cone without meaning, or more primitives than
/// 32 bits can number. Degenerate triangles are allowed. Cameras are checked where rays are made from them.
void validate(const Scene& scene, const Progress& progress = {});

/// Returns the number of triangles, vertices and normals of all meshes.
std::uint64_t element_count(const Scene& scene);

}  // namespace castor
