#include "scene/mesh_hull.h"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numeric>
#include <vector>

namespace castor {

namespace {

// Of each position, the number of one that is equal to it: of all that are equal, the same.
std::vector<std::uint32_t> numbers_of(std::span<const glm::vec3> positions) {
    std::vector<std::uint32_t> sorted(positions.size());
    std::iota(sorted.begin(), sorted.end(), 0u);
    const auto is_before = [&](std::uint32_t a, std::uint32_t b) {
        const glm::vec3 &p = positions[a], &q = positions[b];
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
    };
    tbb::parallel_sort(sorted.begin(), sorted.end(), is_before);
    std::vector<std::uint32_t> numbers(positions.size());
    for (std::size_t i = 0; i < sorted.size(); ++i)
        numbers[sorted[i]] = i > 0 && !is_before(sorted[i - 1], sorted[i]) ? numbers[sorted[i - 1]] : sorted[i];
    return numbers;
}

// Sets of corners that triangles connect.
class Parts {
public:
    explicit Parts(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }

    std::uint32_t find(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) { parent_[find(a)] = find(b); }

private:
    std::vector<std::uint32_t> parent_;
};

// Whether each edge has as many triangles on one side as on the other, one of each.
bool has_pairs(const std::vector<glm::uvec3>& triangles) {
    struct Edge {
        std::uint32_t lower, upper;
        bool is_up;
        auto operator<=>(const Edge&) const = default;
    };
    std::vector<Edge> edges;
    edges.reserve(3 * triangles.size());
    for (const glm::uvec3& triangle : triangles) {
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t from = triangle[i], to = triangle[(i + 1) % 3];
            edges.push_back({std::min(from, to), std::max(from, to), from < to});
        }
    }
    tbb::parallel_sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size(); i += 2) {
        const auto is_same = [&](std::size_t a, std::size_t b) {
            return edges[a].lower == edges[b].lower && edges[a].upper == edges[b].upper;
        };
        if (i + 1 == edges.size() || !is_same(i, i + 1) || edges[i].is_up == edges[i + 1].is_up) return false;
        if (i + 2 < edges.size() && is_same(i, i + 2)) return false;
    }
    return true;
}

}  // namespace

MeshHull hull_of(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles) {
    const std::vector<std::uint32_t> numbers = numbers_of(positions);
    std::vector<glm::uvec3> solid;
    for (const glm::uvec3& triangle : triangles) {
        const glm::uvec3 corners(numbers[triangle.x], numbers[triangle.y], numbers[triangle.z]);
        if (corners.x != corners.y && corners.y != corners.z && corners.z != corners.x) solid.push_back(corners);
    }
    if (solid.empty() || !has_pairs(solid)) return MeshHull::open;

    Parts parts(positions.size());
    for (const glm::uvec3& triangle : solid) {
        parts.join(triangle.x, triangle.y);
        parts.join(triangle.y, triangle.z);
    }
    // Six times what each part encloses, about a corner of its own: far from the origin little would be left of it.
    std::vector<double> volumes(positions.size(), 0.0);
    for (const glm::uvec3& triangle : solid) {
        const std::uint32_t part = parts.find(triangle.x);
        const auto corner = [&](std::uint32_t i) { return glm::dvec3(positions[i]) - glm::dvec3(positions[part]); };
        volumes[part] += glm::dot(corner(triangle.x), glm::cross(corner(triangle.y), corner(triangle.z)));
    }
    bool is_outward = true, is_inward = true;
    for (const glm::uvec3& triangle : solid) {
        const double volume = volumes[parts.find(triangle.x)];
        is_outward &= volume > 0.0;
        is_inward &= volume < 0.0;
    }
    return is_outward ? MeshHull::closed : is_inward ? MeshHull::closed_inward : MeshHull::open;
}

}  // namespace castor
