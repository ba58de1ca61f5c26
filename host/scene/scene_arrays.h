#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <vector>

#include "base/column.h"
#include "base/progress.h"
#include "bvh/primitives.h"
#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

/// What a scene has beside columns.
struct SceneSettings {
    glm::vec3 background{0.0f};
    glm::vec3 ambient_light{0.0f};
    float shadow_ray_epsilon = 0.0f;
    std::uint32_t max_recursion_depth = 0;
    std::vector<Warning> warnings;  // degenerate triangles, counted per mesh; dielectric materials, counted
};

/// The scene as devices read it: one column a property. Made by `flatten` alone; what has passed it is valid, and
/// nothing later checks again: indices are in range, coordinates finite and within CASTOR_MAX_COORDINATE, radii
/// positive, plane normals and light directions unit.
struct SceneArrays : SceneSettings {
    // Triangles of all meshes in order. A degenerate triangle (two equal vertices, or zero area) keeps its number but
    // has three equal indices, so that no ray hits it.
    Column<glm::vec3> vertex_position;
    Column<glm::uvec3> triangle_vertices;
    Column<glm::vec3> vertex_normal;        // of smooth meshes only, see MeshRange
    Column<shared::MeshRange> mesh_ranges;  // meshes without triangles are left out
    Column<glm::vec4> sphere_center_radius;
    Column<std::uint32_t> sphere_material;
    Column<glm::vec4> plane_point;   // w = 0
    Column<glm::vec4> plane_normal;  // unit, w = 0
    Column<std::uint32_t> plane_material;
    // What instances place. Geometry 0 is what stands in the scene once: the first triangles and the first spheres, and
    // all planes.
    Column<shared::Geometry> geometries;  // at least one
    Column<shared::Instance> instances;  // as hits name them, [0] being geometry 0 as it is; empty if there is no other
    Column<shared::Material> materials;
    Column<shared::Light> lights;

    std::size_t triangle_count() const { return triangle_vertices.size(); }
    std::size_t sphere_count() const { return sphere_center_radius.size(); }
    std::size_t plane_count() const { return plane_point.size(); }
    /// Of geometry 0.
    float largest_coordinate() const { return geometries.front().largest_coordinate; }
};

/// What the tree of a geometry is built over.
inline Primitives primitives_of(const SceneArrays& arrays, std::size_t geometry = 0) {
    const shared::Geometry& part = arrays.geometries[geometry];
    return {arrays.vertex_position, arrays.triangle_vertices, arrays.sphere_center_radius,
            Range{part.first_triangle, std::uint64_t{part.first_triangle} + part.triangle_count},
            Range{part.first_sphere, std::uint64_t{part.first_sphere} + part.sphere_count}};
}

/// The one gate for validity. Throws SceneError naming the element, its line where known, what was found and what was
/// expected.
SceneArrays flatten(const Scene& scene, const Progress& progress = {});

}  // namespace castor
