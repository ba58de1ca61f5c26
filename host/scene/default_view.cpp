#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "base/double_box.h"
#include "castor/scene_io.h"

namespace castor {

namespace {

constexpr std::uint32_t kImageSize = 1024;
constexpr double kHalfFieldOfView = 0.305;  // radians: 35 degrees in all
constexpr double kMargin = 1.06;
// The unit of light makes a white surface white at 255.
constexpr glm::vec3 kBackground{46.0f, 52.0f, 60.0f};
constexpr glm::vec3 kAmbient{25.5f};

glm::dvec3 transformed(const Transform& transform, const glm::dvec3& point) {
    return glm::dmat4x3(transform) * glm::dvec4(point, 1.0);
}

/// Calls `visit` with points whose convex hull contains all bounded geometry.
template <class Visit>
void for_each_point(const Scene& scene, const Visit& visit) {
    const auto visit_if_usable = [&](const glm::dvec3& point) {
        // The squares of larger distances exceed single precision. NaN fails the comparison and is left out, too.
        constexpr double kFarthest = 1e17;
        for (int i = 0; i < 3; ++i) {
            if (!(std::abs(point[i]) <= kFarthest)) return;
        }
        visit(point);
    };
    for (const Mesh& mesh : scene.meshes) {
        for (const glm::vec3& position : mesh.positions) visit_if_usable(transformed(mesh.transform, position));
    }
    // A mesh may have many instances: the corners of its box stand for it.
    std::vector<DoubleBox> boxes(scene.meshes.size());
    for (const MeshInstance& instance : scene.instances) {
        if (instance.mesh >= scene.meshes.size()) continue;
        DoubleBox& box = boxes[instance.mesh];
        if (box.is_empty())
            for (const glm::vec3& position : scene.meshes[instance.mesh].positions) box.include(position);
        if (box.is_empty()) continue;
        for (int corner = 0; corner < 8; ++corner) visit_if_usable(transformed(instance.transform, box.corner(corner)));
    }
    for (const Sphere& sphere : scene.spheres) {
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
            visit_if_usable(
                transformed(sphere.transform, glm::dvec3(sphere.center) + static_cast<double>(sphere.radius) * sign));
        }
    }
}

/// Returns the box of all bounded geometry, enlarged if it is a point; a unit box if there is no geometry.
DoubleBox bound(const Scene& scene) {
    DoubleBox box;
    for_each_point(scene, [&](const glm::dvec3& point) { box.include(point); });
    if (box.is_empty()) box.include(glm::dvec3(0.0));
    if (glm::length(box.extent()) == 0.0) {
        const glm::dvec3 half(std::max(0.5, 1e-3 * glm::length(box.center())));
        box = {box.center() - half, box.center() + half};
    }
    return box;
}

/// A side of a box, by its axis and its end.
struct Side {
    int axis;
    bool is_upper;
};
constexpr std::array<Side, 6> kSides = {{{2, true}, {0, true}, {0, false}, {2, false}, {1, false}, {1, true}}};
constexpr int kHorizontalSides = 4;  // the first of kSides; the front is +z

/// Returns the share of each side of the box that is covered by triangles that lie nearly in it.
std::array<double, 6> covered_shares(const Scene& scene, const DoubleBox& box) {
    constexpr double kNearly = 0.03;
    const glm::dvec3 extent = box.extent();
    std::array<double, 6> covered{};
    for (const Mesh& mesh : scene.meshes) {
        for (const glm::uvec3& triangle : mesh.triangles) {
            if (std::max({triangle.x, triangle.y, triangle.z}) >= mesh.positions.size()) continue;
            const glm::dvec3 p[3] = {transformed(mesh.transform, mesh.positions[triangle.x]),
                                     transformed(mesh.transform, mesh.positions[triangle.y]),
                                     transformed(mesh.transform, mesh.positions[triangle.z])};
            for (std::size_t s = 0; s < kSides.size(); ++s) {
                const int axis = kSides[s].axis;
                const double plane = kSides[s].is_upper ? box.upper[axis] : box.lower[axis];
                const auto is_in_side = [&](const glm::dvec3& point) {
                    return std::abs(point[axis] - plane) <= kNearly * extent[axis];
                };
                if (!is_in_side(p[0]) || !is_in_side(p[1]) || !is_in_side(p[2])) continue;
                covered[s] += 0.5 * std::abs(glm::cross(p[1] - p[0], p[2] - p[0])[axis]);
            }
        }
    }
    for (std::size_t s = 0; s < kSides.size(); ++s) {
        const int a = (kSides[s].axis + 1) % 3, b = (kSides[s].axis + 2) % 3;
        covered[s] /= extent[a] * extent[b];
    }
    return covered;
}

/// Returns the open side of a room, which has walls on the five other sides of its box; things may cover a part of the
/// open side. Returns null if the scene is no such room.
const Side* find_open_side(const Scene& scene, const DoubleBox& box) {
    constexpr double kWall = 0.75, kOpen = 0.35;
    const glm::dvec3 extent = box.extent();
    if (std::min({extent.x, extent.y, extent.z}) <= 0.0) return nullptr;
    const std::array<double, 6> covered = covered_shares(scene, box);
    const Side* open = nullptr;
    for (std::size_t s = 0; s < kSides.size(); ++s) {
        if (covered[s] >= kWall) continue;
        if (covered[s] > kOpen || s >= kHorizontalSides || open != nullptr) return nullptr;
        open = &kSides[s];
    }
    return open;
}

/// The position of the eye relative to the target.
struct View {
    glm::dvec3 target;
    glm::dvec3 right, up, back;  // of length one; `back` points to the eye
    double distance;             // of the eye from the target
};

View make_view(const Scene& scene, const DoubleBox& box, const glm::dvec3& back) {
    View view{box.center(), {}, {}, glm::normalize(back), 0.5 * glm::length(box.extent())};
    view.right = glm::normalize(glm::cross(glm::dvec3(0.0, 1.0, 0.0), view.back));
    view.up = glm::cross(view.back, view.right);
    // The smallest distance at which every point is in the pyramid that the eye sees.
    const double slope = std::tan(kHalfFieldOfView) / kMargin;
    for_each_point(scene, [&](const glm::dvec3& point) {
        const glm::dvec3 p = point - view.target;
        const double aside = std::max(std::abs(glm::dot(p, view.right)), std::abs(glm::dot(p, view.up)));
        view.distance = std::max(view.distance, glm::dot(p, view.back) + aside / slope);
    });
    return view;
}

Camera make_camera(const View& view) {
    Camera camera;
    camera.position = view.target + view.distance * view.back;
    camera.gaze = -view.back;
    camera.up = view.up;
    camera.distance = static_cast<float>(view.distance);  // so that the image plane is at the model, whatever its size
    camera.right = camera.top = static_cast<float>(view.distance * std::tan(kHalfFieldOfView));
    camera.left = camera.bottom = -camera.right;
    camera.width = camera.height = kImageSize;
    return camera;
}

Light directional(const glm::dvec3& towards_light, const glm::vec3& radiance) {
    Light light;
    light.kind = Light::Kind::directional;
    light.directional = {-glm::normalize(towards_light), radiance};
    return light;
}

/// Returns the key, fill and rim light of a photographer's studio, placed relative to the eye.
std::vector<Light> studio_lights(const View& view) {
    return {directional(-0.6 * view.right + 0.75 * view.up + 0.8 * view.back, {225.0f, 220.0f, 208.0f}),
            directional(0.9 * view.right + 0.15 * view.up + 0.6 * view.back, {46.0f, 52.0f, 64.0f}),
            directional(0.5 * view.right + 0.7 * view.up - 0.8 * view.back, {110.0f, 115.0f, 125.0f})};
}

/// Returns a lamp in the upper half, towards the open side, and a weak light from that side.
std::vector<Light> room_lights(const View& view, const DoubleBox& box) {
    const glm::dvec3 extent = box.extent();
    Light lamp;
    lamp.kind = Light::Kind::point;
    lamp.point.position = box.center() + glm::dvec3(0.0, 0.2 * extent.y, 0.0) + 0.15 * extent * view.back;
    // The lamp makes a white surface at this distance white.
    const double reach = 0.5 * std::max({extent.x, extent.y, extent.z});
    lamp.point.intensity = glm::vec3(static_cast<float>(255.0 * reach * reach));
    return {lamp, directional(view.back, glm::vec3(50.0f))};
}

Material clay() {
    Material material;
    material.diffuse = {0.82f, 0.66f, 0.53f};
    material.ambient = material.diffuse;
    material.specular = glm::vec3(0.18f);
    material.phong_exponent = 30.0f;
    return material;
}

}  // namespace

void add_default_view(Scene& scene) {
    const DoubleBox box = bound(scene);
    const Side* open = find_open_side(scene, box);
    View view;
    if (open == nullptr) {
        view = make_view(scene, box, {0.5, 0.38, 1.0});
    } else {
        // The view into a room is straight, so that it shows the walls.
        glm::dvec3 back(0.0);
        back[open->axis] = open->is_upper ? 1.0 : -1.0;
        view = make_view(scene, box, back);
    }
    if (scene.cameras.empty()) {
        scene.cameras.push_back(make_camera(view));
        scene.background = kBackground;
        // Some 40 times what the coordinates of a hit are rounded by, so that thin things in wide scenes keep their
        // shadows.
        const glm::dvec3 farthest = glm::max(glm::abs(box.lower), glm::abs(box.upper));
        scene.shadow_ray_epsilon =
            static_cast<float>(1e-6 * (glm::length(box.extent()) + std::max({farthest.x, farthest.y, farthest.z})));
    }
    if (scene.lights.empty()) {
        scene.lights = open == nullptr ? studio_lights(view) : room_lights(view, box);
        scene.ambient_light = open == nullptr ? kAmbient : 1.6f * kAmbient;  // as light that the walls reflect
    }
    if (scene.materials.empty()) scene.materials.push_back(clay());
}

}  // namespace castor
