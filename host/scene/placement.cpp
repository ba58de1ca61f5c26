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

// Whether a texture is more than a colour at texture coordinates: a function of the point, or of dp/du and dp/dv.
bool is_of_space(const Texture& texture) {
    return texture.kind != TextureKind::image || texture.target == TextureTarget::normal_map ||
           texture.target == TextureTarget::bump_map;
}

bool needs_own_space(const Scene& scene, const Mesh& mesh) {
    if (mesh.transform == Transform(1.0f)) return false;
    const std::vector<std::uint32_t>& textures = scene.materials[mesh.material].textures;
    return std::any_of(textures.begin(), textures.end(),
                       [&](std::uint32_t texture) { return is_of_space(scene.textures[texture]); });
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
    for (const Mesh& mesh : scene.meshes)
        by_instance.push_back(glm::determinant(linear_part(mesh.transform)) < 0.0 || mesh.motion != glm::vec3(0.0f) ||
                              needs_own_space(scene, mesh));
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

bool has_own_space(const Scene& scene, const Sphere& sphere) {
    const bool is_placed = sphere.transform != Transform(1.0f) || sphere.motion != glm::vec3(0.0f);
    return is_placed && !scene.materials[sphere.material].textures.empty();
}

std::optional<glm::vec4> sphere_in_world(const Scene& scene, const Sphere& sphere) {
    const bool moves = sphere.motion != glm::vec3(0.0f);
    return moves || has_own_space(scene, sphere) ? std::nullopt : sphere_in_world(sphere);
}

glm::vec4 sphere_in_object(const Scene& scene, const Sphere& sphere) {
    if (has_own_space(scene, sphere)) return glm::vec4(sphere.center, sphere.radius);
    return glm::vec4(0.0f, 0.0f, 0.0f, 1.0f);
}

Transform unit_sphere_transform(const Sphere& sphere) {
    const glm::dmat3 linear = linear_part(sphere.transform) * static_cast<double>(sphere.radius);
    return Transform(glm::vec3(linear[0]), glm::vec3(linear[1]), glm::vec3(linear[2]),
                     transformed_point(sphere.transform, sphere.center));
}

shared::Instance make_instance(const Transform& transform, std::uint32_t geometry, std::uint32_t material,
                               const glm::vec3& motion) {
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
    for (int i = 0; i < 3; ++i) instance.motion[i] = motion[i];
    instance.geometry = geometry;
    instance.material = material;
    return instance;
}

}  // namespace castor
