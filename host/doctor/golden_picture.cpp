#include "doctor/golden_picture.h"

#include <string>

#include "base/checksum.h"
#include "reference/meshes.h"

namespace castor::doctor {

namespace {

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

Material plain(glm::vec3 diffuse, float exponent) {
    Material material;
    material.ambient = diffuse;
    material.diffuse = diffuse;
    material.specular = glm::vec3(0.5f, 0.25f, 0.75f);
    material.phong_exponent = exponent;
    return material;
}

}  // namespace

Scene golden_scene() {
    // Numbers with few bits, so that no host rounds them otherwise.
    Scene scene;
    scene.background = {8, 16, 32};
    scene.ambient_light = {16, 24, 20};
    Material mirror = plain(glm::vec3(0.125f), 20);
    mirror.kind = MaterialKind::mirror;
    mirror.mirror = glm::vec3(0.75f, 0.5f, 0.625f);
    Material conductor = plain(glm::vec3(0.0625f), 3);
    conductor.kind = MaterialKind::conductor;
    conductor.mirror = glm::vec3(1.0f);
    conductor.refraction_index = 0.25f;
    conductor.absorption_index = 3.5f;
    scene.materials = {plain({0.75f, 0.25f, 0.5f}, 40), plain({0.25f, 0.5f, 0.75f}, 1.5f), mirror, conductor};

    Mesh cube = reference::moved(reference::cube_grid(3), 0.5f, {-1.25f, -0.5f, 0.25f});
    Mesh smooth = cube;
    smooth = reference::moved(smooth, 1.0f, {2.5f, 0.0f, -0.5f});
    for (const glm::vec3& p : smooth.positions) smooth.normals.push_back(p - glm::vec3(1.25f, -0.5f, -0.25f));
    smooth.material = 1;
    scene.meshes = {cube, smooth};
    const glm::vec3 x(0.25f, 0.5f, 0.0f), y(-0.375f, 0.25f, 0.125f), z(0.0f, 0.125f, -0.5f);
    scene.instances.push_back({0, Transform(x, y, z, {0.0f, 1.5f, -1.0f}), 1});
    scene.instances.push_back({0, Transform(y, z, x, {0.5f, 0.75f, 1.0f}), 2});
    scene.spheres = {{{0.0f, 0.0f, 0.0f}, 0.75f, 2, 0}, {{-0.5f, 0.875f, 1.25f}, 0.375f, 3, 0}};
    Sphere ellipsoid{{0.0f, 0.0f, 0.0f}, 0.5f, 0, 0};
    ellipsoid.transform = Transform(2.0f * x, y, z, {-1.5f, 1.25f, 0.0f});
    scene.spheres.push_back(ellipsoid);
    scene.planes = {{{0, -1, 0}, {0, 1, 0}, 1, 0}, {{0, 0, -3}, {0.25f, 0, 1}, 2, 0}};

    Light point, sun, spot;
    point.point = {{2, 4, 3}, {4000, 3000, 5000}};
    sun.kind = Light::Kind::directional;
    sun.directional = {{-0.5f, -1, -0.25f}, {40, 60, 50}};
    spot.kind = Light::Kind::spot;
    spot.spot = {{-2, 3, 2}, {2, -3, -2}, {6000, 6000, 2000}, 0.75f, 0.5f};
    scene.lights = {point, sun, spot};

    Camera camera;
    camera.position = {0.5f, 1, 4};
    camera.gaze = {-0.125f, -0.25f, -1};
    camera.distance = 1;
    camera.left = camera.bottom = -0.75f;
    camera.right = camera.top = 0.75f;
    camera.width = camera.height = 16;
    scene.cameras = {camera};
    return scene;
}

RenderOptions golden_options() {
    RenderOptions options;
    options.samples_per_pixel = 3;
    options.max_recursion_depth = 3;
    options.filter = ReconstructionFilter::gaussian;
    options.seed = 7;
    options.aovs = aov_names();
    std::erase(options.aovs, "lights");  // which are pictures of the same kind
    return options;
}

std::uint64_t film_checksum(const Film& film) {
    std::string bytes;
    append(bytes, film.pixels);
    append(bytes, film.done);
    for (const FilmPlane& plane : film.planes) {
        append(bytes, plane.values);
        append(bytes, plane.indices);
    }
    return checksum(bytes);
}

}  // namespace castor::doctor
