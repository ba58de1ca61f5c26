// Instanced scenes beside the same scenes with every instance written out as a mesh of its own.
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "reference/meshes.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "trace/scene_contents.h"

namespace castor::test {

namespace {

using glm::vec3;

glm::dmat3 linear_part(const Transform& t) {
    return {glm::dvec3(t[0]), glm::dvec3(t[1]), glm::dvec3(t[2])};
}

/// The mesh as it stands in the world, with smooth normals by the inverse transpose. Mirrored ones must be smooth: the
/// winding turns.
Mesh written_out(Mesh mesh, const Transform& transform, std::uint32_t material) {
    const glm::dmat3 linear = linear_part(transform), normals = glm::transpose(glm::inverse(linear));
    for (vec3& p : mesh.positions) p = vec3(linear * glm::dvec3(p) + glm::dvec3(transform[3]));
    for (vec3& n : mesh.normals) n = vec3(normals * glm::dvec3(n));
    mesh.transform = Transform(1.0f);
    mesh.material = material;
    return mesh;
}

Scene stage() {
    Scene scene = scene_of({});
    scene.materials = {
        {.ambient = vec3(1), .diffuse = vec3(0.8f, 0.5f, 0.3f), .specular = vec3(0.2f), .phong_exponent = 20},
        {.kind = MaterialKind::mirror, .ambient = vec3(1), .diffuse = vec3(0.3f, 0.4f, 0.8f), .mirror = vec3(0.4f)}};
    scene.planes.push_back({vec3(0, -1.5f, 0), vec3(0, 1, 0), 0, 0});
    scene.ambient_light = vec3(20);
    scene.lights = {{.point = {.position = {3, 5, 6}, .intensity = vec3(12000)}}};
    Camera camera;
    camera.position = {0, 1, 6};
    camera.gaze = {0, -0.15f, -1};
    camera.distance = 1.5f;
    camera.width = camera.height = 96;
    scene.cameras = {camera};
    return scene;
}

/// Turned about (0, 1, 1) by an angle, after a scaling.
Transform placed(vec3 scale, double angle, vec3 translation) {
    const glm::dvec3 a = glm::normalize(glm::dvec3(0, 1, 1));
    const double c = std::cos(angle), s = std::sin(angle);
    const auto turned = [&](const glm::dvec3& v) {
        return c * v + s * glm::cross(a, v) + (1 - c) * glm::dot(a, v) * a;
    };
    return Transform(vec3(turned({scale.x, 0, 0})), vec3(turned({0, scale.y, 0})), vec3(turned({0, 0, scale.z})),
                     translation);
}

/// The share of pixels that differ by more than one of 255.
double different_share(const Film& a, const Film& b) {
    REQUIRE(a.pixels.size() == b.pixels.size());
    std::size_t different = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        const vec3 apart = glm::abs(a.pixels[i] - b.pixels[i]);
        different += apart.x > 1 || apart.y > 1 || apart.z > 1;
    }
    return static_cast<double>(different) / static_cast<double>(a.pixels.size());
}

Film render(const Scene& scene, Strategy strategy = Strategy::automatic) {
    Renderer renderer(scene, {test_device()}, {.strategy = strategy});
    return renderer.render(scene.cameras.at(0));
}

}  // namespace

TEST_CASE("an instanced scene looks as it does written out", "[instances]") {
    for (const bool smooth : {false, true}) {
        CAPTURE(smooth);
        Mesh mesh = bumpy_sphere(2);
        if (smooth) compute_smooth_normals(mesh);
        Scene instanced = stage(), written = stage();
        mesh.transform = placed({1, 0.6f, 1.2f}, 0.5, {-1.5f, 0, 0});
        instanced.meshes = {mesh};
        written.meshes = {written_out(mesh, mesh.transform, 0)};
        for (int i = 0; i < 5; ++i) {
            const float mirror = smooth && i % 2 ? -1.0f : 1.0f;
            const Transform transform = placed({0.5f * mirror, 0.4f + 0.1f * static_cast<float>(i), 0.5f}, i,
                                               {static_cast<float>(i) - 1.5f, 0.3f * static_cast<float>(i % 3), 1});
            instanced.instances.push_back({0, transform, static_cast<std::uint32_t>(i % 2)});
            written.meshes.push_back(written_out(mesh, transform, static_cast<std::uint32_t>(i % 2)));
        }
        const Film expected = render(written), found = render(instanced);
        CHECK(different_share(found, expected) < 0.005);
        Scene empty = stage();
        CHECK(different_share(found, render(empty)) > 0.1);
        for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide}) {
            CAPTURE(to_string(strategy));
            CHECK(render(instanced, strategy).pixels == found.pixels);
        }
    }
}

TEST_CASE("a mesh that is placed once looks as it does written out", "[instances]") {
    Scene moved = stage(), written = stage();
    Mesh mesh = bumpy_sphere(2);
    compute_smooth_normals(mesh);
    mesh.transform = placed({1, 0.6f, 1.2f}, 0.5, {-1, 0, 0});
    moved.meshes = {mesh};
    written.meshes = {written_out(mesh, mesh.transform, 0)};
    CHECK(different_share(render(moved), render(written)) < 0.001);
}

TEST_CASE("a mirrored flat mesh keeps its outside", "[instances]") {
    Scene mirrored = stage(), plain = stage();
    mirrored.meshes = {cube_grid(2)};  // as its own mirror image
    mirrored.meshes[0].transform = Transform(vec3(-1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), vec3(0));
    plain.meshes = {cube_grid(2)};
    CHECK(different_share(render(mirrored), render(plain)) < 0.005);
}

TEST_CASE("transformed spheres look as ellipsoids do", "[instances]") {
    // A sphere that is only moved and scaled alike stays one.
    Scene moved = stage(), plain = stage();
    moved.spheres = {
        {vec3(1, 0, 0), 0.5f, 0, 0, Transform(vec3(0, 2, 0), vec3(-2, 0, 0), vec3(0, 0, 2), vec3(0.5f, -2, 0))}};
    plain.spheres = {{vec3(0.5f, 0, 0), 1.0f, 0, 0}};
    CHECK(render(moved).pixels == render(plain).pixels);

    // Nearly one, but beyond what passes for one: an instance beside the sphere.
    Scene nearly = plain;
    nearly.spheres = {
        {vec3(0), 1.0f, 0, 0, Transform(vec3(1.00001f, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), vec3(0.5f, 0, 0))}};
    Tracer tracer(nearly, {test_device()});
    const std::vector<Ray> rays{{{0.5f, 0, 5}, 0, {0, 0, -1}, 100}};
    std::vector<Hit> hits(1);
    tracer.closest_hit(rays, hits);
    CHECK(hits[0].instance == 1);
    CHECK(different_share(render(nearly), render(plain)) < 0.002);
}

TEST_CASE("a thousand instances cost little more memory than one", "[instances]") {
    const auto bytes = [](const Scene& scene) {
        const SceneContents built =
            build_scene(scene, {StrategyChoice::all(Strategy::wide), StrategyChoice::all(Strategy::simt)});
        const Chunk& chunk = built.chunks.front();
        const SceneArrays& arrays = chunk.arrays;
        const auto size = [](const auto& column) { return column.size() * sizeof(column[0]); };
        return size(arrays.vertex_position) + size(arrays.triangle_vertices) + size(arrays.vertex_normal) +
               size(arrays.mesh_ranges) + size(arrays.geometries) + size(arrays.instances) +
               size(chunk.instance_nodes) + size(chunk.wide_instance_nodes) + size(chunk.wide_nodes) +
               size(chunk.triangle_blocks) + size(chunk.compressed_nodes) + size(chunk.compressed_primitives);
    };
    Scene one = scene_of({bumpy_sphere(6)}), many = one;
    for (int i = 0; i < 1000; ++i)
        many.instances.push_back({0, placed({1, 1, 1}, i, {static_cast<float>(3 * i), 0, 0}), 0});
    const std::size_t of_one = bytes(one), of_many = bytes(many);
    CAPTURE(one.meshes[0].triangles.size(), of_one, of_many);
    CHECK(of_one > 10 * (of_many - of_one));
    CHECK(of_many - of_one <
          1001 * (sizeof(shared::Instance) + 2 * sizeof(shared::InstanceNode) + sizeof(shared::WideNode) / 2) + 500);
}

TEST_CASE("wrong transforms and instances are refused by name", "[instances]") {
    struct Case {
        void (*spoil)(Scene&);
        std::string reason;
    };
    const Case cases[] = {
        {[](Scene& s) { s.instances[1].transform[1] = vec3(0); }, "instance 1: the transform has no inverse"},
        {[](Scene& s) { s.instances[1].transform[1] = s.instances[1].transform[0]; },
         "instance 1: the transform has no inverse"},
        {[](Scene& s) { s.instances[1].transform[2] *= 1e-7f; }, "instance 1: the transform stretches one direction"},
        {[](Scene& s) { s.instances[1].transform[3].x = 2e12f; }, "instance 1: translation of the transform is"},
        {[](Scene& s) { s.instances[1].transform[0].y = std::nanf(""); }, "instance 1: column of the transform is"},
        {[](Scene& s) { s.instances[1].transform = Transform(1e-9f); }, "instance 1: the transform scales lengths by"},
        {[](Scene& s) {
             s.instances[1].transform[3].x = 1e12f;
             s.instances[1].transform[0].x = 1e6f;
         },
         "instance 1: a corner of the transformed box is"},
        {[](Scene& s) { s.instances[1].mesh = 7; }, "instance 1: mesh index 7, but the scene has 1 meshes"},
        {[](Scene& s) { s.instances[1].material = 9; }, "instance 1: material index 9"},
        {[](Scene& s) { s.meshes[0].transform[0] = vec3(0); }, "mesh 0: the transform has no inverse"},
        {[](Scene& s) { s.spheres[0].transform[0] = vec3(0); }, "sphere 0: the transform has no inverse"},
        {[](Scene& s) { s.spheres[0].transform[3].z = 1e13f; }, "sphere 0: translation of the transform is"},
    };
    for (const Case& c : cases) {
        CAPTURE(c.reason);
        Scene scene = scene_of({cube_grid(1)});
        scene.instances.assign(2, {});
        scene.spheres = {{vec3(0), 1.0f, 0, 0}};
        c.spoil(scene);
        try {
            flatten(scene);
            FAIL("was not refused");
        } catch (const SceneError& error) {
            CAPTURE(error.what());
            CHECK(std::string(error.what()).find(c.reason) != std::string::npos);
        }
    }
}

}  // namespace castor::test
