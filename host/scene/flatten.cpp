#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "base/box.h"
#include "scene/environment_table.h"
#include "scene/light_tree.h"
#include "scene/mesh_hull.h"
#include "scene/placement.h"
#include "scene/principled.h"
#include "scene/scene_arrays.h"
#include "scene/texture_columns.h"
#include "scene/validate.h"

namespace castor {

namespace {

void store(float (&to)[3], const glm::vec3& from) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

// Computes in double precision, where no finite float vector underflows or overflows.
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

/// Which material each object has. One that is a light has a material of no other object, so that whatever a ray meets
/// names the light: a copy, if need be, which follows the scene's own materials.
struct ObjectMaterials {
    std::vector<std::uint32_t> of_mesh, of_sphere, of_instance;
    std::vector<std::uint32_t> copied;  // indices in Scene::materials
};

bool is_object(const Light& light) {
    return light.kind == Light::Kind::mesh || light.kind == Light::Kind::sphere || light.kind == Light::Kind::instance;
}

/// Of a light that is an object.
std::uint32_t& material_of(ObjectMaterials& materials, const Light& light) {
    std::vector<std::uint32_t>& of_kind = light.kind == Light::Kind::mesh     ? materials.of_mesh
                                          : light.kind == Light::Kind::sphere ? materials.of_sphere
                                                                              : materials.of_instance;
    return of_kind[light.object.object];
}

ObjectMaterials object_materials(const Scene& scene) {
    ObjectMaterials materials;
    std::vector<std::size_t> uses(scene.materials.size());
    for (const Mesh& mesh : scene.meshes) ++uses[materials.of_mesh.emplace_back(mesh.material)];
    for (const Sphere& sphere : scene.spheres) ++uses[materials.of_sphere.emplace_back(sphere.material)];
    for (const Plane& plane : scene.planes) ++uses[plane.material];
    for (const MeshInstance& instance : scene.instances) ++uses[materials.of_instance.emplace_back(instance.material)];
    for (const Light& light : scene.lights) {
        if (!is_object(light)) continue;
        std::uint32_t& material = material_of(materials, light);
        if (material >= scene.materials.size() || uses[material] == 1) continue;
        materials.copied.push_back(material);
        material = static_cast<std::uint32_t>(scene.materials.size() + materials.copied.size() - 1);
    }
    return materials;
}

shared::Material to_shared(const Material& material) {
    shared::Material result{};
    result.light = result.principled = CASTOR_INVALID_INDEX;
    store(result.emission, emission_of(material));
    if (material.principled) {
        result.kind = CASTOR_MATERIAL_PRINCIPLED;
        store(result.absorption, absorption_of(*material.principled));
        store(result.scattering_albedo, scattering_albedo_of(*material.principled));
        store(result.diffuse, material.principled->base_color);  // for the plane of albedos
        return result;
    }
    if (material.emission != glm::vec3(0.0f)) return result;  // and it reflects nothing
    store(result.ambient, material.ambient);
    store(result.diffuse, material.diffuse);
    store(result.specular, material.specular);
    store(result.mirror, material.mirror);
    result.phong_exponent = material.phong_exponent;
    result.refraction_index = material.refraction_index;
    result.absorption_index = material.absorption_index;
    result.kind = kind_code(material.kind);
    store(result.absorption, material.absorption);
    result.roughness = material.roughness;
    result.brdf = static_cast<std::uint32_t>(material.brdf) | (material.brdf_normalized ? CASTOR_BRDF_NORMALIZED : 0u) |
                  (material.diffuse_fresnel ? CASTOR_BRDF_DIFFUSE_FRESNEL : 0u);
    return result;
}

shared::Light to_shared(const PointLight& light) {
    shared::Light result{};
    result.kind = CASTOR_LIGHT_POINT;
    store(result.position, light.position);
    store(result.intensity, light.intensity);
    result.size = 1.0f / light.range;
    return result;
}

shared::Light to_shared(const DirectionalLight& light) {
    shared::Light result{};
    result.kind = CASTOR_LIGHT_DIRECTIONAL;
    store(result.direction, unit(light.direction));
    store(result.intensity, light.radiance);
    result.size = static_cast<float>(2.0 * std::pow(std::sin(0.25 * double{light.angle_radians}), 2.0));
    return result;
}

shared::Light to_shared(const SpotLight& light) {
    // The float next to 2 pi is larger than 2 pi; its cosine must be that of the full sphere all the same.
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
    static_assert(static_cast<int>(SpotFalloff::square) == CASTOR_SPOT_SQUARE);
    result.mapping = static_cast<std::uint32_t>(light.falloff);
    result.size = 1.0f / light.range;
    return result;
}

shared::Light to_shared(const AreaLight& light) {
    const glm::dvec3 normal = glm::normalize(glm::dvec3(light.normal));
    const glm::dvec3 size = glm::abs(normal);
    const int smallest = size.x <= size.y && size.x <= size.z ? 0 : size.y <= size.z ? 1 : 2;
    glm::dvec3 aside(0.0);
    aside[smallest] = 1.0;
    shared::Light result{};
    result.kind = CASTOR_LIGHT_AREA;
    store(result.position, light.position);
    store(result.direction, glm::vec3(normal));
    store(result.tangent, glm::vec3(glm::normalize(glm::cross(aside, normal))));
    store(result.intensity, light.radiance);
    result.size = light.size;
    return result;
}

const PrincipledMaterial::TextureIndex& emission_texture(const Material& material) {
    static const PrincipledMaterial::TextureIndex none;
    return material.principled ? material.principled->emissive_texture : none;
}

// Returns the coordinates of vertices in a material's texture of emission; null: there are none, or all are (0, 0).
const glm::vec2* emission_coordinates(const Scene& scene, const Mesh& mesh, const Material& material) {
    const auto& texture = emission_texture(material);
    if (!texture) return nullptr;
    const bool is_second = scene.textures[*texture].coordinate_set == 1;
    const auto& coordinates = is_second ? mesh.texture_coordinates_1 : mesh.texture_coordinates;
    return coordinates.empty() ? nullptr : coordinates.data();
}

// Whether light passes the surface: then its far sides are seen as well.
bool is_clear(const Material& material) {
    if (!material.principled) return material.kind == MaterialKind::dielectric;
    return material.principled->transmission > 0.0f || material.principled->diffuse_transmission > 0.0f;
}

// Says of the light of a mesh where it is, and what of it hides the rest.
void set_hull(shared::Light& light, const Mesh& mesh, const Transform& transform, const Material& material) {
    glm::vec3 lower(std::numeric_limits<float>::infinity()), upper = -lower;
    for (const glm::uvec3& triangle : mesh.triangles) {
        for (int i = 0; i < 3; ++i) {
            const glm::vec3 corner = transformed_point(transform, mesh.positions[triangle[i]]);
            lower = glm::min(lower, corner);
            upper = glm::max(upper, corner);
        }
    }
    store(light.position, 0.5f * lower + 0.5f * upper);
    store(light.tangent, 0.5f * upper - 0.5f * lower);
    if (is_clear(material)) return;
    const MeshHull hull = hull_of(mesh.positions, mesh.triangles);
    if (hull == MeshHull::open) return;
    const bool is_inward = (hull == MeshHull::closed_inward) != (glm::determinant(glm::dmat3(transform)) < 0.0);
    light.mapping = is_inward ? CASTOR_MESH_CLOSED_INWARD : CASTOR_MESH_CLOSED;
}

// Whether a ray that meets the mesh finds a normal other than its triangle's, by more than a file's rounding.
bool has_smooth_normals(const Mesh& mesh) {
    constexpr double kSmallestAngle = 1e-4;
    if (mesh.normals.empty()) return false;
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const glm::uvec3& triangle) {
        const glm::dvec3 origin(mesh.positions[triangle.x]);
        const glm::dvec3 across = glm::cross(glm::dvec3(mesh.positions[triangle.y]) - origin,
                                             glm::dvec3(mesh.positions[triangle.z]) - origin);
        for (int i = 0; i < 3; ++i) {
            const glm::dvec3 normal(mesh.normals[triangle[i]]);
            if (glm::length(glm::cross(across, normal)) > kSmallestAngle * glm::length(across) * glm::length(normal))
                return true;
        }
        return false;
    });
}

// Makes the emitters of a mesh that lights others, where a transform and a motion place it. Areas are summed in double
// precision, in the order of triangles.
shared::Light mesh_light(SceneArrays& arrays, const Scene& scene, const Mesh& mesh, const Transform& transform,
                         const glm::vec3& motion, const Material& material) {
    const auto corner = [&](std::uint32_t vertex) { return transformed_point(transform, mesh.positions[vertex]); };
    const auto area = [&](const glm::uvec3& triangle) {
        const glm::dvec3 origin(corner(triangle.x));
        return glm::length(
            glm::cross(glm::dvec3(corner(triangle.y)) - origin, glm::dvec3(corner(triangle.z)) - origin));
    };
    shared::Light light{};
    light.kind = CASTOR_LIGHT_MESH;
    light.sampling = has_smooth_normals(mesh) ? CASTOR_MESH_SMOOTH : CASTOR_MESH_FLAT;
    light.first = static_cast<std::uint32_t>(arrays.emitters.size());
    store(light.intensity, emission_of(material));
    store(light.direction, motion);
    const glm::vec2* const uvs = emission_coordinates(scene, mesh, material);
    double total = 0.0;  // twice the area
    for (const glm::uvec3& triangle : mesh.triangles) total += area(triangle);
    if (!(total > 0.0)) return light;
    light.size = static_cast<float>(0.5 * total);
    double sum = 0.0;
    std::uint32_t begin = 0;
    for (const glm::uvec3& triangle : mesh.triangles) {
        const double double_area = area(triangle);
        sum += double_area;
        const auto end = static_cast<std::uint32_t>(std::min(1.0, sum / total) * CASTOR_EMITTER_PARTS + 0.5);
        if (end == begin) continue;
        shared::Emitter emitter{};
        store(emitter.corner, corner(triangle.x));
        store(emitter.edge_u, corner(triangle.y) - corner(triangle.x));
        store(emitter.edge_v, corner(triangle.z) - corner(triangle.x));
        emitter.inverse_double_area = static_cast<float>(std::clamp(1.0 / double_area, 0x1p-100, 0x1p100));
        for (int i = 0; uvs && i < 2; ++i) {
            emitter.uv[i] = uvs[triangle.x][i];
            emitter.uv_u[i] = uvs[triangle.y][i] - uvs[triangle.x][i];
            emitter.uv_v[i] = uvs[triangle.z][i] - uvs[triangle.x][i];
        }
        emitter.begin = std::exchange(begin, end);
        emitter.end = end;
        arrays.emitters.push_back(emitter);
    }
    light.count = static_cast<std::uint32_t>(arrays.emitters.size()) - light.first;
    set_hull(light, mesh, transform, material);
    return light;
}

shared::Light mesh_light(SceneArrays& arrays, const Scene& scene, std::uint32_t number) {
    const Mesh& mesh = scene.meshes[number];
    return mesh_light(arrays, scene, mesh, mesh.transform, mesh.motion, scene.materials[mesh.material]);
}

shared::Light instance_light(SceneArrays& arrays, const Scene& scene, std::uint32_t number) {
    const MeshInstance& instance = scene.instances[number];
    return mesh_light(arrays, scene, scene.meshes[instance.mesh], instance.transform, instance.motion,
                      scene.materials[instance.material]);
}

// `instance`: that places the sphere, if one does.
shared::Light sphere_light(const Scene& scene, const Sphere& sphere, std::uint32_t instance) {
    shared::Light light{};
    light.kind = CASTOR_LIGHT_SPHERE;
    store(light.intensity, emission_of(scene.materials[sphere.material]));
    store(light.direction, sphere.motion);
    if (const auto world = sphere_in_world(sphere)) {
        store(light.position, glm::vec3(*world));
        light.size = world->w;
        return light;
    }
    const glm::vec4 in_object = sphere_in_object(scene, sphere);
    store(light.position, glm::vec3(in_object));
    light.size = in_object.w;
    light.first = instance;
    return light;
}

std::uint32_t sampling_code(EnvironmentSampling sampling) {
    switch (sampling) {
        case EnvironmentSampling::uniform:
            return CASTOR_ENVIRONMENT_UNIFORM;
        case EnvironmentSampling::cosine:
            return CASTOR_ENVIRONMENT_COSINE;
        default:
            return CASTOR_ENVIRONMENT_PICTURE;
    }
}

// Makes the table of an environment that is sampled by its picture.
shared::Light environment_light(SceneArrays& arrays, const Scene& scene, const EnvironmentLight& light) {
    shared::Light result{};
    result.kind = CASTOR_LIGHT_ENVIRONMENT;
    result.first = light.image;
    result.mapping = light.mapping == EnvironmentMapping::probe ? CASTOR_ENVIRONMENT_PROBE : CASTOR_ENVIRONMENT_LATLONG;
    result.sampling = sampling_code(light.sampling);
    if (light.sampling == EnvironmentSampling::picture)
        result.count = append_environment_table(arrays.environment_parts, scene.images[light.image], light.mapping);
    return result;
}

// `sphere_instances`: what append_geometries gave.
shared::Light to_shared(SceneArrays& arrays, const Scene& scene, const std::vector<std::uint32_t>& sphere_instances,
                        const Light& light) {
    const std::uint32_t object = light.object.object;
    switch (light.kind) {
        case Light::Kind::directional:
            return to_shared(light.directional);
        case Light::Kind::spot:
            return to_shared(light.spot);
        case Light::Kind::area:
            return to_shared(light.area);
        case Light::Kind::mesh:
            return mesh_light(arrays, scene, object);
        case Light::Kind::instance:
            return instance_light(arrays, scene, object);
        case Light::Kind::sphere:
            return sphere_light(scene, scene.spheres[object], sphere_instances[object]);
        case Light::Kind::environment:
            return environment_light(arrays, scene, light.environment);
        default:
            return to_shared(light.point);
    }
}

// Properties of triangles that are found while they are copied.
struct TriangleFacts {
    std::size_t degenerate_count = 0;
    float largest_coordinate = 0.0f;
};

TriangleFacts operator+(const TriangleFacts& a, const TriangleFacts& b) {
    return {a.degenerate_count + b.degenerate_count, std::max(a.largest_coordinate, b.largest_coordinate)};
}

// Writes the triangles of a mesh whose vertices are `positions` from `destination` on, with indices that count from
// `first_vertex`.
TriangleFacts copy_triangles(const Mesh& mesh, const glm::vec3* positions, std::uint32_t first_vertex,
                             glm::uvec3* destination, ProgressCount& elements_done) {
    using Range = tbb::blocked_range<std::size_t>;
    constexpr std::size_t kGrain = 8192;
    const auto copy = [&](const Range& range, TriangleFacts facts) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            const glm::uvec3 triangle = mesh.triangles[i];
            const glm::vec3 &p0 = positions[triangle.x], &p1 = positions[triangle.y], &p2 = positions[triangle.z];
            if (is_degenerate(p0, p1, p2)) {
                destination[i] = glm::uvec3(first_vertex + triangle.x);
                ++facts.degenerate_count;
            } else {
                destination[i] = first_vertex + triangle;
                facts.largest_coordinate =
                    std::max(facts.largest_coordinate, largest_coordinate(triangle_box(p0, p1, p2)));
            }
        }
        elements_done.add(range.size());
        return facts;
    };
    return tbb::parallel_reduce(Range(0, mesh.triangles.size(), kGrain), TriangleFacts{}, copy,
                                [](const TriangleFacts& a, const TriangleFacts& b) { return a + b; });
}

// Texture coordinates are of use to textures, and to anisotropy, which lies along them.
bool has_uvs(const Scene& scene, const Mesh& mesh) {
    if (mesh.texture_coordinates.empty()) return false;
    return !scene.textures.empty() || std::any_of(scene.materials.begin(), scene.materials.end(), [](const auto& m) {
        return m.principled && m.principled->anisotropy > 0.0f;
    });
}

bool has_attributes(const Mesh& mesh) {
    return !mesh.texture_coordinates_1.empty() || !mesh.colors.empty() || !mesh.tangents.empty();
}

// Tangents are not normalised: what interpolates them does.
void append_attributes(SceneArrays& arrays, const Mesh& mesh, const Transform& transform) {
    const glm::mat3 linear(transform);
    const float sign = glm::determinant(linear) < 0.0f ? -1.0f : 1.0f;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        shared::VertexAttributes& attributes = arrays.vertex_attributes.emplace_back(shared::VertexAttributes{});
        const glm::vec4 color = mesh.colors.empty() ? glm::vec4(1.0f) : mesh.colors[i];
        const glm::vec4 tangent = mesh.tangents.empty() ? glm::vec4(0.0f) : mesh.tangents[i];
        const glm::vec3 turned = linear * glm::vec3(tangent);
        for (int c = 0; c < 3; ++c) attributes.tangent[c] = turned[c];
        attributes.tangent[3] = sign * tangent.w;
        for (int c = 0; c < 4; ++c) attributes.color[c] = color[c];
        if (mesh.texture_coordinates_1.empty()) continue;
        attributes.uv_1[0] = mesh.texture_coordinates_1[i].x;
        attributes.uv_1[1] = mesh.texture_coordinates_1[i].y;
    }
}

void reserve_meshes(SceneArrays& arrays, const Scene& scene) {
    const MeshCounts counts = mesh_counts(scene);
    arrays.vertex_position.reserve(counts.vertices);
    arrays.vertex_normal.reserve(counts.normals);
    arrays.vertex_uv.reserve(counts.texture_coordinates);
    arrays.vertex_attributes.reserve(counts.attributes);
    arrays.triangle_vertices.reserve(counts.triangles);
    arrays.mesh_ranges.reserve(counts.ranges);
}

void append_vertices(SceneArrays& arrays, const Mesh& mesh, const Transform& transform, ProgressCount& elements_done) {
    constexpr std::size_t kOften = 1 << 16;
    std::size_t count = 0;
    const auto count_one = [&] {
        if (++count % kOften == 0) elements_done.add(kOften);
    };
    if (transform == Transform(1.0f)) {
        arrays.vertex_position.insert(arrays.vertex_position.end(), mesh.positions.begin(), mesh.positions.end());
        arrays.vertex_normal.insert(arrays.vertex_normal.end(), mesh.normals.begin(), mesh.normals.end());
        return;
    }
    for (const glm::vec3& position : mesh.positions) {
        arrays.vertex_position.push_back(transformed_point(transform, position));
        count_one();
    }
    // Normals are not normalised one by one, so that interpolation between them gives the transformed normal that the
    // mesh itself would interpolate.
    const glm::dmat3 matrix = normal_matrix(transform);
    const double scale = 1.0 / row_norm(matrix);
    for (const glm::vec3& normal : mesh.normals) {
        arrays.vertex_normal.push_back(glm::vec3(scale * (matrix * glm::dvec3(normal))));
        count_one();
    }
}

/// A mesh of a scene, by its index, and how many of its triangles have no area.
struct Degenerate {
    std::size_t mesh, triangles;
};

/// Warns of the first mesh, and of the others by their number.
void warn_of(const std::vector<Degenerate>& meshes, const Scene& scene, std::vector<Warning>& warnings) {
    if (meshes.empty()) return;
    const auto [number, degenerate] = meshes.front();
    const Mesh& mesh = scene.meshes[number];
    std::string text = fmt::format("{}: {} of {} triangles {} no area and cannot be hit",
                                   mesh.name.empty() ? fmt::format("mesh {}", number) : mesh.name, degenerate,
                                   mesh.triangles.size(), degenerate == 1 ? "has" : "have");
    if (meshes.size() > 1) {
        std::size_t others = 0;
        for (std::size_t i = 1; i < meshes.size(); ++i) others += meshes[i].triangles;
        text += fmt::format(" (and so for {} in {} more)", others, meshes.size() - 1);
    }
    warnings.push_back({scene.file, mesh.line, text});
}

// Appends a mesh to the geometry that was begun last. Returns how many of its triangles have no area.
std::size_t append_mesh(SceneArrays& arrays, const Scene& scene, std::size_t number, std::uint32_t material,
                        const Transform& transform, ProgressCount& elements_done) {
    const Mesh& mesh = scene.meshes[number];
    if (mesh.triangles.empty()) return 0;
    const std::size_t first_triangle = arrays.triangle_count();
    shared::MeshRange range{};
    range.first_triangle = static_cast<std::uint32_t>(first_triangle);
    range.first_vertex = static_cast<std::uint32_t>(arrays.vertex_position.size());
    range.first_normal =
        mesh.normals.empty() ? CASTOR_INVALID_INDEX : static_cast<std::uint32_t>(arrays.vertex_normal.size());
    range.material = material;
    range.first_uv = CASTOR_INVALID_INDEX;
    if (has_uvs(scene, mesh)) {
        range.first_uv = static_cast<std::uint32_t>(arrays.vertex_uv.size());
        arrays.vertex_uv.insert(arrays.vertex_uv.end(), mesh.texture_coordinates.begin(),
                                mesh.texture_coordinates.end());
    }
    range.first_attributes = CASTOR_INVALID_INDEX;
    if (has_attributes(mesh)) {
        range.first_attributes = static_cast<std::uint32_t>(arrays.vertex_attributes.size());
        append_attributes(arrays, mesh, transform);
    }
    arrays.mesh_ranges.push_back(range);
    append_vertices(arrays, mesh, transform, elements_done);
    arrays.triangle_vertices.resize(first_triangle + mesh.triangles.size());
    const TriangleFacts facts =
        copy_triangles(mesh, arrays.vertex_position.data() + range.first_vertex, range.first_vertex,
                       arrays.triangle_vertices.data() + first_triangle, elements_done);
    shared::Geometry& geometry = arrays.geometries.back();
    geometry.triangle_count += static_cast<std::uint32_t>(mesh.triangles.size());
    geometry.largest_coordinate = std::max(geometry.largest_coordinate, facts.largest_coordinate);
    return facts.degenerate_count;
}

void append_sphere(SceneArrays& arrays, const glm::vec4& center_radius, std::uint32_t material) {
    arrays.sphere_center_radius.push_back(center_radius);
    arrays.sphere_material.push_back(material);
    shared::Geometry& geometry = arrays.geometries.back();
    ++geometry.sphere_count;
    geometry.largest_coordinate = std::max(geometry.largest_coordinate, largest_coordinate(sphere_box(center_radius)));
}

// Begins a geometry and returns its number.
std::uint32_t begin_geometry(SceneArrays& arrays) {
    shared::Geometry geometry{};
    geometry.first_triangle = static_cast<std::uint32_t>(arrays.triangle_count());
    geometry.first_sphere = static_cast<std::uint32_t>(arrays.sphere_count());
    arrays.geometries.push_back(geometry);
    return static_cast<std::uint32_t>(arrays.geometries.size() - 1);
}

// Appends all geometries and instances. Meshes and spheres that are placed once are transformed to the world, so that a
// ray need not be. All others are placed by instances, in the order that Scene describes. Returns for each sphere the
// instance that places it; 0: none.
std::vector<std::uint32_t> append_geometries(SceneArrays& arrays, const Scene& scene, const ObjectMaterials& materials,
                                             const Progress& progress) {
    ProgressCount elements_done(progress, element_count(scene));
    const std::vector<bool> by_instance = meshes_placed_by_instances(scene);
    std::vector<std::uint32_t> geometry_of_mesh(scene.meshes.size(), 0);
    reserve_meshes(arrays, scene);
    std::vector<Degenerate> degenerate;
    const auto append = [&](std::size_t i, const Transform& transform) {
        const std::size_t count = append_mesh(arrays, scene, i, materials.of_mesh[i], transform, elements_done);
        if (count > 0) degenerate.push_back({i, count});
    };
    begin_geometry(arrays);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
        if (!by_instance[i]) append(i, scene.meshes[i].transform);
    for (std::size_t i = 0; i < scene.spheres.size(); ++i)
        if (const auto world = sphere_in_world(scene, scene.spheres[i]))
            append_sphere(arrays, *world, materials.of_sphere[i]);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        if (!by_instance[i]) continue;
        geometry_of_mesh[i] = begin_geometry(arrays);
        append(i, Transform(1.0f));
    }
    warn_of(degenerate, scene, arrays.warnings);

    arrays.instances.push_back(make_instance(Transform(1.0f), 0, 0));
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const MeshInstance& instance = scene.instances[i];
        arrays.instances.push_back(make_instance(instance.transform, geometry_of_mesh[instance.mesh],
                                                 materials.of_instance[i], instance.motion));
    }
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
        if (by_instance[i])
            arrays.instances.push_back(make_instance(scene.meshes[i].transform, geometry_of_mesh[i],
                                                     materials.of_mesh[i], scene.meshes[i].motion));
    std::uint32_t unit_sphere = 0;
    std::vector<std::uint32_t> sphere_instances(scene.spheres.size(), 0);
    for (std::size_t i = 0; i < scene.spheres.size(); ++i) {
        const Sphere& sphere = scene.spheres[i];
        const std::uint32_t material = materials.of_sphere[i];
        if (sphere_in_world(scene, sphere)) continue;
        sphere_instances[i] = static_cast<std::uint32_t>(arrays.instances.size());
        if (has_own_space(scene, sphere)) {
            arrays.instances.push_back(
                make_instance(sphere.transform, begin_geometry(arrays), material, sphere.motion));
            append_sphere(arrays, sphere_in_object(scene, sphere), material);
            continue;
        }
        if (unit_sphere == 0) {
            unit_sphere = begin_geometry(arrays);
            append_sphere(arrays, sphere_in_object(scene, sphere), material);
        }
        arrays.instances.push_back(make_instance(unit_sphere_transform(sphere), unit_sphere, material, sphere.motion));
    }
    if (arrays.instances.size() == 1) arrays.instances.clear();
    return sphere_instances;
}

void append_planes(SceneArrays& arrays, const std::vector<Plane>& planes) {
    for (const Plane& plane : planes) {
        arrays.plane_point.push_back(glm::vec4(plane.point, 0.0f));
        arrays.plane_normal.push_back(glm::vec4(unit(plane.normal), 0.0f));
        arrays.plane_material.push_back(plane.material);
    }
}

void append_materials(SceneArrays& arrays, const Scene& scene, const ObjectMaterials& materials) {
    for (const Material& material : scene.materials) {
        shared::Material& added = arrays.materials.emplace_back(to_shared(material));
        added.number = static_cast<std::uint32_t>(arrays.materials.size() - 1);
        if (material.principled) {
            added.principled = static_cast<std::uint32_t>(arrays.principled_materials.size());
            arrays.principled_materials.push_back(to_shared(*material.principled));
            continue;
        }
        if (material.emission != glm::vec3(0.0f)) continue;  // what emits has no reflectances to change
        added.first_texture = static_cast<std::uint32_t>(arrays.texture_uses.size());
        added.texture_count = static_cast<std::uint32_t>(material.textures.size());
        arrays.texture_uses.insert(arrays.texture_uses.end(), material.textures.begin(), material.textures.end());
    }
    for (const std::uint32_t number : materials.copied)
        arrays.materials.push_back(shared::Material(arrays.materials[number]));
}

// Appends the lights. Materials of those that rays can meet get their numbers.
void append_lights(SceneArrays& arrays, const Scene& scene, ObjectMaterials& materials,
                   const std::vector<std::uint32_t>& sphere_instances) {
    for (const Light& light : scene.lights) {
        shared::Light& added = arrays.lights.emplace_back(to_shared(arrays, scene, sphere_instances, light));
        added.principled = CASTOR_INVALID_INDEX;
        const auto number = static_cast<std::uint32_t>(arrays.lights.size() - 1);
        if (!is_object(light) || (added.kind != CASTOR_LIGHT_SPHERE && added.count == 0)) continue;
        shared::Material& material = arrays.materials[material_of(materials, light)];
        material.light = number;
        if (added.kind == CASTOR_LIGHT_MESH && emission_texture(scene.materials[material.number]))
            added.principled = material.principled;
    }
}

}  // namespace

MeshCounts mesh_counts(const Scene& scene) {
    MeshCounts counts;
    for (const Mesh& mesh : scene.meshes) {
        if (mesh.triangles.empty()) continue;
        counts.vertices += mesh.positions.size();
        counts.normals += mesh.normals.size();
        if (has_uvs(scene, mesh)) counts.texture_coordinates += mesh.texture_coordinates.size();
        if (has_attributes(mesh)) counts.attributes += mesh.positions.size();
        counts.triangles += mesh.triangles.size();
        ++counts.ranges;
    }
    return counts;
}

SceneArrays flatten(const Scene& scene, const Progress& progress) {
    constexpr double kValidating = 0.3;  // share of the time
    validate(scene, progress.part(0.0, kValidating));
    SceneArrays arrays;
    ObjectMaterials materials = object_materials(scene);
    const std::vector<std::uint32_t> sphere_instances =
        append_geometries(arrays, scene, materials, progress.part(kValidating, 1.0));
    append_planes(arrays, scene.planes);
    append_materials(arrays, scene, materials);
    append_textures(arrays, scene);
    append_lights(arrays, scene, materials, sphere_instances);
    build_light_tree(arrays, scene.images);
    arrays.background = scene.background;
    arrays.ambient_light = scene.ambient_light;
    arrays.shadow_ray_epsilon = scene.shadow_ray_epsilon;
    arrays.max_recursion_depth = scene.max_recursion_depth;
    arrays.background_texture = scene.background_texture.value_or(CASTOR_INVALID_INDEX);
    arrays.shades_both_sides = scene.shades_both_sides;
    return arrays;
}

}  // namespace castor
