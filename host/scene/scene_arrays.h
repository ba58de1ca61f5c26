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
#include "castor/shared/scene_columns.h"
#include "castor/shared/types.h"

namespace castor {

/// The values of a scene that are no columns.
struct SceneSettings {
    glm::vec3 background{0.0f};
    glm::vec3 ambient_light{0.0f};
    float shadow_ray_epsilon = 0.0f;
    std::uint32_t max_recursion_depth = 0;
    std::uint32_t background_texture = CASTOR_INVALID_INDEX;  // in place of `background`
    bool shades_both_sides = false;
    std::vector<Warning> warnings;  // degenerate triangles; lamps that light otherwise than seen
};

/// The columns of a scene that `flatten` makes, from the list in castor/shared/scene_columns.h: one column a property.
/// Made by `flatten`, or mapped from a saved scene and checked (check_built_scene); nothing later checks again: indices
/// are in range, coordinates finite and within CASTOR_MAX_COORDINATE, radii positive, plane normals and light
/// directions unit.
///
/// Triangles are those of all meshes in order. A degenerate triangle (two equal vertices, or zero area) keeps its
/// number but has three equal indices, so that no ray hits it. Only smooth meshes have normals, see MeshRange; meshes
/// without triangles are left out. The fourth component of plane_point and plane_normal is 0. Geometries are what
/// instances place; there is at least one, geometry 0, which holds what stands in the scene once: the first triangles
/// and the first spheres, and all planes. Instances have the numbers that hits name; instance 0 is geometry 0 without a
/// transform, and a scene that has only geometry 0 has no instances at all.
struct SceneArrays : SceneSettings {
#define CASTOR_MEMBER_flat(name, host) Column<host> name;
#define CASTOR_MEMBER_tree(name, host)
#define CASTOR_FLAT_MEMBER(name, host, device, per, place, made, trace, surface) CASTOR_MEMBER_##made(name, host)
    CASTOR_SCENE_COLUMNS(CASTOR_FLAT_MEMBER)
#undef CASTOR_MEMBER_flat
#undef CASTOR_MEMBER_tree
#undef CASTOR_FLAT_MEMBER

    std::size_t triangle_count() const {
        return triangle_vertices.size();
    }
    std::size_t sphere_count() const {
        return sphere_center_radius.size();
    }
    std::size_t plane_count() const {
        return plane_point.size();
    }
    /// The largest coordinate of geometry 0.
    float largest_coordinate() const {
        return geometries.front().largest_coordinate;
    }
};

/// Calls visit(name, column) for the columns of SceneArrays, in the order of the list.
template <class Arrays, class Visit>
void for_each_flat_column(Arrays& arrays, const Visit& visit) {
#define CASTOR_VISIT_flat(name) visit(#name, arrays.name);
#define CASTOR_VISIT_tree(name)
#define CASTOR_VISIT_FLAT(name, host, device, per, place, made, trace, surface) CASTOR_VISIT_##made(name)
    CASTOR_SCENE_COLUMNS(CASTOR_VISIT_FLAT)
#undef CASTOR_VISIT_flat
#undef CASTOR_VISIT_tree
#undef CASTOR_VISIT_FLAT
}

/// What the tree of a geometry is built over.
inline Primitives primitives_of(const SceneArrays& arrays, std::size_t geometry = 0) {
    const shared::Geometry& part = arrays.geometries[geometry];
    return {arrays.vertex_position, arrays.triangle_vertices, arrays.sphere_center_radius,
            Range{part.first_triangle, std::uint64_t{part.first_triangle} + part.triangle_count},
            Range{part.first_sphere, std::uint64_t{part.first_sphere} + part.sphere_count}};
}

/// What the meshes of a scene take in the columns of `flatten`.
struct MeshCounts {
    std::uint64_t vertices = 0, normals = 0, texture_coordinates = 0, attributes = 0, triangles = 0, ranges = 0;
};

MeshCounts mesh_counts(const Scene& scene);

/// The one gate for validity. Throws SceneError naming the element, its line where known, what was found and what was
/// expected.
SceneArrays flatten(const Scene& scene, const Progress& progress = {});

}  // namespace castor
