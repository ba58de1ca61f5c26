#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <utility>
#include <vector>

#include "castor/scene.h"
#include "reference/random_source.h"

namespace castor::reference {

/// Makes the closed surface of the cube [-1, 1]^3: n x n squares a face, two triangles each, with common vertices.
inline Mesh cube_grid(int n) {
    Mesh mesh;
    std::map<std::array<int, 3>, std::uint32_t> numbers;
    const auto vertex = [&](std::array<int, 3> at) {
        const auto [found, is_new] = numbers.try_emplace(at, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) mesh.positions.push_back(glm::vec3(at[0], at[1], at[2]) * (2.0f / static_cast<float>(n)) - 1.0f);
        return found->second;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (int side : {0, n})
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    const auto corner = [&](int di, int dj) {
                        std::array<int, 3> at{};
                        at[axis] = side;
                        at[(axis + 1) % 3] = i + di;
                        at[(axis + 2) % 3] = j + dj;
                        return vertex(at);
                    };
                    const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
                    if (side == n) {
                        mesh.triangles.emplace_back(a, b, c);
                        mesh.triangles.emplace_back(a, c, d);
                    } else {
                        mesh.triangles.emplace_back(a, c, b);
                        mesh.triangles.emplace_back(a, d, c);
                    }
                }
    return mesh;
}

/// Makes an icosahedron on the unit sphere and splits each triangle into four, `levels` times: closed,
/// counter-clockwise seen from outside.
inline Mesh icosphere(int levels) {
    const float g = 1.6180339887f;
    std::vector<glm::vec3> positions{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    std::vector<glm::uvec3> triangles{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, is_new] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(positions.size()));
            if (is_new) positions.push_back(glm::normalize(positions[a]) + glm::normalize(positions[b]));
            return found->second;
        };
        std::vector<glm::uvec3> finer;
        for (const glm::uvec3& t : triangles) {
            const std::uint32_t ab = middle(t.x, t.y), bc = middle(t.y, t.z), ca = middle(t.z, t.x);
            finer.insert(finer.end(), {{t.x, ab, ca}, {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}});
        }
        triangles = std::move(finer);
    }
    Mesh mesh;
    for (const glm::vec3& p : positions) mesh.positions.push_back(glm::normalize(p));
    mesh.triangles = std::move(triangles);
    return mesh;
}

/// Makes an icosphere with a varying radius: closed, star-shaped about the origin.
inline Mesh bumpy_sphere(int levels) {
    Mesh mesh = icosphere(levels);
    for (glm::vec3& p : mesh.positions)
        p *= 1.0f + 0.1f * std::sin(9.0f * p.x) * std::sin(8.0f * p.y + 1.0f) * std::cos(7.0f * p.z);
    return mesh;
}

/// Makes triangles whose corners lie in cubes of edge 2 * reach about places in [-1, 1]^3.
inline Mesh random_triangles(RandomSource& random, std::size_t count, float reach) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
        const glm::vec3 place = random.in_box(-1, 1);
        for (int k = 0; k < 3; ++k) mesh.positions.push_back(place + random.in_box(-reach, reach));
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
}

inline Mesh moved(Mesh mesh, float scale, glm::vec3 offset) {
    for (glm::vec3& p : mesh.positions) p = p * scale + offset;
    return mesh;
}

/// Makes a scene of these meshes with one material.
inline Scene scene_of(std::vector<Mesh> meshes) {
    Scene scene;
    scene.materials.emplace_back();
    scene.meshes = std::move(meshes);
    return scene;
}

}  // namespace castor::reference
