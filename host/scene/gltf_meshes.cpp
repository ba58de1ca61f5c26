#include "scene/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <limits>
#include <optional>
#include <string>

#include "scene/gltf_accessor.h"
#include "scene/gltf_draco.h"

namespace castor {

namespace {

enum class Mode { points, lines, line_loop, line_strip, triangles, triangle_strip, triangle_fan };

constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

/// The vertices of a primitive that its triangles use, by their numbers in its accessors.
using VertexNumbers = std::vector<std::uint32_t>;

std::size_t triangle_count(Mode mode, std::size_t corners) {
    if (mode == Mode::triangles) return corners / 3;
    return corners < 3 ? 0 : corners - 2;
}

/// Returns the triangles of so many corners, each of which has the vertex corner(i).
template <class Corner>
std::vector<glm::uvec3> make_triangles(Mode mode, std::size_t corners, const Corner& corner) {
    std::vector<glm::uvec3> triangles(triangle_count(mode, corners));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (mode == Mode::triangles)
            triangles[i] = {corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)};
        else if (mode == Mode::triangle_strip)
            triangles[i] = {corner(i), corner(i + 1 + i % 2), corner(i + 2 - i % 2)};
        else
            triangles[i] = {corner(i + 1), corner(i + 2), corner(0)};
    }
    if (mode != Mode::triangles)  // strips are joined by triangles without an area
        triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                       [](const glm::uvec3& t) { return t.x == t.y || t.y == t.z || t.z == t.x; }),
                        triangles.end());
    return triangles;
}

std::vector<glm::uvec3> read_triangles(GltfDocument& document, const GltfValue& primitive, Mode mode,
                                       std::size_t vertex_count, GltfBudget& budget) {
    const auto indices = primitive.find("indices");
    if (!indices) {
        budget.charge(primitive, triangle_count(mode, vertex_count));
        return make_triangles(mode, vertex_count, [](std::size_t i) { return static_cast<std::uint32_t>(i); });
    }
    const GltfAccessor accessor(document, *indices);
    accessor.require_components(1, 1);
    accessor.require_whole();
    budget.charge(primitive, triangle_count(mode, accessor.count()));
    return make_triangles(mode, accessor.count(), [&](std::size_t i) {
        const std::uint32_t index = accessor.get_whole(i)[0];
        if (index >= vertex_count)
            accessor.reject(fmt::format("element {} is vertex {}, but there are {} vertices", i, index, vertex_count));
        return index;
    });
}

/// Gives the vertices that triangles use new numbers, in the order of the old ones. Returns the old ones.
VertexNumbers renumber(std::vector<glm::uvec3>& triangles, std::size_t vertex_count) {
    std::vector<std::uint32_t> number(vertex_count, kUnused);
    for (const glm::uvec3& t : triangles)
        for (int i = 0; i < 3; ++i) number[t[i]] = 0;
    VertexNumbers used;
    for (std::size_t i = 0; i < vertex_count; ++i) {
        if (number[i] == kUnused) continue;
        number[i] = static_cast<std::uint32_t>(used.size());
        used.push_back(static_cast<std::uint32_t>(i));
    }
    for (glm::uvec3& t : triangles)
        for (int i = 0; i < 3; ++i) t[i] = number[t[i]];
    return used;
}

/// Attributes with one element a vertex: of a primitive, which Draco may have compressed, or of a morph target.
struct Attributes {
    GltfDocument& document;
    GltfValue value;
    std::size_t vertex_count = 0;
    const DracoMesh* compressed = nullptr;

    /// Returns nullopt if there is none of this name.
    std::optional<GltfAccessor> find(const std::string& name) const {
        const auto reference = value.find(name.c_str());
        if (!reference) return std::nullopt;
        if (auto found = decompressed(name, *reference)) return found;
        return GltfAccessor(document, *reference, GltfAccessor::Requirement{vertex_count, "one a vertex"});
    }

    /// Returns the positions. They have as many elements as there are vertices, and nothing else requires so many.
    GltfAccessor positions(const GltfValue& reference) const {
        const auto found = decompressed("POSITION", reference);
        return found ? *found : GltfAccessor(document, reference);
    }

private:
    std::optional<GltfAccessor> decompressed(const std::string& name, const GltfValue& reference) const {
        if (compressed == nullptr) return std::nullopt;
        const auto found = compressed->attributes.find(name);
        if (found == compressed->attributes.end()) return std::nullopt;
        return GltfAccessor(document, reference, found->second);
    }
};

template <class Vector, class Get>
std::vector<Vector> gather(const VertexNumbers& vertices, const Get& get) {
    std::vector<Vector> result;
    result.reserve(vertices.size());
    for (const std::uint32_t vertex : vertices) result.push_back(get(vertex));
    return result;
}

glm::vec3 unit_or_zero(const glm::dvec3& v) {
    const double length = glm::length(v);
    return length > 0.0 ? glm::vec3(v / length) : glm::vec3(0.0f);
}

/// Returns whether a vertex has less than 0 or more than 1 of a colour, by more than what is rounded.
bool is_beyond_colors(const glm::vec4& color) {
    for (int i = 0; i < 4; ++i)
        if (color[i] < 1.0f - kGltfRoundedOne || color[i] > kGltfRoundedOne) return true;
    return false;
}

/// Moves vertices by a morph target's differences, times its weight.
void add_target(const Attributes& target, float weight, const VertexNumbers& vertices, Mesh& mesh) {
    const auto add = [&](const char* name, auto& values, std::size_t least, std::size_t most) {
        const auto differences = target.find(name);
        if (!differences || values.empty()) return;
        differences->require_components(least, most);
        const auto components = static_cast<int>(differences->component_count());
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            const auto difference = differences->get(vertices[i]);
            for (int k = 0; k < components; ++k) values[i][k] += weight * difference[static_cast<std::size_t>(k)];
        }
    };
    add("POSITION", mesh.positions, 3, 3);
    add("NORMAL", mesh.normals, 3, 3);
    add("TANGENT", mesh.tangents, 3, 3);
    add("TEXCOORD_0", mesh.texture_coordinates, 2, 2);
    add("TEXCOORD_1", mesh.texture_coordinates_1, 2, 2);
    add("COLOR_0", mesh.colors, 3, 4);
}

void morph(GltfDocument& document, const GltfValue& primitive, const std::vector<float>& weights,
           const VertexNumbers& vertices, std::size_t vertex_count, Mesh& mesh) {
    const auto targets = primitive.find("targets");
    const std::size_t count = targets ? targets->size() : 0;
    if (count < weights.size() && std::any_of(weights.begin() + static_cast<std::ptrdiff_t>(count), weights.end(),
                                              [](float weight) { return weight != 0.0f; }))
        primitive.reject(fmt::format("{} weights for {} morph targets", weights.size(), count));
    for (std::size_t i = 0; i < std::min(count, weights.size()); ++i)
        if (weights[i] != 0.0f) add_target({document, targets->at(i), vertex_count}, weights[i], vertices, mesh);
}

/// Moves each vertex by the weighted mean of its joints' matrices.
void skin(const Attributes& attributes, const std::vector<glm::dmat4>& joints, const VertexNumbers& vertices,
          Mesh& mesh) {
    struct Influences {
        GltfAccessor joints, weights;
    };
    std::vector<Influences> sets;
    for (int set = 0;; ++set) {
        const auto numbers = attributes.find(fmt::format("JOINTS_{}", set));
        const auto weights = attributes.find(fmt::format("WEIGHTS_{}", set));
        if (!numbers || !weights) break;
        numbers->require_components(4, 4);
        numbers->require_whole();
        weights->require_components(4, 4);
        sets.push_back({*numbers, *weights});
    }
    if (sets.empty()) attributes.value.reject("has no JOINTS_0 and WEIGHTS_0, but its node has a skin");
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        glm::dmat4 matrix(0.0);
        double total = 0.0;
        for (const Influences& set : sets) {
            const auto numbers = set.joints.get_whole(vertices[i]);
            const auto weights = set.weights.get(vertices[i]);
            for (std::size_t k = 0; k < 4; ++k) {
                if (weights[k] == 0.0f) continue;
                if (numbers[k] >= joints.size())
                    set.joints.reject(fmt::format("element {} has joint {}, but the skin has {} joints", vertices[i],
                                                  numbers[k], joints.size()));
                matrix += double{weights[k]} * joints[numbers[k]];
                total += double{weights[k]};
            }
        }
        if (!(total > 0.0))
            matrix = joints.front();
        else
            matrix /= total;
        const glm::dmat3 linear(matrix);
        mesh.positions[i] = glm::vec3(matrix * glm::dvec4(mesh.positions[i], 1.0));
        // The cofactor matrix is the inverse transpose times the determinant, whose sign turns no normal around here.
        const double side = glm::dot(glm::cross(linear[0], linear[1]), linear[2]) < 0.0 ? -1.0 : 1.0;
        if (!mesh.normals.empty()) {
            const glm::dvec3 n(mesh.normals[i]);
            mesh.normals[i] =
                unit_or_zero(side * (n.x * glm::cross(linear[1], linear[2]) + n.y * glm::cross(linear[2], linear[0]) +
                                     n.z * glm::cross(linear[0], linear[1])));
        }
        if (!mesh.tangents.empty())
            mesh.tangents[i] = {unit_or_zero(linear * glm::dvec3(mesh.tangents[i])), mesh.tangents[i].w};
    }
}

/// Decodes a primitive that Draco compressed; nullopt if it is not, or this build has no Draco. Its triangles are a
/// list, also where the primitive is a strip.
std::optional<DracoMesh> decompress(GltfDocument& document, const GltfValue& primitive, Mode mode,
                                    std::size_t vertex_count, GltfBudget& budget) {
    const auto extension = primitive.find_extension("KHR_draco_mesh_compression");
    if (!extension || !decodes_draco()) return std::nullopt;
    if (mode == Mode::triangle_fan) extension->reject("compresses a triangle fan, expected mode 4 or 5");
    const std::string_view bytes = document.buffer_view(extension->require("bufferView").index_of("bufferViews"));
    const std::uint64_t triangles = draco_triangle_count(*extension, bytes);
    budget.charge(primitive, vertex_count);
    budget.charge(primitive, triangles);
    if (const auto indices = primitive.find("indices"); indices && mode == Mode::triangles) {
        const std::size_t count = GltfAccessor::count_of(document, *indices);
        if (count / 3 != triangles || count % 3 != 0)
            extension->reject(fmt::format(
                "its Draco data have {} triangles, but the accessor of indices has {} elements", triangles, count));
    }
    return decode_draco(*extension, bytes, vertex_count);
}

Mode read_mode(const GltfValue& primitive) {
    const std::uint64_t mode = primitive.whole("mode", static_cast<std::uint64_t>(Mode::triangles));
    if (mode > static_cast<std::uint64_t>(Mode::triangle_fan))
        primitive.require("mode").reject(fmt::format("{} where 0 to 6 was expected", mode));
    return static_cast<Mode>(mode);
}

}  // namespace

void GltfBudget::charge(const GltfValue& owner, std::uint64_t elements) {
    // One byte of a buffer may be in a few vertices or triangles, but not in very many.
    constexpr std::uint64_t kElementsAByte = 8, kFew = 1 << 20;
    elements_ += elements;
    const std::uint64_t bytes = owner.document().byte_count();
    if (elements_ > kFew && elements_ / kElementsAByte > bytes)
        owner.reject(
            fmt::format("with it, the file's {} bytes make {} vertices, triangles and the like: data are used too "
                        "often for so many",
                        bytes, elements_));
}

std::optional<Mesh> read_gltf_primitive(GltfDocument& document, const GltfValue& primitive, const GltfBend& bend,
                                        GltfBudget& budget) {
    const Mode mode = read_mode(primitive);
    if (mode < Mode::triangles) {
        document.warn_at(primitive.path(), "points and lines are not drawn");
        return std::nullopt;
    }
    const GltfValue list = primitive.require("attributes");
    const auto position = list.find("POSITION");
    if (!position) {
        document.warn_at(primitive.path(), "has no POSITION, and is not drawn");
        return std::nullopt;
    }
    const std::size_t vertex_count = GltfAccessor::count_of(document, *position);
    const std::optional<DracoMesh> compressed = decompress(document, primitive, mode, vertex_count, budget);
    const Attributes attributes{document, list, vertex_count, compressed ? &*compressed : nullptr};
    const GltfAccessor positions = attributes.positions(*position);
    positions.require_components(3, 3);
    if (!compressed) budget.charge(primitive, vertex_count);

    Mesh mesh;
    mesh.triangles =
        compressed ? compressed->triangles : read_triangles(document, primitive, mode, vertex_count, budget);
    const VertexNumbers vertices = renumber(mesh.triangles, vertex_count);
    mesh.positions = gather<glm::vec3>(vertices, [&](std::size_t i) { return positions.get_vec3(i); });
    if (const auto normals = attributes.find("NORMAL")) {
        normals->require_components(3, 3);
        mesh.normals = gather<glm::vec3>(vertices, [&](std::size_t i) { return normals->get_vec3(i); });
    }
    // glTF 2.0, section 3.7.2.1: without normals a mesh is flat, and its tangents are ignored.
    if (const auto tangents = mesh.normals.empty() ? std::nullopt : attributes.find("TANGENT")) {
        tangents->require_components(4, 4);
        mesh.tangents = gather<glm::vec4>(vertices, [&](std::size_t i) { return tangents->get_vec4(i, 1.0f); });
    }
    const auto read_coordinates = [&](const char* name, std::vector<glm::vec2>& coordinates) {
        const auto accessor = attributes.find(name);
        if (!accessor) return;
        accessor->require_components(2, 2);
        coordinates = gather<glm::vec2>(vertices, [&](std::size_t i) { return accessor->get_vec2(i); });
    };
    read_coordinates("TEXCOORD_0", mesh.texture_coordinates);
    read_coordinates("TEXCOORD_1", mesh.texture_coordinates_1);
    if (const auto colors = attributes.find("COLOR_0")) {
        colors->require_components(3, 4);
        mesh.colors = gather<glm::vec4>(vertices, [&](std::size_t i) { return colors->get_vec4(i, 1.0f); });
        if (std::any_of(mesh.colors.begin(), mesh.colors.end(), is_beyond_colors))
            document.warn_at(list.path() + ".COLOR_0", "has colours below 0 or above 1, which are limited to these");
    }
    morph(document, primitive, bend.weights, vertices, vertex_count, mesh);
    for (glm::vec3& normal : mesh.normals) normal = unit_or_zero(glm::dvec3(normal));
    for (glm::vec4& tangent : mesh.tangents)
        tangent = {unit_or_zero(glm::dvec3(tangent)), tangent.w < 0.0f ? -1.0f : 1.0f};
    for (glm::vec4& color : mesh.colors) color = glm::clamp(color, 0.0f, 1.0f);
    if (!bend.joints.empty()) skin(attributes, bend.joints, vertices, mesh);
    return mesh;
}

}  // namespace castor
