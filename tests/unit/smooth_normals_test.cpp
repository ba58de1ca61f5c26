#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "castor/scene.h"
#include "support/catch.h"

namespace castor {
namespace {

TEST_CASE("Smooth normals weigh the triangles of a vertex by area", "[smooth_normals]") {
    Mesh mesh;
    // A triangle of area 1/2 facing +z and one of area 1 facing +x share the edge 0-2.
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    compute_smooth_normals(mesh);
    REQUIRE(mesh.normals.size() == 4);
    const float length = std::sqrt(5.0f);
    for (const int shared : {0, 2}) {
        CAPTURE(shared, mesh.normals[shared].x, mesh.normals[shared].z);
        CHECK(mesh.normals[shared].x == Approx(2.0f / length));
        CHECK(mesh.normals[shared].y == 0.0f);
        CHECK(mesh.normals[shared].z == Approx(1.0f / length));
    }
    CHECK(mesh.normals[1] == glm::vec3(0, 0, 1));
    CHECK(mesh.normals[3] == glm::vec3(1, 0, 0));
}

TEST_CASE("Smooth normals of a ball's octahedron point outwards at any size", "[smooth_normals]") {
    for (const float size : {1e-30f, 1.0f, 1e30f}) {
        CAPTURE(size);
        Mesh mesh;
        mesh.positions = {{size, 0, 0}, {-size, 0, 0}, {0, size, 0}, {0, -size, 0}, {0, 0, size}, {0, 0, -size}};
        mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
        compute_smooth_normals(mesh);
        for (std::size_t v = 0; v < mesh.positions.size(); ++v) CHECK(mesh.normals[v] == mesh.positions[v] / size);
    }
}

TEST_CASE("A vertex that no proper triangle uses has no normal", "[smooth_normals]") {
    Mesh mesh;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}, {nan, 0, 0}, {0, 1, 0}};
    mesh.normals = {{1, 2, 3}};
    mesh.triangles = {{0, 1, 2}, {3, 3, 3}, {3, 5, 4}, {0, 1, 7}};
    compute_smooth_normals(mesh);
    REQUIRE(mesh.normals.size() == 6);
    for (const glm::vec3& normal : mesh.normals) CHECK(normal == glm::vec3(0.0f));
}

}  // namespace
}  // namespace castor
