#include "castor/ray_sets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "base/double_box.h"
#include "castor/error.h"
#include "render/camera.h"
#include "scene/placement.h"
#include "tune/random.h"

namespace castor {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kTile = 8;

glm::dvec3 random_direction(Random& random) {
    const double z = 1.0 - 2.0 * random.uniform(), angle = 6.283185307179586 * random.uniform();
    const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
    return {radius * std::cos(angle), radius * std::sin(angle), z};
}

Ray make_ray(const glm::dvec3& origin, const glm::dvec3& direction, float t_max) {
    const glm::vec3 o(origin), d(direction);
    return {{o.x, o.y, o.z}, 0.0f, {d.x, d.y, d.z}, t_max};
}

glm::dvec3 vector(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}

/// Returns the box of all bounded geometry, or one around the camera if there is none.
DoubleBox bound(const Scene& scene) {
    DoubleBox box;
    for (const Mesh& mesh : scene.meshes)
        for (const glm::vec3& position : mesh.positions) box.include(transformed_point(mesh.transform, position));
    // A mesh may have many instances: only the corners of its box are transformed.
    std::vector<DoubleBox> boxes(scene.meshes.size());
    for (const MeshInstance& instance : scene.instances) {
        DoubleBox& of_mesh = boxes[instance.mesh];
        if (of_mesh.is_empty())
            for (const glm::vec3& position : scene.meshes[instance.mesh].positions) of_mesh.include(position);
        if (of_mesh.is_empty()) continue;
        for (int corner = 0; corner < 8; ++corner)
            box.include(transformed_point(instance.transform, of_mesh.corner(corner)));
    }
    for (const Sphere& sphere : scene.spheres) {
        const Transform transform = unit_sphere_transform(sphere);
        const glm::dvec3 center(transform[3]), x(transform[0]), y(transform[1]), z(transform[2]);
        const glm::dvec3 half = glm::sqrt(x * x + y * y + z * z);  // of the box of an ellipsoid
        box.include(center - half);
        box.include(center + half);
    }
    if (box.is_empty()) {
        const glm::dvec3 eye(scene.cameras[0].position);
        box = {eye - 1.0, eye + 1.0};
    }
    return box;
}

/// The scene's primitives, by the numbers that hits have.
class Surfaces {
public:
    explicit Surfaces(const Scene& scene) : scene_(scene) {
        const std::vector<bool> by_instance = meshes_placed_by_instances(scene);
        for (const MeshInstance& instance : scene.instances)
            placed_.push_back({&scene.meshes[instance.mesh], instance.transform});
        for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
            if (by_instance[i]) {
                placed_.push_back({&scene.meshes[i], scene.meshes[i].transform});
                continue;
            }
            meshes_.push_back(&scene.meshes[i]);
            first_.push_back(triangle_count_);
            triangle_count_ += scene.meshes[i].triangles.size();
        }
        for (const Sphere& sphere : scene.spheres) {
            if (const auto world = sphere_in_world(scene, sphere))
                spheres_.push_back(glm::vec3(*world));
            else
                placed_.push_back({nullptr, unit_sphere_transform(sphere)});
        }
    }

    /// Returns the unit normal, or zero on a triangle without area.
    glm::dvec3 normal(const Hit& hit, const glm::dvec3& point) const {
        const glm::dvec3 n = direction_of_normal(hit, point);
        const double length = glm::length(n);
        return length > 0.0 ? n / length : glm::dvec3(0.0);
    }

private:
    struct Placed {
        const Mesh* mesh;  // null: the unit sphere
        Transform transform;
    };

    glm::dvec3 direction_of_normal(const Hit& hit, const glm::dvec3& point) const {
        if (hit.instance > placed_.size()) return glm::dvec3(0.0);  // a wrong answer, which another check finds
        if (hit.instance > 0) {
            const Placed& placed = placed_[hit.instance - 1];
            const glm::dmat3 matrix = normal_matrix(placed.transform);
            if (placed.mesh) return matrix * triangle_normal(*placed.mesh, hit.primitive);
            return matrix * (glm::transpose(matrix) * (point - glm::dvec3(placed.transform[3])));
        }
        std::size_t primitive = hit.primitive;
        if (primitive < triangle_count_) {
            const std::size_t m = std::upper_bound(first_.begin(), first_.end(), primitive) - first_.begin() - 1;
            return normal_matrix(meshes_[m]->transform) * triangle_normal(*meshes_[m], primitive - first_[m]);
        }
        primitive -= triangle_count_;
        if (primitive < spheres_.size()) return point - glm::dvec3(spheres_[primitive]);
        return scene_.planes[primitive - spheres_.size()].normal;
    }

    static glm::dvec3 triangle_normal(const Mesh& mesh, std::size_t triangle) {
        const glm::uvec3 corners = mesh.triangles[triangle];
        const glm::dvec3 p0 = mesh.positions[corners.x];
        return glm::cross(glm::dvec3(mesh.positions[corners.y]) - p0, glm::dvec3(mesh.positions[corners.z]) - p0);
    }

    const Scene& scene_;
    // What instance 0 holds.
    std::vector<const Mesh*> meshes_;
    std::vector<std::size_t> first_;
    std::size_t triangle_count_ = 0;
    std::vector<glm::vec3> spheres_;  // centers
    std::vector<Placed> placed_;      // instances from 1 on
};

std::vector<Ray> primary_rays(const Scene& scene, std::uint32_t size) {
    Camera picture = scene.cameras[0];
    picture.width = picture.height = size;
    const shared::Camera camera = make_camera(picture, scene.file);
    const glm::dvec3 corner = vector(camera.corner), step_x = vector(camera.step_x), step_y = vector(camera.step_y);
    std::vector<Ray> rays;
    rays.reserve(std::size_t{size} * size);
    for (std::uint32_t tile_y = 0; tile_y < size; tile_y += kTile)
        for (std::uint32_t tile_x = 0; tile_x < size; tile_x += kTile)
            for (std::uint32_t k = 0; k < kTile * kTile; ++k) {
                const double x = tile_x + k % kTile + 0.5, y = tile_y + k / kTile + 0.5;
                Ray ray = make_ray(vector(camera.position), corner + x * step_x - y * step_y, camera.t_max);
                ray.t_min = camera.t_min;
                rays.push_back(ray);
            }
    return rays;
}

std::vector<Ray> random_rays(const DoubleBox& box, std::uint32_t size, Random random) {
    std::vector<Ray> rays(std::size_t{size} * size);
    for (Ray& ray : rays) {
        // One statement each, because the order of evaluation of arguments is not defined.
        glm::dvec3 share;
        for (int axis = 0; axis < 3; ++axis) share[axis] = random.uniform();
        ray = make_ray(box.lower + share * box.extent(), random_direction(random), kInfinity);
    }
    return rays;
}

/// A point where a ray meets the scene, a little off the surface on the ray's side.
struct SurfacePoint {
    glm::dvec3 point;
    glm::dvec3 normal;  // towards the ray's origin
};

std::vector<SurfacePoint> surface_points(const Scene& scene, Tracer& tracer, const std::vector<Ray>& rays,
                                         double offset) {
    std::vector<Hit> hits(rays.size());
    tracer.closest_hit(rays, hits, Coherence::coherent);
    const Surfaces surfaces(scene);
    std::vector<SurfacePoint> points;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].primitive == CASTOR_INVALID_INDEX) continue;
        const glm::dvec3 direction = vector(rays[i].direction);
        const glm::dvec3 point = vector(rays[i].origin) + double(hits[i].t) * direction;
        glm::dvec3 normal = surfaces.normal(hits[i], point);
        if (glm::dot(normal, direction) > 0.0) normal = -normal;
        points.push_back({point + offset * normal, normal});
    }
    return points;
}

glm::dvec3 light_position(const Scene& scene, double extent) {
    for (const Light& light : scene.lights)
        if (light.kind == Light::Kind::point) return light.point.position;
    const Camera& camera = scene.cameras[0];
    const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(camera.gaze), glm::dvec3(camera.up)));
    return glm::dvec3(camera.position) + extent * (0.3 * right + 0.5 * glm::normalize(glm::dvec3(camera.up)));
}

/// Makes rays that reach the light at t = 1.
std::vector<Ray> shadow_rays(const std::vector<SurfacePoint>& points, const glm::dvec3& light) {
    std::vector<Ray> rays;
    for (const SurfacePoint& at : points) rays.push_back(make_ray(at.point, light - at.point, 1.0f));
    return rays;
}

std::vector<Ray> diffuse_rays(const std::vector<SurfacePoint>& points, Random random) {
    std::vector<Ray> rays;
    for (const SurfacePoint& at : points) {
        // The normal plus a uniform point of the unit sphere is distributed by the cosine.
        const glm::dvec3 sum = at.normal + random_direction(random);
        const double length = glm::length(sum);
        rays.push_back(make_ray(at.point, length > 1e-6 ? sum / length : at.normal, kInfinity));
    }
    return rays;
}

}  // namespace

std::string_view to_string(RayKind kind) {
    switch (kind) {
        case RayKind::primary:
            return "primary";
        case RayKind::shadow:
            return "shadow";
        case RayKind::diffuse:
            return "diffuse";
        case RayKind::random:
            return "random";
    }
    return "";
}

RayKind ray_kind_from_string(std::string_view word) {
    for (const RayKind kind : kRayKinds)
        if (to_string(kind) == word) return kind;
    throw UsageError(fmt::format("there are no rays \"{}\"; there are primary, shadow, diffuse and random", word));
}

std::vector<RaySet> make_ray_sets(const Scene& scene, Tracer& tracer, const std::vector<RayKind>& kinds,
                                  std::uint32_t size, std::uint32_t seed) {
    if (scene.cameras.empty()) throw SceneError(scene.file, 0, "the scene has no camera, whose rays could be measured");
    const DoubleBox box = bound(scene);
    const double extent = glm::length(box.extent());
    constexpr double kOffset =
        1e-4;  // relative to the scene's extent: far above rounding, far below a visible distance
    const std::vector<Ray> primary = primary_rays(scene, size);
    const std::vector<SurfacePoint> points = surface_points(scene, tracer, primary, kOffset * extent);

    std::vector<RaySet> sets;
    for (const RayKind kind : kinds) {
        switch (kind) {
            case RayKind::primary:
                sets.push_back({kind, Query::closest, Coherence::coherent, primary});
                break;
            case RayKind::shadow:
                sets.push_back(
                    {kind, Query::any, Coherence::coherent, shadow_rays(points, light_position(scene, extent))});
                break;
            case RayKind::diffuse:
                sets.push_back({kind, Query::closest, Coherence::incoherent, diffuse_rays(points, Random(seed))});
                break;
            case RayKind::random:
                sets.push_back({kind, Query::closest, Coherence::incoherent, random_rays(box, size, Random(seed))});
                break;
        }
    }
    return sets;
}

}  // namespace castor
