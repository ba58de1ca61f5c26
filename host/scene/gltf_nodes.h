#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "castor/scene_io.h"
#include "scene/gltf_document.h"

namespace castor {

/// The local transform of a node by its parts, or as a matrix. The rotation is a unit quaternion x, y, z, w.
struct GltfPose {
    glm::dvec3 translation{0.0};
    glm::dvec4 rotation{0.0, 0.0, 0.0, 1.0};
    glm::dvec3 scale{1.0};
    std::optional<glm::dmat4> matrix{};
    std::optional<std::vector<float>> weights{};  // of morph targets, where the node has its own

    glm::dmat4 local() const;
    /// Returns the rotation alone; of a matrix the one that keeps its z axis, and its y axis where it has no shear.
    glm::dmat4 local_rotation() const;
};

/// The nodes of a file: where they are in the world, and which of them the scene shows.
struct GltfNodes {
    std::vector<GltfPose> poses;
    std::vector<glm::dmat4> world;
    std::vector<glm::dmat4> rotation;  // to the world, by the rotations of a node and those above it alone
    std::vector<std::size_t> shown;    // depth first, children in their order, without those that are hidden
};

/// Reads the nodes in their rest pose, or as animate_gltf has them where the options have a time. Nodes must be trees.
/// Throws SceneError, and what animate_gltf throws.
GltfNodes read_gltf_nodes(GltfDocument& document, const LoadOptions& options);

/// Gives a file's JSON the values that animations give it at a time: see LoadOptions::animation. Throws UsageError if
/// there is no such animation. A file without any is warned of, unless a number or a name asks for one.
void animate_gltf(GltfDocument& document, double time_seconds, const std::optional<std::string>& animation);

/// Returns the matrix of translation, rotation and scale, in this order from the left.
glm::dmat4 gltf_matrix(const glm::dvec3& translation, const glm::dvec4& rotation, const glm::dvec3& scale);

}  // namespace castor
