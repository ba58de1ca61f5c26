#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "bvh/box.h"
#include "scene/scene_arrays.h"
#include "scene/validate.h"

namespace castor {

namespace {

void store(float (&to)[3], const glm::vec3& from) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

// In double precision, where no finite float vector under- or overflows.
glm::vec3 unit(const glm::vec3& v) {
    return glm::vec3(glm::normalize(glm::dvec3(v)));
}

bool is_degenerate(const glm::vec3& p0, const glm::vec3& p1, const glm::vec3& p2) {
    if (p0 == p1 || p1 == p2 || p2 == p0) return true;
    const glm::dvec3 origin(p0);
    return glm::cross(glm::dvec3(p1) - origin, glm::dvec3(p2) - origin) == glm::dvec3(0.0);
}

std::uint32_t kind_code(MaterialKind kind) {
    switch (kind) {
        case MaterialKind::mirror:
            return CASTOR_MATERIAL_MIRROR;
        case MaterialKind::conductor:
            return CASTOR_MATERIAL_CONDUCTOR;
        case MaterialKind::dielectric:
            return CASTOR_MATERIAL_DIELECTRIC;
        default:
            return CASTOR_MATERIAL_PLAIN;
    }
}

shared::Material to_shared(const Material& material) {
    shared::Material result{};
    store(result.ambient, material.ambient);
    store(result.diffuse, material.diffuse);
    store(result.specular, material.specular);
    store(result.mirror, material.mirror);
    result.phong_exponent = material.phong_exponent;
    result.refraction_index = material.refraction_index;
    result.absorption_index = material.absorption_index;
    result.kind = kind_code(material.kind);
    return result;
}

shared::Light to_shared(const PointLight& light) {
    shared::Light result{};
    result.kind = CASTOR_LIGHT_POINT;
    store(result.position, light.position);
    store(result.intensity, light.intensity);
    return result;
}

shared::Light to_shared(const DirectionalLight& light) {
    shared::Light result{};
    result.kind = CASTOR_LIGHT_DIRECTIONAL;
    store(result.direction, unit(light.direction));
    store(result.intensity, light.radiance);
    return result;
}

shared::Light to_shared(const SpotLight& light) {
    // A float just above 2 pi passes as 2 pi; its cosine must stay that of the full sphere.
    const auto cos_half = [](float radians) {
        return static_cast<float>(std::cos(std::min(0.5 * radians, std::numbers::pi)));
    };
    shared::Light result{};
    result.kind = CASTOR_LIGHT_SPOT;
    store(result.position, light.position);
    store(result.direction, unit(light.direction));
    store(result.intensity, light.intensity);
    result.cos_coverage = cos_half(light.coverage_radians);
    result.cos_falloff = cos_half(light.falloff_radians);
    return result;
}

shared::Light to_shared(const Light& light) {
    switch (light.kind) {
        case Light::Kind::directional:
            return to_shared(light.directional);
        case Light::Kind::spot:
            return to_shared(light.spot);
        default:
            return to_shared(light.point);
    }
}

// What is learnt about triangles while they are copied.
struct TriangleFacts {
    std::size_t degenerate_count = 0;
    float largest_coordinate = 0.0f;
};

TriangleFacts operator+(const TriangleFacts& a, const TriangleFacts& b) {
    return {a.degenerate_count + b.degenerate_count, std::max(a.largest_coordinate, b.largest_coordinate)};
}

// Writes the mesh's triangles from `destination` on, with indices that count from `first_vertex`.
TriangleFacts copy_triangles(const Mesh& mesh, std::uint32_t first_vertex, glm::uvec3* destination) {
    using Range = tbb::blocked_range<std::size_t>;
    constexpr std::size_t kGrain = 8192;
    const auto copy = [&](const Range& range, TriangleFacts facts) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const glm::uvec3 triangle = mesh.triangles[i];
            const glm::vec3 &p0 = mesh.positions[triangle.x], &p1 = mesh.positions[triangle.y],
                            &p2 = mesh.positions[triangle.z];
            if (is_degenerate(p0, p1, p2)) {
                destination[i] = glm::uvec3(first_vertex + triangle.x);
                ++facts.degenerate_count;
            } else {
                destination[i] = first_vertex + triangle;
                facts.largest_coordinate =
                    std::max(facts.largest_coordinate, largest_coordinate(triangle_box(p0, p1, p2)));
            }
        }
        return facts;
    };
    return tbb::parallel_reduce(Range(0, mesh.triangles.size(), kGrain), TriangleFacts{}, copy,
                                [](const TriangleFacts& a, const TriangleFacts& b) { return a + b; });
}

void reserve_meshes(SceneArrays& arrays, const Scene& scene) {
    std::size_t vertices = 0, normals = 0, triangles = 0, ranges = 0;
    for (const Mesh& mesh : scene.meshes) {
        if (mesh.triangles.empty()) continue;
        vertices += mesh.positions.size();
        normals += mesh.normals.size();
        triangles += mesh.triangles.size();
        ++ranges;
    }
    arrays.vertex_position.reserve(vertices);
    arrays.vertex_normal.reserve(normals);
    arrays.triangle_vertices.resize(triangles);
    arrays.mesh_ranges.reserve(ranges);
}

// `first_triangle`: how many triangles the meshes before have.
void append_mesh(SceneArrays& arrays, const Mesh& mesh, std::size_t first_triangle) {
    shared::MeshRange range;
    range.first_triangle = static_cast<std::uint32_t>(first_triangle);
    range.first_vertex = static_cast<std::uint32_t>(arrays.vertex_position.size());
    range.first_normal =
        mesh.normals.empty() ? CASTOR_INVALID_INDEX : static_cast<std::uint32_t>(arrays.vertex_normal.size());
    range.material = mesh.material;
    arrays.mesh_ranges.push_back(range);
    arrays.vertex_position.insert(arrays.vertex_position.end(), mesh.positions.begin(), mesh.positions.end());
    arrays.vertex_normal.insert(arrays.vertex_normal.end(), mesh.normals.begin(), mesh.normals.end());
}

std::string degenerate_text(std::size_t mesh, std::size_t degenerate, std::size_t total) {
    return fmt::format("mesh {}: {} of {} triangles {} no area and cannot be hit", mesh, degenerate, total,
                       degenerate == 1 ? "has" : "have");
}

void append_meshes(SceneArrays& arrays, const Scene& scene) {
    reserve_meshes(arrays, scene);
    std::size_t first_triangle = 0;
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        const Mesh& mesh = scene.meshes[i];
        if (mesh.triangles.empty()) continue;
        append_mesh(arrays, mesh, first_triangle);
        const TriangleFacts facts = copy_triangles(mesh, arrays.mesh_ranges.back().first_vertex,
                                                   arrays.triangle_vertices.data() + first_triangle);
        first_triangle += mesh.triangles.size();
        arrays.largest_coordinate = std::max(arrays.largest_coordinate, facts.largest_coordinate);
        if (facts.degenerate_count == 0) continue;
        arrays.warnings.push_back(
            {scene.file, mesh.line, degenerate_text(i, facts.degenerate_count, mesh.triangles.size())});
    }
}

void append_spheres(SceneArrays& arrays, const std::vector<Sphere>& spheres) {
    arrays.sphere_center_radius.reserve(spheres.size());
    arrays.sphere_material.reserve(spheres.size());
    for (const Sphere& sphere : spheres) {
        const glm::vec4 center_radius(sphere.center, sphere.radius);
        arrays.sphere_center_radius.push_back(center_radius);
        arrays.sphere_material.push_back(sphere.material);
        arrays.largest_coordinate = std::max(arrays.largest_coordinate, largest_coordinate(sphere_box(center_radius)));
    }
}

void append_planes(SceneArrays& arrays, const std::vector<Plane>& planes) {
    for (const Plane& plane : planes) {
        arrays.plane_point.push_back(glm::vec4(plane.point, 0.0f));
        arrays.plane_normal.push_back(glm::vec4(unit(plane.normal), 0.0f));
        arrays.plane_material.push_back(plane.material);
    }
}

void append_materials(SceneArrays& arrays, const Scene& scene) {
    std::size_t dielectric_count = 0;
    for (const Material& material : scene.materials) {
        arrays.materials.push_back(to_shared(material));
        if (material.kind == MaterialKind::dielectric) ++dielectric_count;
    }
    if (dielectric_count == 0) return;
    const bool is_one = dielectric_count == 1;
    arrays.warnings.push_back(
        {scene.file, 0,
         fmt::format("{} of {} materials {} dielectric; Castor does not refract yet: {} shaded as plain", dielectric_count,
                     scene.materials.size(), is_one ? "is" : "are", is_one ? "it is" : "they are")});
}

}  // namespace

SceneArrays flatten(const Scene& scene) {
    validate(scene);
    SceneArrays arrays;
    append_meshes(arrays, scene);
    append_spheres(arrays, scene.spheres);
    append_planes(arrays, scene.planes);
    append_materials(arrays, scene);
    for (const Light& light : scene.lights) arrays.lights.push_back(to_shared(light));
    arrays.background = scene.background;
    arrays.ambient_light = scene.ambient_light;
    arrays.shadow_ray_epsilon = scene.shadow_ray_epsilon;
    arrays.max_recursion_depth = scene.max_recursion_depth;
    return arrays;
}

}  // namespace castor
