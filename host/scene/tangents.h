#pragma once

#include <cstdint>

#include "castor/scene.h"

namespace castor {

/// Gives a mesh, which has none, the tangents of its texture coordinates: of the first set (0) or the second (1), which
/// must be there. Vertices whose triangles disagree are divided. Where a triangle has no area, in space or in the
/// picture, its vertices have those of others, or none: (0, 0, 0, 1).
///
/// These are the tangents with which normal maps are made: Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited",
/// chapter 4, as his MikkTSpace has them, which glTF names. A triangle's tangent is along u. Triangles that share edges
/// and are mirrored alike share the mean of their tangents at a vertex, by the angles that they have there.
void add_tangents(Mesh& mesh, std::uint32_t coordinate_set);

}  // namespace castor
