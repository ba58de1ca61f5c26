#include "trace/surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "castor/error.h"

namespace castor {

namespace {

/// In double precision, and not rounded yet.
struct ExactSurface {
    glm::dvec3 position{0.0}, normal_geometric{0.0}, normal_shading{0.0};
    std::uint32_t material = CASTOR_INVALID_INDEX;
};

glm::dvec3 to_dvec3(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}

glm::dmat4x3 to_matrix(const float (&rows)[3][4]) {
    glm::dmat4x3 matrix;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) matrix[column][row] = rows[row][column];
    return matrix;
}

/// Brings it to a size near 1 before it is squared. (0,0,0) stays (0,0,0).
glm::dvec3 unit(const glm::dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    return largest > 0.0 ? glm::normalize(v / largest) : v;
}

/// The number within the chunk of a primitive with this number in the whole scene, if it is among the `count` from
/// `first` on, which count from 0 in a scene that is not cut.
std::optional<std::size_t> place_of(const Chunk& chunk, std::size_t first, std::size_t count, std::uint64_t number) {
    if (chunk.primitive_numbers.empty())
        return number < count ? std::optional(first + static_cast<std::size_t>(number)) : std::nullopt;
    const auto begin = chunk.primitive_numbers.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(count);
    const auto found = std::lower_bound(begin, end, number);
    if (found == end || *found != number) return std::nullopt;
    return static_cast<std::size_t>(found - chunk.primitive_numbers.begin());
}

ExactSurface triangle_surface(const SceneArrays& arrays, std::size_t triangle, double u, double v) {
    const auto after = std::upper_bound(
        arrays.mesh_ranges.begin(), arrays.mesh_ranges.end(), triangle,
        [](std::size_t number, const shared::MeshRange& range) { return number < range.first_triangle; });
    const shared::MeshRange& mesh = *std::prev(after);
    const glm::uvec3 corner = arrays.triangle_vertices[triangle];
    const auto blend = [&](const auto& column, std::uint32_t shift) {
        const auto at = [&](int i) { return glm::dvec3(column[std::uint32_t(corner[i] + shift)]); };
        return (1.0 - u - v) * at(0) + u * at(1) + v * at(2);
    };
    const glm::dvec3 p0(arrays.vertex_position[corner[0]]);
    ExactSurface surface;
    surface.position = blend(arrays.vertex_position, 0);
    surface.normal_geometric = unit(glm::cross(glm::dvec3(arrays.vertex_position[corner[1]]) - p0,
                                               glm::dvec3(arrays.vertex_position[corner[2]]) - p0));
    if (mesh.first_normal != CASTOR_INVALID_INDEX)
        surface.normal_shading = unit(blend(arrays.vertex_normal, mesh.first_normal - mesh.first_vertex));
    if (surface.normal_shading == glm::dvec3(0.0)) surface.normal_shading = surface.normal_geometric;
    surface.material = mesh.material;
    return surface;
}

ExactSurface sphere_surface(const SceneArrays& arrays, std::size_t sphere, const glm::dvec3& point) {
    const glm::dvec4 center_radius(arrays.sphere_center_radius[sphere]);
    const glm::dvec3 center(center_radius);
    ExactSurface surface;
    surface.normal_geometric = surface.normal_shading = unit(point - center);
    surface.position = center + center_radius.w * surface.normal_geometric;
    surface.material = arrays.sphere_material[sphere];
    return surface;
}

ExactSurface plane_surface(const SceneArrays& arrays, std::size_t plane, const glm::dvec3& point) {
    ExactSurface surface;
    surface.position = point;
    surface.normal_geometric = surface.normal_shading = unit(glm::dvec3(arrays.plane_normal[plane]));
    surface.material = arrays.plane_material[plane];
    return surface;
}

/// Finds the surface in the space of the hit's geometry, where `point` is on the ray; nullopt if the chunk does not
/// have the primitive.
std::optional<ExactSurface> surface_in_chunk(const Chunk& chunk, std::uint32_t geometry_number, const Hit& hit,
                                             const glm::dvec3& point) {
    const SceneArrays& arrays = chunk.arrays;
    const shared::Geometry& geometry = arrays.geometries[geometry_number];
    const std::size_t triangles = arrays.triangle_count(), spheres = arrays.sphere_count();
    // A chunk's numbers stand in the order of all its triangles, spheres and planes.
    const bool is_cut = !chunk.primitive_numbers.empty();
    const std::uint64_t first_sphere = is_cut ? 0 : geometry.triangle_count;
    const std::uint64_t first_plane = is_cut ? 0 : first_sphere + geometry.sphere_count;
    if (const auto place = place_of(chunk, geometry.first_triangle, geometry.triangle_count, hit.primitive))
        return triangle_surface(arrays, *place, hit.u, hit.v);
    if (hit.primitive >= first_sphere)
        if (const auto place =
                place_of(chunk, triangles + geometry.first_sphere, geometry.sphere_count, hit.primitive - first_sphere))
            return sphere_surface(arrays, *place - triangles, point);
    if (geometry_number == 0 && hit.primitive >= first_plane)
        if (const auto place = place_of(chunk, triangles + spheres, arrays.plane_count(), hit.primitive - first_plane))
            return plane_surface(arrays, *place - triangles - spheres, point);
    return std::nullopt;
}

}  // namespace

Surface surface_of_hit(const SceneContents& scene, const Ray& ray, const Hit& hit) {
    if (hit.primitive == CASTOR_INVALID_INDEX && hit.instance == CASTOR_INVALID_INDEX) return {};
    const Column<shared::Instance>& instances = scene.arrays().instances;
    const auto fail = [&] {
        throw UsageError(
            fmt::format("there is no primitive {} of instance {} in the scene", hit.primitive, hit.instance));
    };
    if (hit.instance > 0 && hit.instance >= instances.size()) fail();
    const shared::Instance* const instance = hit.instance == 0 ? nullptr : &instances[hit.instance];
    glm::dvec3 origin = to_dvec3(ray.origin), direction = to_dvec3(ray.direction);
    glm::dmat4x3 to_object(1.0);
    if (instance) {
        to_object = to_matrix(instance->to_object);
        origin = to_object * glm::dvec4(origin, 1.0);
        direction = to_object * glm::dvec4(direction, 0.0);
    }
    const glm::dvec3 point = origin + double(hit.t) * direction;
    std::optional<ExactSurface> found;
    for (const Chunk& chunk : scene.chunks)
        if ((found = surface_in_chunk(chunk, instance ? instance->geometry : 0, hit, point))) break;
    if (!found) fail();
    if (instance) {
        // The inverse transpose takes normals to the world.
        const auto world_normal = [&](const glm::dvec3& normal) {
            return unit(glm::dvec3(glm::dot(glm::dvec3(to_object[0]), normal),
                                   glm::dot(glm::dvec3(to_object[1]), normal),
                                   glm::dot(glm::dvec3(to_object[2]), normal)));
        };
        found->position = to_matrix(instance->to_world) * glm::dvec4(found->position, 1.0);
        found->normal_geometric = world_normal(found->normal_geometric);
        found->normal_shading = world_normal(found->normal_shading);
        found->material = instance->material;
    }
    return {glm::vec3(found->position), glm::vec3(found->normal_geometric), glm::vec3(found->normal_shading),
            found->material};
}

}  // namespace castor
