#include "scene/tangents.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numeric>
#include <tuple>
#include <vector>

namespace castor {

namespace {

using glm::dvec3;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Corner 3 t + k is the k-th one of triangle t.
struct Directions {
    dvec3 along_u{0.0};        // unit; zero where the triangle has no area
    bool is_mirrored = false;  // u and the way up of the picture are wound the other way round
};

dvec3 unit_or_zero(const dvec3& v) {
    const double length = glm::length(v);
    return length > 0.0 && std::isfinite(length) ? v / length : dvec3(0.0);
}

dvec3 on_plane(const dvec3& v, const dvec3& normal) {
    return unit_or_zero(v - glm::dot(v, normal) * normal);
}

class TangentMaker {
public:
    TangentMaker(const Mesh& mesh, const std::vector<glm::vec2>& coordinates)
        : mesh_(mesh), coordinates_(coordinates), directions_(mesh.triangles.size()) {
        for (std::size_t t = 0; t < directions_.size(); ++t) directions_[t] = directions_of(mesh.triangles[t]);
        join_corners();
    }

    /// Returns the tangents of all corners; (0, 0, 0, 1) where a triangle has none.
    std::vector<glm::vec4> tangents() {
        std::vector<dvec3> sums(group_.size());
        for (std::uint32_t corner = 0; corner < group_.size(); ++corner)
            if (has_direction(corner))
                sums[group_of(corner)] +=
                    angle_at(corner) * on_plane(directions_[corner / 3].along_u, normal_at(corner));
        std::vector<glm::vec4> tangents(group_.size(), glm::vec4(0, 0, 0, 1));
        for (std::uint32_t corner = 0; corner < group_.size(); ++corner)
            if (has_direction(corner))
                tangents[corner] = {glm::vec3(unit_or_zero(sums[group_of(corner)])),
                                    directions_[corner / 3].is_mirrored ? -1.0f : 1.0f};
        return tangents;
    }

    bool has_direction(std::uint32_t corner) const { return directions_[corner / 3].along_u != dvec3(0.0); }

private:
    std::uint32_t vertex_of(std::uint32_t corner) const {
        return mesh_.triangles[corner / 3][static_cast<int>(corner % 3)];
    }

    dvec3 position_at(std::uint32_t corner) const { return dvec3(mesh_.positions[vertex_of(corner)]); }

    dvec3 normal_at(std::uint32_t corner) const {
        if (!mesh_.normals.empty()) return unit_or_zero(dvec3(mesh_.normals[vertex_of(corner)]));
        const std::uint32_t first = corner - corner % 3;
        return unit_or_zero(
            glm::cross(position_at(first + 1) - position_at(first), position_at(first + 2) - position_at(first)));
    }

    Directions directions_of(const glm::uvec3& triangle) const {
        const auto edge = [&](int k) {
            return dvec3(mesh_.positions[triangle[k]]) - dvec3(mesh_.positions[triangle.x]);
        };
        const auto edge_of_picture = [&](int k) {
            const glm::dvec2 d = glm::dvec2(coordinates_[triangle[k]]) - glm::dvec2(coordinates_[triangle.x]);
            return glm::dvec2(d.x, -d.y);  // v points down
        };
        const dvec3 d1 = edge(1), d2 = edge(2);
        const glm::dvec2 t1 = edge_of_picture(1), t2 = edge_of_picture(2);
        const double area = t1.x * t2.y - t1.y * t2.x;
        Directions found;
        if (!(std::abs(area) > std::numeric_limits<float>::min()) || glm::cross(d1, d2) == dvec3(0.0)) return found;
        found.is_mirrored = area < 0.0;
        found.along_u = (area < 0.0 ? -1.0 : 1.0) * unit_or_zero(t2.y * d1 - t1.y * d2);
        return found;
    }

    /// Returns a number for each vertex, which those have in common that are the same point, normal and coordinates.
    std::vector<std::uint32_t> welded_vertices() const {
        const auto key = [&](std::uint32_t vertex) {
            const glm::vec3 &p = mesh_.positions[vertex], &n = mesh_.normals[vertex];
            const glm::vec2& uv = coordinates_[vertex];
            return std::make_tuple(p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y);
        };
        std::vector<std::uint32_t> order(mesh_.positions.size()), welded(order.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
        for (std::size_t i = 1; i < order.size(); ++i)
            welded[order[i]] = welded[order[i - 1]] + (key(order[i - 1]) != key(order[i]));
        return welded;
    }

    /// Joins the corners of triangles at both ends of the edges that these share, where they are mirrored alike. Faces
    /// without normals share nothing: each has its own.
    void join_corners() {
        group_.resize(3 * directions_.size());
        std::iota(group_.begin(), group_.end(), 0u);
        if (mesh_.normals.empty()) return;
        const std::vector<std::uint32_t> welded = welded_vertices();
        struct Edge {
            std::uint32_t low, high;    // welded vertices
            bool is_mirrored, is_back;  // back: from high to low
            std::uint32_t corner;       // where it begins
        };
        std::vector<Edge> edges;
        for (std::uint32_t corner = 0; corner < group_.size(); ++corner) {
            const std::uint32_t a = welded[vertex_of(corner)], b = welded[vertex_of(next_corner(corner))];
            if (has_direction(corner) && a != b)
                edges.push_back({std::min(a, b), std::max(a, b), directions_[corner / 3].is_mirrored, a > b, corner});
        }
        const auto place = [](const Edge& edge) { return std::tie(edge.low, edge.high, edge.is_mirrored); };
        std::sort(edges.begin(), edges.end(), [&](const Edge& a, const Edge& b) {
            return std::tuple_cat(place(a), std::tie(a.corner)) < std::tuple_cat(place(b), std::tie(b.corner));
        });
        for (std::size_t begin = 0; begin < edges.size();) {
            std::size_t end = begin + 1;
            while (end < edges.size() && place(edges[end]) == place(edges[begin])) ++end;
            // Of more than two triangles at an edge, the first ones go together.
            std::size_t forth = begin, back = begin;
            while (true) {
                while (forth < end && edges[forth].is_back) ++forth;
                while (back < end && !edges[back].is_back) ++back;
                if (forth == end || back == end) break;
                const std::uint32_t a = edges[forth++].corner, b = edges[back++].corner;
                join(a, next_corner(b));
                join(next_corner(a), b);
            }
            begin = end;
        }
    }

    static std::uint32_t next_corner(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
    static std::uint32_t last_corner(std::uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

    std::uint32_t group_of(std::uint32_t corner) {
        while (group_[corner] != corner) corner = group_[corner] = group_[group_[corner]];
        return corner;
    }

    void join(std::uint32_t a, std::uint32_t b) {
        const std::uint32_t first = group_of(a), second = group_of(b);
        group_[std::max(first, second)] = std::min(first, second);
    }

    double angle_at(std::uint32_t corner) const {
        const dvec3 normal = normal_at(corner), here = position_at(corner);
        const dvec3 a = on_plane(position_at(next_corner(corner)) - here, normal);
        const dvec3 b = on_plane(position_at(last_corner(corner)) - here, normal);
        return std::acos(glm::clamp(glm::dot(a, b), -1.0, 1.0));
    }

    const Mesh& mesh_;
    const std::vector<glm::vec2>& coordinates_;
    std::vector<Directions> directions_;
    std::vector<std::uint32_t> group_;  // of each corner: another corner of it, or itself
};

/// Appends a vertex that is like another one.
void repeat_vertex(Mesh& mesh, std::uint32_t vertex) {
    const auto repeat = [&](auto& values) {
        if (values.empty()) return;
        const auto value = values[vertex];
        values.push_back(value);
    };
    repeat(mesh.positions);
    repeat(mesh.normals);
    repeat(mesh.texture_coordinates);
    repeat(mesh.texture_coordinates_1);
    repeat(mesh.colors);
    repeat(mesh.tangents);
}

}  // namespace

void add_tangents(Mesh& mesh, std::uint32_t coordinate_set) {
    TangentMaker maker(mesh, coordinate_set == 0 ? mesh.texture_coordinates : mesh.texture_coordinates_1);
    const std::vector<glm::vec4> tangents = maker.tangents();
    mesh.tangents.assign(mesh.positions.size(), glm::vec4(0, 0, 0, 1));
    std::vector<bool> is_set(mesh.positions.size());
    std::vector<std::uint32_t> next(mesh.positions.size(), kNone);  // of the vertices that one was divided into
    for (std::uint32_t corner = 0; corner < tangents.size(); ++corner) {
        if (!maker.has_direction(corner)) continue;
        std::uint32_t& number = mesh.triangles[corner / 3][static_cast<int>(corner % 3)];
        std::uint32_t vertex = number;
        while (is_set[vertex] && mesh.tangents[vertex] != tangents[corner]) {
            if (next[vertex] == kNone) {
                next[vertex] = static_cast<std::uint32_t>(next.size());
                next.push_back(kNone);
                is_set.push_back(false);
                repeat_vertex(mesh, vertex);
            }
            vertex = next[vertex];
        }
        mesh.tangents[vertex] = tangents[corner];
        is_set[vertex] = true;
        number = vertex;
    }
}

}  // namespace castor
