// Tangents of texture coordinates: castor::add_tangents.
#include "scene/tangents.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <numbers>
#include <vector>

#include "reference/random_source.h"
#include "support/catch.h"
#include "support/picture.h"

namespace castor::test {

namespace {

using glm::vec2;
using glm::vec3;
using glm::vec4;

/// The square [-1, 1]^2 at z = 0, seen from above, where a picture lies upright.
Mesh square() {
    Mesh mesh = rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
    mesh.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    mesh.normals.assign(4, {0, 0, 1});
    return mesh;
}

void check_close(const vec4& found, const vec4& expected) {
    CAPTURE(found.x, found.y, found.z, found.w, expected.x, expected.y, expected.z, expected.w);
    for (int i = 0; i < 4; ++i) CHECK(std::abs(found[i] - expected[i]) <= 1e-6f);
}

/// A tube about the y axis, with its picture once around; the last column of vertices lies on the first one.
Mesh tube(int columns) {
    Mesh mesh;
    for (int row = 0; row < 2; ++row)
        for (int i = 0; i <= columns; ++i) {
            const double angle = 2.0 * std::numbers::pi * (i % columns) / columns;
            const vec3 out(std::sin(angle), 0, std::cos(angle));
            mesh.positions.push_back(out + vec3(0, row, 0));
            mesh.normals.push_back(out);
            mesh.texture_coordinates.push_back({float(i) / float(columns), 1.0f - float(row)});
        }
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(columns); ++i) {
        const auto above = i + static_cast<std::uint32_t>(columns) + 1;
        mesh.triangles.push_back({i, i + 1, above + 1});
        mesh.triangles.push_back({i, above + 1, above});
    }
    return mesh;
}

}  // namespace

TEST_CASE("tangents lie along u, and their bitangents up the picture", "[tangents]") {
    Mesh mesh = square();
    add_tangents(mesh, 0);
    for (const vec4& tangent : mesh.tangents) check_close(tangent, {1, 0, 0, 1});
    for (vec2& uv : mesh.texture_coordinates) uv = {uv.y, uv.x};  // turned and mirrored: u is down
    mesh.tangents.clear();
    add_tangents(mesh, 0);
    for (const vec4& tangent : mesh.tangents) check_close(tangent, {0, -1, 0, -1});
    CHECK(mesh.positions.size() == 4);
}

TEST_CASE("tangents of the second coordinates are asked for by their number", "[tangents]") {
    Mesh mesh = square();
    mesh.texture_coordinates_1 = {{1, 1}, {1, 0}, {0, 0}, {0, 1}};  // u is down, v is left
    add_tangents(mesh, 1);
    for (const vec4& tangent : mesh.tangents) check_close(tangent, {0, -1, 0, 1});
}

TEST_CASE("tangents turn with a smooth surface, also over the seam of its picture", "[tangents]") {
    Mesh mesh = tube(12);
    add_tangents(mesh, 0);
    REQUIRE(mesh.positions.size() == 26);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const vec3 along = glm::cross(vec3(0, 1, 0), mesh.normals[i]);
        CAPTURE(i);
        // At the seam, triangles of one side alone have the vertices: within half of a column's angle.
        const bool is_seam = i % 13 == 0 || i % 13 == 12;
        CHECK(glm::dot(vec3(mesh.tangents[i]), along) >= (is_seam ? 0.96f : 0.99999f));
        CHECK(std::abs(glm::dot(vec3(mesh.tangents[i]), mesh.normals[i])) <= 1e-6f);
        CHECK(mesh.tangents[i].w == 1.0f);
    }
}

TEST_CASE("vertices are divided where a picture is mirrored, with all that they have", "[tangents]") {
    // Two squares side by side, and the picture of the right one is mirrored.
    Mesh mesh = square();
    mesh.positions = {{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {1, 0, 0}, {1, 1, 0}};
    mesh.normals.assign(6, {0, 0, 1});
    mesh.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, 0}, {0, 1}, {0, 0}};
    mesh.texture_coordinates_1 = {{0, 0}, {0.1f, 0}, {0.2f, 0}, {0.3f, 0}, {0.4f, 0}, {0.5f, 0}};
    mesh.colors = {{0, 0, 0, 1}, {0.1f, 0, 0, 1}, {0.2f, 0, 0, 1}, {0.3f, 0, 0, 1}, {0.4f, 0, 0, 1}, {0.5f, 0, 0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
    const Mesh before = mesh;
    add_tangents(mesh, 0);
    REQUIRE(mesh.positions.size() == 8);
    REQUIRE(mesh.tangents.size() == 8);
    for (std::size_t t = 0; t < 4; ++t)
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t now = mesh.triangles[t][k], was = before.triangles[t][k];
            CAPTURE(t, k, now, was);
            check_close(mesh.tangents[now], t < 2 ? vec4(1, 0, 0, 1) : vec4(-1, 0, 0, -1));
            CHECK(mesh.positions[now] == before.positions[was]);
            CHECK(mesh.normals[now] == before.normals[was]);
            CHECK(mesh.texture_coordinates[now] == before.texture_coordinates[was]);
            CHECK(mesh.texture_coordinates_1[now] == before.texture_coordinates_1[was]);
            CHECK(mesh.colors[now] == before.colors[was]);
        }
}

TEST_CASE("tangents at a vertex are a mean by angles", "[tangents]") {
    // Of the first triangle u is x. Of the second one (0, 1, 0) is a step up the picture, and (-1, -1, 0) one to the
    // left and one up: u grows along (1, 2, 0).
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}};
    mesh.normals.assign(4, {0, 0, 1});
    mesh.texture_coordinates = {{0, 0}, {1, 0}, {0, -1}, {-1, -1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    add_tangents(mesh, 0);
    const vec3 first(1, 0, 0), second = glm::normalize(vec3(1, 2, 0));
    check_close(mesh.tangents[1], vec4(first, 1));
    check_close(mesh.tangents[3], vec4(second, 1));
    check_close(mesh.tangents[0], vec4(glm::normalize(90.0f * first + 135.0f * second), 1));
    check_close(mesh.tangents[2], vec4(glm::normalize(45.0f * first + 26.56505118f * second), 1));
}

TEST_CASE("triangles without an area have the tangents of others, or none", "[tangents]") {
    Mesh mesh = square();
    mesh.triangles.push_back({0, 0, 1});
    mesh.positions.insert(mesh.positions.end(), {{2, 0, 0}, {3, 0, 0}, {2, 1, 0}});
    mesh.normals.resize(7, {0, 0, 1});
    mesh.texture_coordinates.resize(7, {0.5f, 0.5f});  // the picture has no area there
    mesh.triangles.push_back({4, 5, 6});
    add_tangents(mesh, 0);
    REQUIRE(mesh.tangents.size() == 7);
    for (std::size_t i = 0; i < 7; ++i) check_close(mesh.tangents[i], i < 4 ? vec4(1, 0, 0, 1) : vec4(0, 0, 0, 1));
}

TEST_CASE("any mesh gets tangents that are unit, or none", "[tangents]") {
    RandomSource random(5);
    for (int round = 0; round < 50; ++round) {
        Mesh mesh;
        const std::uint32_t count = 3 + random.below(12);
        for (std::uint32_t i = 0; i < count; ++i) {
            mesh.positions.push_back({float(random.below(3)), float(random.below(3)), float(random.below(2))});
            mesh.texture_coordinates.push_back({float(random.below(3)), float(random.below(3))});
            if (round % 3 != 0) mesh.normals.push_back(round % 3 == 1 ? vec3(0, 0, 1) : vec3(0));
        }
        for (int t = 0; t < 30; ++t)
            mesh.triangles.push_back({random.below(count), random.below(count), random.below(count)});
        const Mesh before = mesh;
        add_tangents(mesh, 0);
        CAPTURE(round);
        REQUIRE(mesh.tangents.size() == mesh.positions.size());
        CHECK(mesh.normals.size() == (before.normals.empty() ? 0 : mesh.positions.size()));
        for (const vec4& tangent : mesh.tangents) {
            const float length = glm::length(vec3(tangent));
            CHECK((length == 0.0f || std::abs(length - 1.0f) <= 1e-5f));
            CHECK(std::abs(tangent.w) == 1.0f);
        }
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            for (int k = 0; k < 3; ++k) {
                REQUIRE(mesh.triangles[t][k] < mesh.positions.size());
                CHECK(mesh.positions[mesh.triangles[t][k]] == before.positions[before.triangles[t][k]]);
            }
    }
}

}  // namespace castor::test
