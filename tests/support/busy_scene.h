#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "castor/device.h"
#include "castor/scene.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/picture.h"

namespace castor::test {

/// Smooth and flat meshes, spheres, planes, mirrors, instances of two meshes and of an ellipsoid.
inline Scene busy_scene() {
    RandomSource random(17);
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = glm::vec3(20);
    const std::uint32_t plain = add_material(scene, diffuse_material({0.5f, 0.3f, 0.2f}));
    const std::uint32_t mirror = add_material(scene, mirror_material(glm::vec3(0.6f)));
    Mesh smooth = bumpy_sphere(2), cube = cube_grid(3);
    compute_smooth_normals(smooth);
    smooth.material = mirror;
    scene.meshes = {random_triangles(random, 700, 0.15f), smooth, cube, moved(bumpy_sphere(2), 0.4f, {1.5f, 0, 0})};
    for (int i = 0; i < 40; ++i)
        scene.spheres.push_back({random.in_box(-2, 2), random.uniform_float(0.05f, 0.2f), i % 2 ? plain : mirror, 0});
    scene.spheres[0].transform[1] *= 2.0f;
    scene.planes = {{{0, -2, 0}, {0, 1, 0}, mirror, 0}};
    for (int i = 0; i < 6; ++i) {
        Transform transform(0.3f + 0.1f * static_cast<float>(i));
        transform[3] = random.in_box(-2, 2);
        scene.instances.push_back({static_cast<std::uint32_t>(1 + i % 2), transform, i % 3 ? plain : mirror});
    }
    scene.lights = {point_light({3, 4, 5}, glm::vec3(9000)), directional_light({1, -2, -1}, glm::vec3(60))};
    scene.max_recursion_depth = 2;
    Camera camera;
    camera.position = {0, 0.5f, 6};
    camera.gaze = {0, -0.05f, -1};
    camera.distance = 1.5f;
    camera.width = 36;
    camera.height = 28;
    scene.cameras = {camera};
    return scene;
}

inline std::vector<Ray> some_rays() {
    RandomSource random(52);
    std::vector<Ray> rays;
    for (int i = 0; i < 1500; ++i) rays.push_back(make_ray(random.in_box(-3, 3), random.in_box(-1, 1)));
    return rays;
}

/// As if it had memory of its own, half of which the scene may have.
inline Device with_little_memory(std::uint64_t bytes) {
    Device device = test_device();
    device.unified_memory = false;
    device.global_memory_bytes = bytes;
    return device;
}

}  // namespace castor::test
