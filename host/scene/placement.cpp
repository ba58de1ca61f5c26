#include "scene/placement.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat4x3.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace castor {

namespace {

glm::dmat3 linear_part(const Transform& transform) {
    return glm::dmat3(glm::dvec3(transform[0]), glm::dvec3(transform[1]), glm::dvec3(transform[2]));
}

}  // namespace

glm::vec3 transformed_point(const Transform& transform, const glm::vec3& point) {
    return glm::vec3(linear_part(transform) * glm::dvec3(point) + glm::dvec3(transform[3]));
}

glm::dmat3 normal_matrix(const Transform& transform) {
    return glm::transpose(glm::inverse(linear_part(transform)));
}

double row_norm(const glm::dmat3& matrix) {
    double norm = 0.0;
    for (int row = 0; row < 3; ++row)
        norm = std::max(norm, std::abs(matrix[0][row]) + std::abs(matrix[1][row]) + std::abs(matrix[2][row]));
    return norm;
}

TransformNorms norms(const Transform& transform) {
    const glm::dmat3 linear = linear_part(transform);
    if (glm::determinant(linear) == 0.0) return {row_norm(linear), std::numeric_limits<double>::infinity()};
    return {row_norm(linear), row_norm(glm::inverse(linear))};
}

std::vector<bool> meshes_placed_by_instances(const Scene& scene) {
    std::vector<bool> by_instance;
    for (const Mesh& mesh : scene.meshes) by_instance.push_back(glm::determinant(linear_part(mesh.transform)) < 0.0);
    for (const MeshInstance& instance : scene.instances) by_instance[instance.mesh] = true;
    return by_instance;
}

std::optional<glm::vec4> sphere_in_world(const Sphere& sphere) {
    if (sphere.transform == Transform(1.0f)) return glm::vec4(sphere.center, sphere.radius);
    const glm::dmat3 linear = linear_part(sphere.transform);
    const glm::dmat3 squares = glm::transpose(linear) * linear;  // s^2 times the identity if lengths are scaled by s
    const double square = (squares[0][0] + squares[1][1] + squares[2][2]) / 3.0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(squares[i][j] - (i == j ? square : 0.0)) <= 0x1p-20 * square)) return std::nullopt;
    return glm::vec4(transformed_point(sphere.transform, sphere.center),
                     static_cast<float>(std::sqrt(square) * static_cast<double>(sphere.radius)));
}

Transform unit_sphere_transform(const Sphere& sphere) {
    const glm::dmat3 linear = linear_part(sphere.transform) * static_cast<double>(sphere.radius);
    return Transform(glm::vec3(linear[0]), glm::vec3(linear[1]), glm::vec3(linear[2]),
                     transformed_point(sphere.transform, sphere.center));
}

shared::Instance make_instance(const Transform& transform, std::uint32_t geometry, std::uint32_t material) {
    shared::Instance instance{};
    const glm::dmat3 back = glm::inverse(linear_part(transform));
    const glm::dvec3 origin = back * -glm::dvec3(transform[3]);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            instance.to_object[row][column] = static_cast<float>(back[column][row]);
            instance.to_world[row][column] = transform[column][row];
        }
        instance.to_object[row][3] = static_cast<float>(origin[row]);
        instance.to_world[row][3] = transform[3][row];
    }
    instance.geometry = geometry;
    instance.material = material;
    return instance;
}

}  // namespace castor
