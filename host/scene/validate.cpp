#include "scene/validate.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/box.h"
#include "base/vec3.h"
#include "castor/error.h"
#include "castor/shared/constants.h"
#include "scene/placement.h"

namespace castor {

namespace {

// The largest number of things that 32-bit indices can count: the last index is CASTOR_INVALID_INDEX, and the count
// itself must have 32 bits, too.
constexpr std::uint64_t kMaxCount = 0xfffffffeu;
constexpr float kFullAngle = 6.28318530717958647692f;
constexpr float kMaxCoordinate = CASTOR_MAX_COORDINATE;

// An element of the scene, with the name and the line that messages give it.
struct Element {
    const Scene& scene;
    std::size_t line;
    std::string name;

    [[noreturn]] void reject(const std::string& reason) const {
        throw SceneError(scene.file, line, fmt::format("{}: {}", name, reason));
    }
};

// Returns false for NaN, too.
bool is_in_range(float x) {
    return std::abs(x) <= kMaxCoordinate;
}
bool is_in_range(const glm::vec3& v) {
    return is_in_range(v.x) && is_in_range(v.y) && is_in_range(v.z);
}

// Refuses NaN, too.
void check_not_negative(const Element& element, const char* what, float x) {
    if (!(x >= 0.0f && std::isfinite(x)))
        element.reject(fmt::format("{} is {}, expected a number of at least 0", what, x));
}

void check_finite(const Element& element, const char* what, const glm::vec3& v) {
    if (!is_finite(v)) element.reject(fmt::format("{} is {}, expected finite numbers", what, text(v)));
}

void check_in_range(const Element& element, const char* what, const glm::vec3& v) {
    if (is_in_range(v)) return;
    element.reject(
        fmt::format("{} is {}, expected finite coordinates of magnitude at most {:g}", what, text(v), kMaxCoordinate));
}

void check_direction(const Element& element, const char* what, const glm::vec3& v) {
    check_finite(element, what, v);
    if (v == glm::vec3(0.0f)) element.reject(fmt::format("{} is (0, 0, 0), which has no direction", what));
}

void check_material_index(const Element& element, std::uint32_t material) {
    const std::size_t count = element.scene.materials.size();
    if (material >= count)
        element.reject(fmt::format("material index {}, but the scene has {} materials", material, count));
}

// Returns the smallest index for which the predicate holds, or `count`, so that the message does not depend on the
// threads.
template <class Predicate>
std::size_t first_index_where(std::size_t count, const Predicate& predicate) {
    using Range = tbb::blocked_range<std::size_t>;
    constexpr std::size_t kGrain = 16384;
    const auto search = [&](const Range& range, std::size_t best) {
        for (std::size_t i = range.begin(); i != range.end() && i < best; ++i) {
            if (predicate(i)) return i;
        }
        return best;
    };
    const auto smaller = [](std::size_t a, std::size_t b) { return std::min(a, b); };
    return tbb::parallel_reduce(Range(0, count, kGrain), count, search, smaller);
}

void check_vertices(const Element& element, const Mesh& mesh) {
    const auto& positions = mesh.positions;
    const auto& normals = mesh.normals;
    const std::size_t bad =
        first_index_where(positions.size(), [&](std::size_t i) { return !is_in_range(positions[i]); });
    if (bad < positions.size())
        check_in_range(element, fmt::format("position of vertex {}", bad).c_str(), positions[bad]);
    if (normals.empty()) return;
    if (normals.size() != positions.size()) {
        element.reject(
            fmt::format("{} normals for {} vertices, expected none or one for each", normals.size(), positions.size()));
    }
    // Normals need not have length one, but their squares must not overflow.
    const std::size_t bad_normal =
        first_index_where(normals.size(), [&](std::size_t i) { return !is_in_range(normals[i]); });
    if (bad_normal < normals.size()) {
        check_in_range(element, fmt::format("normal of vertex {}", bad_normal).c_str(), normals[bad_normal]);
    }
}

void check_triangles(const Element& element, const Mesh& mesh) {
    const std::size_t vertex_count = mesh.positions.size();
    const auto largest_index = [&](std::size_t i) {
        const glm::uvec3& triangle = mesh.triangles[i];
        return std::max({triangle.x, triangle.y, triangle.z});
    };
    const std::size_t bad =
        first_index_where(mesh.triangles.size(), [&](std::size_t i) { return largest_index(i) >= vertex_count; });
    if (bad == mesh.triangles.size()) return;
    const Element triangle{element.scene, element.line, fmt::format("{}, triangle {}", element.name, bad)};
    triangle.reject(fmt::format("vertex index {}, but the mesh has {} vertices", largest_index(bad), vertex_count));
}

// The limits under which the rounding errors stay within the bounds that InstanceBounds and ray.cl assume.
constexpr double kMaxCondition = 0x1p20;
constexpr double kMaxScale = 0x1p28;

void check_transform(const Element& element, const Transform& transform, bool is_placed) {
    for (int column = 0; column < 3; ++column) check_finite(element, "column of the transform", transform[column]);
    check_in_range(element, "translation of the transform", transform[3]);
    const TransformNorms size = norms(transform);
    if (!std::isfinite(size.back))
        element.reject("the transform has no inverse: it flattens space to a plane, a line or a point");
    if (!(size.forth * size.back <= kMaxCondition))
        element.reject(fmt::format(
            "the transform stretches one direction {:.3g} times as much as another, expected at most {:.3g} times",
            size.forth * size.back, kMaxCondition));
    if (is_placed && !(size.forth <= kMaxScale && size.back <= kMaxScale))
        element.reject(fmt::format(
            "the transform scales lengths by up to {:.3g} and its inverse by up to {:.3g}, expected at most {:.3g}",
            size.forth, size.back, kMaxScale));
}

// Checks the corners of the transformed box. `box` is not empty.
void check_placed_box(const Element& element, const Transform& transform, const Box& box) {
    for (int corner = 0; corner < 8; ++corner) {
        const glm::vec3 p(corner & 1 ? box.upper[0] : box.lower[0], corner & 2 ? box.upper[1] : box.lower[1],
                          corner & 4 ? box.upper[2] : box.lower[2]);
        check_in_range(element, "a corner of the transformed box", transformed_point(transform, p));
    }
}

Box box_of(const Mesh& mesh) {
    Box box;
    for (const glm::vec3& position : mesh.positions) box.extend(make_float4(position));
    return box;
}

void check_mesh(const Element& element, const Mesh& mesh) {
    check_material_index(element, mesh.material);
    check_vertices(element, mesh);
    check_triangles(element, mesh);
    if (mesh.transform == Transform(1.0f)) return;
    check_transform(element, mesh.transform, false);
    if (!mesh.positions.empty()) check_placed_box(element, mesh.transform, box_of(mesh));
}

void check_instances(const Scene& scene) {
    std::vector<Box> boxes(scene.meshes.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const MeshInstance& instance = scene.instances[i];
        const Element element{scene, instance.line, fmt::format("instance {}", i)};
        if (instance.mesh >= scene.meshes.size())
            element.reject(
                fmt::format("mesh index {}, but the scene has {} meshes", instance.mesh, scene.meshes.size()));
        check_material_index(element, instance.material);
        check_transform(element, instance.transform, true);
        const Mesh& mesh = scene.meshes[instance.mesh];
        if (mesh.positions.empty()) continue;
        Box& box = boxes[instance.mesh];
        if (box.lower[0] > box.upper[0]) box = box_of(mesh);
        check_placed_box(element, instance.transform, box);
    }
    const std::vector<bool> by_instance = meshes_placed_by_instances(scene);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
        if (by_instance[i])
            check_transform({scene, scene.meshes[i].line, fmt::format("mesh {}", i)}, scene.meshes[i].transform, true);
}

void check_sphere(const Element& element, const Sphere& sphere) {
    check_material_index(element, sphere.material);
    check_in_range(element, "center", sphere.center);
    if (!(sphere.radius > 0.0f) || !std::isfinite(sphere.radius)) {
        element.reject(fmt::format("radius is {}, expected a positive number", sphere.radius));
    }
    const Box box = sphere_box(glm::vec4(sphere.center, sphere.radius));
    check_in_range(element, "lower corner of the box (center - radius)",
                   glm::vec3(box.lower[0], box.lower[1], box.lower[2]));
    check_in_range(element, "upper corner of the box (center + radius)",
                   glm::vec3(box.upper[0], box.upper[1], box.upper[2]));
    if (sphere.transform == Transform(1.0f)) return;
    check_transform(element, sphere.transform, false);
    check_placed_box(element, sphere.transform, box);
    if (const auto world = sphere_in_world(sphere)) {
        if (!((*world).w > 0.0f)) element.reject("the transform leaves no radius: it is too small for a number");
    } else {
        check_transform(element, unit_sphere_transform(sphere), true);
    }
}

void check_plane(const Element& element, const Plane& plane) {
    check_material_index(element, plane.material);
    check_in_range(element, "point", plane.point);
    check_direction(element, "normal", plane.normal);
}

void check_material(const Element& element, const Material& material) {
    check_finite(element, "ambient reflectance", material.ambient);
    check_finite(element, "diffuse reflectance", material.diffuse);
    check_finite(element, "specular reflectance", material.specular);
    check_finite(element, "mirror reflectance", material.mirror);
    check_not_negative(element, "Phong exponent", material.phong_exponent);
    check_not_negative(element, "refraction index", material.refraction_index);
    check_not_negative(element, "absorption index", material.absorption_index);
}

void check_spot_light(const Element& element, const SpotLight& light) {
    check_in_range(element, "position", light.position);
    check_direction(element, "direction", light.direction);
    check_finite(element, "intensity", light.intensity);
    if (!(light.coverage_radians > 0.0f && light.coverage_radians <= kFullAngle)) {
        element.reject(
            fmt::format("coverage angle is {} radians, expected more than 0 and at most 2 pi", light.coverage_radians));
    }
    if (!(light.falloff_radians >= 0.0f && light.falloff_radians <= light.coverage_radians)) {
        element.reject(fmt::format("falloff angle is {} radians, expected 0 to the coverage angle, {} radians",
                                   light.falloff_radians, light.coverage_radians));
    }
}

void check_light(const Element& element, const Light& light) {
    switch (light.kind) {
        case Light::Kind::point:
            check_in_range(element, "position", light.point.position);
            check_finite(element, "intensity", light.point.intensity);
            return;
        case Light::Kind::directional:
            check_direction(element, "direction", light.directional.direction);
            check_finite(element, "radiance", light.directional.radiance);
            return;
        case Light::Kind::spot:
            check_spot_light(element, light.spot);
            return;
    }
    element.reject("its kind is none of point, directional and spot");
}

void check_globals(const Element& scene) {
    check_finite(scene, "background colour", scene.scene.background);
    check_finite(scene, "ambient light", scene.scene.ambient_light);
    const float epsilon = scene.scene.shadow_ray_epsilon;
    if (!(epsilon >= 0.0f && epsilon <= kMaxCoordinate)) {
        scene.reject(
            fmt::format("shadow ray epsilon is {}, expected a number from 0 to {:g}", epsilon, kMaxCoordinate));
    }
}

void check_counts(const Element& scene) {
    std::uint64_t vertices = 0;
    std::uint64_t primitives = scene.scene.spheres.size() + scene.scene.planes.size() +
                               1;  // the 1 is for the unit sphere that all ellipsoids share
    for (const Mesh& mesh : scene.scene.meshes) {
        vertices += mesh.positions.size();
        primitives += mesh.triangles.size();
    }
    const auto check = [&](std::uint64_t count, const char* what) {
        if (count > kMaxCount) scene.reject(fmt::format("{} {}, expected at most {}", count, what, kMaxCount));
    };
    check(vertices, "vertices");
    check(primitives, "primitives");
    check(scene.scene.materials.size(), "materials");
    check(scene.scene.lights.size(), "lights");
    check(scene.scene.instances.size() + scene.scene.meshes.size() + scene.scene.spheres.size(),
          "instances, meshes and spheres");
}

std::uint64_t element_count(const Mesh& mesh) {
    return mesh.triangles.size() + mesh.positions.size() + mesh.normals.size();
}

}  // namespace

std::uint64_t element_count(const Scene& scene) {
    std::uint64_t count = 0;
    for (const Mesh& mesh : scene.meshes) count += element_count(mesh);
    return count;
}

void validate(const Scene& scene, const Progress& progress) {
    ProgressCount elements_done(progress, element_count(scene));
    const Element whole{scene, 0, "scene"};
    check_counts(whole);
    check_globals(whole);
    const auto name = [](const char* kind, std::size_t i) { return fmt::format("{} {}", kind, i); };
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        check_material({scene, 0, name("material", i)}, scene.materials[i]);
    }
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        check_light({scene, scene.lights[i].line, name("light", i)}, scene.lights[i]);
    }
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        check_mesh({scene, scene.meshes[i].line, name("mesh", i)}, scene.meshes[i]);
        elements_done.add(element_count(scene.meshes[i]));
    }
    check_instances(scene);
    for (std::size_t i = 0; i < scene.spheres.size(); ++i) {
        check_sphere({scene, scene.spheres[i].line, name("sphere", i)}, scene.spheres[i]);
    }
    for (std::size_t i = 0; i < scene.planes.size(); ++i) {
        check_plane({scene, scene.planes[i].line, name("plane", i)}, scene.planes[i]);
    }
}

}  // namespace castor
