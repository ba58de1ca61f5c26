// Which meshes hide their own far sides.
#include "scene/mesh_hull.h"

#include <cstdint>
#include <glm/vec3.hpp>
#include <utility>
#include <vector>

#include "scene/scene_arrays.h"
#include "support/catch.h"

namespace castor::test {
namespace {

struct Triangles {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;

    MeshHull hull() const { return hull_of(positions, triangles); }
    void add(const Triangles& other) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.insert(positions.end(), other.positions.begin(), other.positions.end());
        for (const glm::uvec3& triangle : other.triangles) triangles.push_back(triangle + first);
    }
    Triangles turned() const {
        Triangles result = *this;
        for (glm::uvec3& triangle : result.triangles) std::swap(triangle.y, triangle.z);
        return result;
    }
    /// Corners of its own for each triangle.
    Triangles apart() const {
        Triangles result;
        for (const glm::uvec3& triangle : triangles) {
            const auto first = static_cast<std::uint32_t>(result.positions.size());
            for (int i = 0; i < 3; ++i) result.positions.push_back(positions[triangle[i]]);
            result.triangles.emplace_back(first, first + 1, first + 2);
        }
        return result;
    }
};

Triangles tetrahedron(const glm::vec3& at) {
    return {{at, at + glm::vec3(1, 0, 0), at + glm::vec3(0, 1, 0), at + glm::vec3(0, 0, 1)},
            {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

}  // namespace

TEST_CASE("closed meshes are known by their edges and volumes", "[unit][mesh_hull]") {
    // Far from the origin nothing is left of a volume about that.
    const Triangles one = tetrahedron({1e6f, -1e6f, 3.0f});
    CHECK(one.hull() == MeshHull::closed);
    CHECK(one.turned().hull() == MeshHull::closed_inward);
    CHECK(one.apart().hull() == MeshHull::closed);

    Triangles with_needle = one;
    with_needle.positions.push_back(one.positions[1]);
    with_needle.triangles.emplace_back(0, 1, 4);  // 1 and 4 are one corner
    CHECK(with_needle.hull() == MeshHull::closed);

    Triangles two = one;
    two.add(tetrahedron({0, 0, 0}));
    CHECK(two.hull() == MeshHull::closed);
    two.add(tetrahedron({5, 0, 0}).turned());
    CHECK(two.hull() == MeshHull::open);
}

TEST_CASE("meshes with holes, twists and edges of many triangles are open", "[unit][mesh_hull]") {
    CHECK(Triangles().hull() == MeshHull::open);
    for (std::size_t i = 0; i < 4; ++i) {
        Triangles with_hole = tetrahedron({0, 0, 0});
        with_hole.triangles.erase(with_hole.triangles.begin() + static_cast<std::ptrdiff_t>(i));
        CHECK(with_hole.hull() == MeshHull::open);
        Triangles twisted = tetrahedron({0, 0, 0});
        std::swap(twisted.triangles[i].x, twisted.triangles[i].y);
        CHECK(twisted.hull() == MeshHull::open);
    }
    Triangles twice = tetrahedron({0, 0, 0});
    twice.add(tetrahedron({0, 0, 0}));
    CHECK(twice.hull() == MeshHull::open);
    // Both sides of a sheet enclose nothing.
    CHECK(Triangles{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}}.hull() == MeshHull::open);
}

TEST_CASE("lights of meshes say where they are and whether they hide their far sides", "[unit][mesh_hull]") {
    const Triangles one = tetrahedron({1, 2, 3});
    Scene scene;
    scene.materials.resize(1);
    scene.materials[0].emission = glm::vec3(2.0f);
    Mesh mesh;
    mesh.positions = one.positions;
    mesh.triangles = one.triangles;
    mesh.transform[0] *= 2.0f;
    scene.meshes = {mesh};
    Light light;
    light.kind = Light::Kind::mesh;
    scene.lights = {light};
    const auto made = [&] { return flatten(scene).lights.at(0); };
    CHECK(made().mapping == CASTOR_MESH_CLOSED);
    CHECK(glm::vec3(made().position[0], made().position[1], made().position[2]) == glm::vec3(3.0f, 2.5f, 3.5f));
    CHECK(glm::vec3(made().tangent[0], made().tangent[1], made().tangent[2]) == glm::vec3(1.0f, 0.5f, 0.5f));

    scene.meshes[0].transform[0] *= -1.0f;  // in the world the corners turn the other way
    CHECK(made().mapping == CASTOR_MESH_CLOSED_INWARD);
    scene.meshes[0].triangles = one.turned().triangles;
    CHECK(made().mapping == CASTOR_MESH_CLOSED);
    scene.materials[0].kind = MaterialKind::dielectric;  // the far sides are seen through the near ones
    CHECK(made().mapping == CASTOR_MESH_OPEN);
    scene.materials[0].kind = MaterialKind::plain;
    scene.meshes[0].triangles.pop_back();
    CHECK(made().mapping == CASTOR_MESH_OPEN);
}

TEST_CASE("lights of meshes say whether normals of vertices are those of triangles", "[unit][mesh_hull]") {
    Scene scene;
    scene.materials.resize(1);
    scene.materials[0].emission = glm::vec3(2.0f);
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {3, 1, 0}, {0, 4, 2}};
    mesh.triangles = {{0, 1, 2}};
    mesh.transform[0] *= 2.0f;
    scene.meshes = {mesh};
    Light light;
    light.kind = Light::Kind::mesh;
    scene.lights = {light};
    const auto made = [&] { return flatten(scene).lights.at(0).sampling; };
    CHECK(made() == CASTOR_MESH_FLAT);
    const glm::vec3 across(2, -6, 12);
    scene.meshes[0].normals = {across, -across, glm::vec3(0.14744f, -0.44233f, 0.88465f)};
    CHECK(made() == CASTOR_MESH_FLAT);  // of any length and side, and rounded
    scene.meshes[0].normals[1] = glm::vec3(0.0f);
    CHECK(made() == CASTOR_MESH_FLAT);
    scene.meshes[0].normals[1] = across + glm::vec3(0.01f, 0, 0);
    CHECK(made() == CASTOR_MESH_SMOOTH);
}

}  // namespace castor::test
