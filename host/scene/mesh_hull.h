#pragma once

#include <glm/vec3.hpp>
#include <span>

namespace castor {

/// Whether triangles hide their own far sides from whoever is outside of a box around them.
enum class MeshHull {
    open,           // some do not, or it is not known
    closed,         // those whose normals, by the right hand about their corners, point away
    closed_inward,  // those whose normals point towards the viewer
};

/// Triangles are closed where each edge is in two of them, in opposite directions, and where all connected parts turn
/// the same side out, by the sign of their volume. Corners at equal positions are the same corner; triangles in which
/// two are do not count. A surface that passes through itself may be taken for closed.
MeshHull hull_of(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles);

}  // namespace castor
