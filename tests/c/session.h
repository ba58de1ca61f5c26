#pragma once

#include <castor/castor_c.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "castor/scene.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

/// Checks that a call was done; its message if not.
inline void done(castor_status status) {
    INFO(castor_status_string(status) << ": " << castor_last_error_message());
    REQUIRE(status == CASTOR_STATUS_DONE);
}

/// A struct that begins with its size, else 0.
template <class Struct>
Struct sized() {
    Struct made{};
    made.size = sizeof(Struct);
    return made;
}

/// An owner of one reference, which `make(&handle)` gives.
template <class Type, void (*release)(Type*)>
class Handle {
public:
    template <class Make>
    explicit Handle(const Make& make) {
        done(make(&handle_));
        REQUIRE(handle_);
    }
    ~Handle() { release(handle_); }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    operator Type*() const { return handle_; }

private:
    Type* handle_ = nullptr;
};
using DevicesHandle = Handle<castor_devices, castor_devices_release>;
using SceneHandle = Handle<castor_scene, castor_scene_release>;
using BuiltSceneHandle = Handle<castor_built_scene, castor_built_scene_release>;
using TracerHandle = Handle<castor_tracer, castor_tracer_release>;
using CrossingsHandle = Handle<castor_crossings, castor_crossings_release>;
using RendererHandle = Handle<castor_renderer, castor_renderer_release>;
using FilmHandle = Handle<castor_film, castor_film_release>;

/// The devices under test.
inline castor_status select_test_devices(castor_devices** devices) {
    return castor_devices_select(std::getenv("CASTOR_TEST_DEVICE"), devices);
}

// One scene, made in C and in C++: a smooth and a flat mesh, instances, one of them mirrored, spheres and an ellipsoid,
// planes, materials and lights of all kinds.

inline const float kVertices[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0.5f, -1, 1, 0.25f};
inline const std::uint32_t kTriangles[] = {0, 1, 2, 0, 2, 3};
inline const float kNormals[] = {0, 0, 1, 0, 0.6f, 0.8f, 0.6f, 0, 0.8f, 0, 0, 1};
inline const float kMeshTransform[] = {1, 0, 0, -2, 0, 1, 0, 0.5f, 0, 0, 1, -1};
inline const std::uint32_t kInstanceMeshes[] = {1, 1};
inline const std::uint32_t kInstanceMaterials[] = {1, 2};
inline const float kInstanceTransforms[] = {0.5f, 0, 0, 1.5f, 0, 0.5f, 0, 1,  0, 0, 0.5f, 0,
                                            -1,   0, 0, 1.5f, 0, 1,    0, -1, 0, 0, 1,    -0.5f};
inline const float kSpheres[] = {0, 0, 1, 0.5f, 2, 0, -1, 0.25f};
inline const std::uint32_t kSphereMaterials[] = {2, 0};
inline const float kSphereTransforms[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0.25f, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0};
inline const float kPlanePoints[] = {0, -2, 0};
inline const float kPlaneNormals[] = {0, 2, 0.5f};

inline castor_mesh flat_mesh() {
    auto mesh = sized<castor_mesh>();
    mesh.vertices = kVertices;
    mesh.vertex_count = 4;
    mesh.triangles = kTriangles;
    mesh.triangle_count = 2;
    return mesh;
}

inline castor_camera test_camera() {
    auto camera = sized<castor_camera>();
    camera.position[2] = 6;
    camera.width = 40;
    camera.height = 32;
    camera.distance = 1.5f;
    return camera;
}

inline castor_status make_test_scene(castor_scene** target) {
    done(castor_scene_create(target));
    castor_scene* const scene = *target;
    auto settings = sized<castor_scene_settings>();
    done(castor_scene_get_settings(scene, &settings));
    settings.background[2] = 40;
    settings.ambient_light[0] = 20;
    settings.max_recursion_depth = 2;
    done(castor_scene_set_settings(scene, &settings));
    auto material = sized<castor_material>();
    material.ambient[0] = material.diffuse[1] = 0.5f;
    done(castor_scene_add_material(scene, &material, nullptr));
    material.kind = CASTOR_MATERIAL_KIND_MIRROR;
    material.mirror[0] = material.mirror[1] = 0.5f;
    material.specular[2] = 0.25f;
    material.phong_exponent = 8;
    done(castor_scene_add_material(scene, &material, nullptr));
    material.kind = CASTOR_MATERIAL_KIND_CONDUCTOR;
    material.refraction_index = 0.5f;
    material.absorption_index = 2;
    std::uint32_t index = 0;
    done(castor_scene_add_material(scene, &material, &index));
    CHECK(index == 2);
    auto light = sized<castor_light>();
    light.position[1] = light.position[2] = 5;
    light.intensity[0] = light.intensity[1] = 1000;
    done(castor_scene_add_light(scene, &light, nullptr));
    light.kind = CASTOR_LIGHT_KIND_DIRECTIONAL;
    light.intensity[0] = 10;
    done(castor_scene_add_light(scene, &light, nullptr));
    light.kind = CASTOR_LIGHT_KIND_SPOT;
    light.intensity[2] = 2000;
    light.coverage_radians = 1.5f;
    light.falloff_radians = 0.5f;
    done(castor_scene_add_light(scene, &light, nullptr));
    const castor_camera camera = test_camera();
    done(castor_scene_add_camera(scene, &camera, nullptr));
    castor_mesh mesh = flat_mesh();
    mesh.normals = kNormals;
    mesh.transform = kMeshTransform;
    done(castor_scene_add_mesh(scene, &mesh, nullptr));
    mesh = flat_mesh();
    mesh.material = 1;
    done(castor_scene_add_mesh(scene, &mesh, &index));
    CHECK(index == 1);
    done(castor_scene_add_instances(scene, 2, kInstanceMeshes, kInstanceMaterials, kInstanceTransforms, nullptr));
    done(castor_scene_add_spheres(scene, 2, kSpheres, kSphereMaterials, kSphereTransforms, nullptr));
    done(castor_scene_add_planes(scene, 1, kPlanePoints, kPlaneNormals, nullptr, &index));
    CHECK(index == 0);
    return CASTOR_STATUS_DONE;
}

inline Scene same_scene_in_cpp() {
    Scene scene;
    scene.background = {0, 0, 40};
    scene.ambient_light = {20, 0, 0};
    scene.max_recursion_depth = 2;
    Material material;
    material.ambient = {0.5f, 0, 0};
    material.diffuse = {0, 0.5f, 0};
    scene.materials.push_back(material);
    material.kind = MaterialKind::mirror;
    material.mirror = {0.5f, 0.5f, 0};
    material.specular = {0, 0, 0.25f};
    material.phong_exponent = 8;
    scene.materials.push_back(material);
    material.kind = MaterialKind::conductor;
    material.refraction_index = 0.5f;
    material.absorption_index = 2;
    scene.materials.push_back(material);
    scene.lights.resize(3);
    scene.lights[0].point = {{0, 5, 5}, {1000, 1000, 0}};
    scene.lights[1].kind = Light::Kind::directional;
    scene.lights[1].directional = {{0, -1, 0}, {10, 1000, 0}};
    scene.lights[2].kind = Light::Kind::spot;
    scene.lights[2].spot = {{0, 5, 5}, {0, -1, 0}, {10, 1000, 2000}, 1.5f, 0.5f};
    Camera camera;
    camera.position = {0, 0, 6};
    camera.width = 40;
    camera.height = 32;
    camera.distance = 1.5f;
    scene.cameras = {camera};
    Mesh mesh;
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0.5f}, {-1, 1, 0.25f}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.material = 1;
    scene.meshes = {mesh, mesh};
    scene.meshes[0].material = 0;
    scene.meshes[0].normals = {{0, 0, 1}, {0, 0.6f, 0.8f}, {0.6f, 0, 0.8f}, {0, 0, 1}};
    scene.meshes[0].transform[3] = {-2, 0.5f, -1};
    scene.instances.resize(2);
    scene.instances[0] = {1, Transform(0.5f), 1, 0};
    scene.instances[0].transform[3] = {1.5f, 1, 0};
    scene.instances[1] = {1, Transform(1.0f), 2, 0};
    scene.instances[1].transform[0] = {-1, 0, 0};
    scene.instances[1].transform[3] = {1.5f, -1, -0.5f};
    scene.spheres.resize(2);
    scene.spheres[0] = {{0, 0, 1}, 0.5f, 2, 0};
    scene.spheres[1] = {{2, 0, -1}, 0.25f, 0, 0};
    scene.spheres[1].transform[1] = {0.25f, 2, 0};
    scene.planes = {{{0, -2, 0}, {0, 2, 0.5f}, 0, 0}};
    return scene;
}

/// Rays through a grid before the scene, which meet everything in it, and nothing.
inline std::vector<castor_ray> test_rays() {
    std::vector<castor_ray> rays;
    for (int i = 0; i < 64; ++i)
        for (int j = 0; j < 64; ++j)
            rays.push_back({{-4 + float(i) / 8, -4 + float(j) / 8, 8}, 0, {0.03f, j % 2 ? -0.1f : 0.3f, -1}, INFINITY});
    return rays;
}

}  // namespace castor::test
