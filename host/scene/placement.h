#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

/// In double precision, rounded once.
glm::vec3 transformed_point(const Transform& transform, const glm::vec3& point);

/// Takes normals where `transform` takes points: the inverse transpose.
glm::dmat3 normal_matrix(const Transform& transform);

/// The largest sum of magnitudes in a row.
double row_norm(const glm::dmat3& matrix);

/// The norms of the linear part and of its inverse; the latter infinite where there is none.
struct TransformNorms {
    double forth;
    double back;
};
TransformNorms norms(const Transform& transform);

/// Whether each mesh is placed by instances: where it has any, or is mirrored by its own transform, since then its
/// triangles would wind the other way in the world. Any other is transformed vertex by vertex.
std::vector<bool> meshes_placed_by_instances(const Scene& scene);

/// Center and radius in the world of a sphere whose transform leaves it one, to within 2^-20; none: it becomes an
/// ellipsoid.
std::optional<glm::vec4> sphere_in_world(const Sphere& sphere);

/// Takes the unit sphere about the origin where the sphere's transform takes the sphere.
Transform unit_sphere_transform(const Sphere& sphere);

/// The inverse is computed in double precision and rounded once.
shared::Instance make_instance(const Transform& transform, std::uint32_t geometry, std::uint32_t material);

}  // namespace castor
