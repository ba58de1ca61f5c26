#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "castor/renderer.h"
#include "support/kernel_fixture.h"

namespace castor::test {

/// Adds the material and returns its number.
inline std::uint32_t add_material(Scene& scene, const Material& material) {
    scene.materials.push_back(material);
    return static_cast<std::uint32_t>(scene.materials.size() - 1);
}

inline Material ambient_material(const glm::vec3& ambient) {
    Material material;
    material.ambient = ambient;
    return material;
}
inline Material diffuse_material(const glm::vec3& diffuse) {
    Material material;
    material.diffuse = diffuse;
    return material;
}
inline Material mirror_material(const glm::vec3& mirror, MaterialKind kind = MaterialKind::mirror) {
    Material material;
    material.kind = kind;
    material.mirror = mirror;
    return material;
}

inline Light point_light(const glm::vec3& position, const glm::vec3& intensity) {
    Light light;
    light.kind = Light::Kind::point;
    light.point = {position, intensity};
    return light;
}
inline Light directional_light(const glm::vec3& direction, const glm::vec3& radiance) {
    Light light;
    light.kind = Light::Kind::directional;
    light.directional = {direction, radiance};
    return light;
}

/// Returns the planes that are made with the picture: aov_names() without those of lights, which are renders of their
/// own, and the one that denoising makes.
inline std::vector<std::string> eye_planes() {
    std::vector<std::string> names = aov_names();
    std::erase(names, "lights");
    std::erase(names, "noisy");
    return names;
}

/// Returns two triangles with corners centre +- u +- v, whose normal is along u x v.
inline Mesh rectangle(const glm::vec3& centre, const glm::vec3& u, const glm::vec3& v, std::uint32_t material) {
    Mesh mesh;
    mesh.positions = {centre - u - v, centre + u - v, centre + u + v, centre - u + v};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.material = material;
    return mesh;
}

/// Returns a camera with a square picture of the window [-half_width, half_width]^2 at distance 1 before `position`.
inline Camera square_camera(const glm::vec3& position, const glm::vec3& gaze, float half_width, std::uint32_t size) {
    Camera camera;
    camera.position = position;
    camera.gaze = gaze;
    camera.up = std::abs(gaze.y) < 0.9f * glm::length(gaze) ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1);
    camera.left = camera.bottom = -half_width;
    camera.right = camera.top = half_width;
    camera.width = camera.height = size;
    return camera;
}

/// A probe of the light along single rays: each is a picture of one pixel, whose centre lies straight ahead.
class Probe {
public:
    explicit Probe(const Scene& scene, const RendererOptions& options = {})
        : renderer_(scene, {test_device()}, options) {}

    glm::vec3 operator()(const glm::vec3& origin, const glm::vec3& direction, const RenderOptions& options = {}) {
        return renderer_.render(square_camera(origin, direction, 1.0f, 1), options).pixels.at(0);
    }
    glm::vec3 operator()(const glm::vec3& origin, const glm::vec3& direction, RuleSet rules) {
        RenderOptions options;
        options.rules = rules;
        return (*this)(origin, direction, options);
    }

private:
    Renderer renderer_;
};

/// Returns whether the values agree to 1e-5 of their size: a picture's value takes some tens of float operations with
/// an error of 6e-8 each, and a power multiplies the error of its base by the exponent.
inline bool is_close(const glm::vec3& found, const glm::dvec3& expected) {
    for (int i = 0; i < 3; ++i) {
        if (!(std::abs(found[i] - expected[i]) <= 1e-5 * std::abs(expected[i]))) return false;
    }
    return true;
}

inline std::string to_decimal(const glm::dvec3& v) {
    std::ostringstream text;
    text.precision(9);
    text << '(' << v.x << ", " << v.y << ", " << v.z << ')';
    return text.str();
}

template <class Value>
bool same_bytes(const std::vector<Value>& a, const std::vector<Value>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0);
}

inline bool same_bytes(const Film& a, const Film& b) {
    return same_bytes(a.pixels, b.pixels) && same_bytes(a.done, b.done) &&
           std::equal(a.planes.begin(), a.planes.end(), b.planes.begin(), b.planes.end(),
                      [](const FilmPlane& p, const FilmPlane& q) {
                          return p.name == q.name && same_bytes(p.values, q.values) && same_bytes(p.indices, q.indices);
                      });
}

inline bool all_finite(const Film& film) {
    return std::all_of(film.pixels.begin(), film.pixels.end(), [](const glm::vec3& pixel) {
        return std::isfinite(pixel.x) && std::isfinite(pixel.y) && std::isfinite(pixel.z);
    });
}

}  // namespace castor::test

/// Checks a pixel against its expected value; the message has both.
#define CASTOR_CHECK_CLOSE(found_expression, expected_expression)                           \
    do {                                                                                    \
        const glm::vec3 found_value = (found_expression);                                   \
        const glm::dvec3 expected_value(expected_expression);                               \
        INFO("found " << castor::test::to_decimal(glm::dvec3(found_value)) << ", expected " \
                      << castor::test::to_decimal(expected_value));                         \
        CHECK(castor::test::is_close(found_value, expected_value));                         \
    } while (false)
