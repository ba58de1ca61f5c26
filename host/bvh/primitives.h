#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>

#include "base/range.h"

namespace castor {

/// What trees are built over: triangles and spheres where they stand. Primitives are numbered triangles first, then
/// spheres, each over its whole span; those in the two ranges take part. A triangle with three equal indices is
/// degenerate, and left out.
struct Primitives {
    std::span<const glm::vec3> vertex_position;
    std::span<const glm::uvec3> triangle_vertices;
    std::span<const glm::vec4> sphere_center_radius;
    Range triangles;
    Range spheres;

    std::size_t triangle_count() const { return triangle_vertices.size(); }
    std::size_t sphere_count() const { return sphere_center_radius.size(); }
};

}  // namespace castor
