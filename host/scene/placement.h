#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

/// Transforms a point in double precision and rounds once.
glm::vec3 transformed_point(const Transform& transform, const glm::vec3& point);

/// Returns the matrix that transforms normals when `transform` transforms points: the inverse transpose.
glm::dmat3 normal_matrix(const Transform& transform);

/// Returns the largest sum of magnitudes in a row.
double row_norm(const glm::dmat3& matrix);

/// The norms of the linear part of a transform and of its inverse; the latter is infinite if there is no inverse.
struct TransformNorms {
    double forth;
    double back;
};
TransformNorms norms(const Transform& transform);

/// Returns for each mesh whether it is placed by instances: if it has instances, if it moves, if its own transform
/// mirrors it, which would reverse the winding of its triangles in the world, or if it has a transform and a texture
/// that is a function of the object's own space. Any other mesh is transformed vertex by vertex.
std::vector<bool> meshes_placed_by_instances(const Scene& scene);

/// Returns whether a sphere needs a geometry of its own in its own space: its textures are functions of that.
bool has_own_space(const Scene& scene, const Sphere& sphere);

/// Returns center and radius in the world of a sphere that its transform leaves a sphere, to within 2^-20; nullopt if
/// it becomes an ellipsoid.
std::optional<glm::vec4> sphere_in_world(const Sphere& sphere);
/// The same; nullopt also for a sphere that moves, or has a space of its own.
std::optional<glm::vec4> sphere_in_world(const Scene& scene, const Sphere& sphere);

/// Returns center and radius, in the space of its instance, of a sphere that an instance places: its own, or the unit
/// sphere about the origin.
glm::vec4 sphere_in_object(const Scene& scene, const Sphere& sphere);

/// Returns the transform from the unit sphere about the origin to the transformed sphere.
Transform unit_sphere_transform(const Sphere& sphere);

/// Makes an instance. The inverse is computed in double precision and rounded once.
shared::Instance make_instance(const Transform& transform, std::uint32_t geometry, std::uint32_t material,
                               const glm::vec3& motion = glm::vec3(0.0f));

}  // namespace castor
