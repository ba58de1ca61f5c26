#include "scene/gltf_nodes.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace castor {

namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

GltfPose read_pose(const GltfValue& node) {
    GltfPose pose;
    if (node.find("matrix")) {
        const auto m = node.numbers<16>("matrix", {});
        glm::dmat4 matrix(1.0);
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 4; ++row) matrix[column][row] = m[static_cast<std::size_t>(4 * column + row)];
        constexpr double kRounding = 1e-5;  // of exporters
        for (int column = 0; column < 4; ++column) {
            const double exact = column == 3 ? 1.0 : 0.0;
            if (!(std::abs(matrix[column][3] - exact) <= kRounding))
                node.require("matrix").reject("its last row is not 0 0 0 1");
            matrix[column][3] = exact;
        }
        pose.matrix = matrix;
    }
    const auto t = node.numbers<3>("translation", {0, 0, 0});
    const auto r = node.numbers<4>("rotation", {0, 0, 0, 1});
    const auto s = node.numbers<3>("scale", {1, 1, 1});
    pose.translation = {t[0], t[1], t[2]};
    pose.rotation = {r[0], r[1], r[2], r[3]};
    pose.scale = {s[0], s[1], s[2]};
    if (!(glm::length(pose.rotation) > 0.0)) node.require("rotation").reject("(0, 0, 0, 0) is no rotation");
    pose.rotation = glm::normalize(pose.rotation);
    if (const auto weights = node.find("weights")) {
        pose.weights.emplace();
        for (std::size_t i = 0; i < weights->size(); ++i) pose.weights->push_back(weights->at(i).number());
    }
    return pose;
}

/// Returns each node's parent, or kNone.
std::vector<std::size_t> read_parents(const GltfDocument& document, std::vector<std::vector<std::size_t>>& children) {
    const std::size_t count = document.count("nodes");
    std::vector<std::size_t> parents(count, kNone);
    children.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto list = document.element("nodes", i).find("children");
        for (std::size_t k = 0; list && k < list->size(); ++k) {
            const GltfValue child = list->at(k);
            const std::size_t number = child.index_of("nodes");
            if (parents[number] != kNone)
                child.reject(fmt::format("node {} is a child of node {} already", number, parents[number]));
            parents[number] = i;
            children[i].push_back(number);
        }
    }
    return parents;
}

/// Returns the nodes under the roots, parents before their children. No recursion: files may nest nodes deeply.
std::vector<std::size_t> nodes_under(const std::vector<std::size_t>& roots,
                                     const std::vector<std::vector<std::size_t>>& children) {
    std::vector<std::size_t> order, open(roots.rbegin(), roots.rend());
    while (!open.empty()) {
        order.push_back(open.back());
        const std::vector<std::size_t>& next = children[open.back()];
        open.pop_back();
        open.insert(open.end(), next.rbegin(), next.rend());
    }
    return order;
}

std::vector<std::size_t> shown_roots(const GltfDocument& document, const std::vector<std::size_t>& parents,
                                     const std::vector<std::size_t>& all_roots) {
    if (document.count("scenes") == 0) return all_roots;
    const auto chosen = document.root().find("scene");
    const GltfValue scene = document.element("scenes", chosen ? chosen->index_of("scenes") : 0);
    const auto list = scene.find("nodes");
    std::vector<std::size_t> roots;
    std::vector<bool> is_listed(parents.size());
    for (std::size_t i = 0; list && i < list->size(); ++i) {
        const GltfValue node = list->at(i);
        const std::size_t number = node.index_of("nodes");
        if (parents[number] != kNone)
            node.reject(fmt::format("node {} is a child of node {}, expected a root", number, parents[number]));
        if (is_listed[number]) node.reject(fmt::format("node {} is in the list twice", number));
        is_listed[number] = true;
        roots.push_back(number);
    }
    return roots;
}

}  // namespace

glm::dmat4 gltf_matrix(const glm::dvec3& translation, const glm::dvec4& q, const glm::dvec3& scale) {
    const double x = q.x, y = q.y, z = q.z, w = q.w;
    return {scale.x * glm::dvec4(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0),
            scale.y * glm::dvec4(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0),
            scale.z * glm::dvec4(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0),
            glm::dvec4(translation, 1)};
}

glm::dmat4 GltfPose::local() const {
    return matrix ? *matrix : gltf_matrix(translation, rotation, scale);
}

glm::dmat4 GltfPose::local_rotation() const {
    if (!matrix) return gltf_matrix(glm::dvec3(0.0), rotation, glm::dvec3(1.0));
    std::array<glm::dvec3, 3> axes = {glm::dvec3((*matrix)[0]), glm::dvec3((*matrix)[1]), glm::dvec3((*matrix)[2])};
    for (std::size_t i = 0; i < 3; ++i)  // one that is scaled to nothing
        if (glm::length(axes[i]) == 0.0) axes[i] = glm::cross(axes[(i + 1) % 3], axes[(i + 2) % 3]);
    // A mirrored matrix is taken as one whose scale is negative in x.
    const glm::dvec3 z = axes[2], x = glm::cross(axes[1], z);
    if (!(glm::length(x) > 0.0)) return glm::dmat4(1.0);
    const glm::dvec3 unit_z = glm::normalize(z), unit_x = glm::normalize(x);
    return {glm::dvec4(unit_x, 0), glm::dvec4(glm::cross(unit_z, unit_x), 0), glm::dvec4(unit_z, 0),
            glm::dvec4(0, 0, 0, 1)};
}

GltfNodes read_gltf_nodes(GltfDocument& document, const LoadOptions& options) {
    GltfNodes nodes;
    if (options.time_seconds) animate_gltf(document, *options.time_seconds, options.animation);
    const std::size_t count = document.count("nodes");
    for (std::size_t i = 0; i < count; ++i) {
        GltfValue node = document.element("nodes", i);
        node.remember_what_is_read();
        nodes.poses.push_back(read_pose(node));
        for (const char* read_later : {"camera", "children", "mesh", "skin"}) node.find(read_later);
        document.warn_of_unread_members(node);
    }
    std::vector<std::vector<std::size_t>> children;
    const std::vector<std::size_t> parents = read_parents(document, children);
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < count; ++i)
        if (parents[i] == kNone) roots.push_back(i);
    const std::vector<std::size_t> order = nodes_under(roots, children);
    nodes.world.resize(count, glm::dmat4(1.0));
    nodes.rotation.resize(count, glm::dmat4(1.0));
    std::vector<bool> is_reached(count);
    for (const std::size_t i : order) {
        is_reached[i] = true;
        const GltfPose& pose = nodes.poses[i];
        const std::size_t parent = parents[i];
        nodes.world[i] = parent == kNone ? pose.local() : nodes.world[parent] * pose.local();
        nodes.rotation[i] = parent == kNone ? pose.local_rotation() : nodes.rotation[parent] * pose.local_rotation();
    }
    for (std::size_t i = 0; i < count; ++i)
        if (!is_reached[i]) document.element("nodes", i).reject("is its own child, by a circle of children");
    const auto is_hidden = [&](std::size_t i) {
        const auto extension = document.element("nodes", i).find_extension("KHR_node_visibility");
        return extension && !extension->flag("visible", true);
    };
    for (std::vector<std::size_t>& list : children) std::erase_if(list, is_hidden);
    roots = shown_roots(document, parents, roots);
    std::erase_if(roots, is_hidden);
    nodes.shown = nodes_under(roots, children);
    return nodes;
}

}  // namespace castor
