#include <cmath>
#include <glm/geometric.hpp>

#include "castor/scene_io.h"
#include "support/catch.h"

namespace castor {
namespace {

/// Two triangles for the square a b c d.
void add_square(Mesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c, d});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
}

/// The box [lower, upper] as a mesh, without its side at +z where that is open.
Mesh make_box(const glm::vec3& lower, const glm::vec3& upper, bool is_open) {
    const auto corner = [&](int x, int y, int z) {
        return glm::vec3(x ? upper.x : lower.x, y ? upper.y : lower.y, z ? upper.z : lower.z);
    };
    Mesh mesh;
    add_square(mesh, corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0), corner(1, 0, 0));
    add_square(mesh, corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0));
    add_square(mesh, corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1), corner(1, 0, 1));
    add_square(mesh, corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1));
    add_square(mesh, corner(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0));
    if (!is_open) add_square(mesh, corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1));
    return mesh;
}

/// Where `point` appears: x and y in [-1, 1] across the picture. z: its depth, positive in front.
glm::dvec3 project(const Camera& camera, const glm::vec3& point) {
    const glm::dvec3 back = -glm::normalize(glm::dvec3(camera.gaze));
    const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(camera.up), back));
    const glm::dvec3 up = glm::cross(back, right);
    const glm::dvec3 offset = glm::dvec3(point) - glm::dvec3(camera.position);
    const double depth = -glm::dot(offset, back);
    return {glm::dot(offset, right) * camera.distance / depth / camera.right,
            glm::dot(offset, up) * camera.distance / depth / camera.top, depth};
}

TEST_CASE("The default camera sees the whole model, well filled, at any size and place", "[default_view]") {
    for (const float size : {1e-12f, 1e-3f, 1.0f, 1e3f, 1e12f}) {
        for (const glm::vec3& place : {glm::vec3(0.0f), glm::vec3(40.0f, -30.0f, 10.0f)}) {
            for (const glm::vec3& shape :
                 {glm::vec3(1, 1, 1), glm::vec3(1, 8, 1), glm::vec3(9, 0.1f, 1), glm::vec3(1, 1, 0)}) {
                CAPTURE(size, place.x, shape.x, shape.y, shape.z);
                Scene scene;
                scene.meshes = {make_box(size * place, size * (place + shape), false)};
                add_default_view(scene);
                REQUIRE(scene.cameras.size() == 1);
                const Camera& camera = scene.cameras[0];
                CHECK(camera.width == 1024);
                CHECK(camera.height == 1024);
                double widest = 0.0;
                for (const glm::vec3& position : scene.meshes[0].positions) {
                    const glm::dvec3 seen = project(camera, position);
                    CHECK(seen.z > 0.0);
                    widest = std::max({widest, std::abs(seen.x), std::abs(seen.y)});
                }
                CHECK(widest < 0.99);
                CHECK(widest > 0.8);
                const glm::vec3 far = glm::max(glm::abs(place), glm::abs(place + shape));
                const float farthest = std::max({far.x, far.y, far.z});
                CHECK(scene.shadow_ray_epsilon == Approx(1e-6 * size * (glm::length(shape) + farthest)));
                CHECK(camera.position.y > size * place.y);
                CHECK(scene.lights.size() == 3);
                REQUIRE(scene.materials.size() == 1);
                CHECK(glm::length(scene.materials[0].diffuse) > 0.0f);
            }
        }
    }
}

TEST_CASE("Shadow rays of a model far from the origin begin farther from it", "[default_view]") {
    Scene scene;
    scene.meshes = {make_box(glm::dvec3(1e7, 0, 0), glm::dvec3(1e7 + 1000, 1000, 1000), false)};
    add_default_view(scene);
    CHECK(scene.shadow_ray_epsilon == Approx(10.0).epsilon(0.01));  // coordinates are rounded to 1
}

TEST_CASE("A room that is open on one side is looked into, with a lamp inside", "[default_view]") {
    Scene scene;
    scene.meshes = {make_box({-1, 0, -1}, {1, 2, 1}, true), make_box({-0.5f, 0.0f, -0.5f}, {0, 1, 0}, false)};
    add_default_view(scene);
    const Camera& camera = scene.cameras.at(0);
    CHECK(camera.gaze == glm::vec3(0, 0, -1));
    CHECK(camera.position.z > 1.0f);
    REQUIRE(scene.lights.at(0).kind == Light::Kind::point);
    const glm::vec3 lamp = scene.lights[0].point.position;
    CHECK(std::abs(lamp.x) < 1.0f);
    CHECK(lamp.y > 1.0f);
    CHECK(lamp.y < 2.0f);
    CHECK(std::abs(lamp.z) < 1.0f);
}

TEST_CASE("The default view leaves what a scene has", "[default_view]") {
    Scene scene;
    scene.meshes = {make_box({0, 0, 0}, {1, 1, 1}, false)};
    scene.cameras.resize(2);
    scene.cameras[1].image_name = "mine.png";
    scene.lights.resize(1);
    scene.materials.resize(1);
    scene.background = glm::vec3(7.0f);
    scene.shadow_ray_epsilon = 0.5f;
    add_default_view(scene);
    CHECK(scene.cameras.size() == 2);
    CHECK(scene.cameras[1].image_name == "mine.png");
    CHECK(scene.lights.size() == 1);
    CHECK(scene.materials.size() == 1);
    CHECK(scene.background == glm::vec3(7.0f));
    CHECK(scene.shadow_ray_epsilon == 0.5f);
}

TEST_CASE("The default view of next to nothing is still finite", "[default_view]") {
    std::vector<Scene> scenes(4);
    scenes[1].planes.resize(1);
    scenes[2].meshes.resize(1);
    scenes[2].meshes[0].positions = {{3, 3, 3}, {NAN, 0, 0}, {INFINITY, 0, 0}};
    scenes[3].spheres = {{{3e38f, 0, 0}, 3e38f, 0, 0}, {{1, 2, 3}, 2, 0, 0}};
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        CAPTURE(i);
        add_default_view(scenes[i]);
        const Camera& camera = scenes[i].cameras.at(0);
        for (int k = 0; k < 3; ++k) {
            CHECK(std::isfinite(camera.position[k]));
            CHECK(std::isfinite(camera.gaze[k]));
            CHECK(std::isfinite(camera.up[k]));
        }
        CHECK(camera.right > 0.0f);
        CHECK(std::isfinite(camera.distance));
        CHECK(camera.distance > 0.0f);
    }
}

}  // namespace
}  // namespace castor
