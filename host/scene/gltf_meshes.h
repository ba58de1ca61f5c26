#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <optional>
#include <vector>

#include "scene/gltf_document.h"

namespace castor {

/// How a primitive of a mesh is bent: the weights of its morph targets, and the matrices of a skin's joints from the
/// mesh's space to the world. Empty: not at all.
struct GltfBend {
    std::vector<float> weights;
    std::vector<glm::dmat4> joints;
};

/// Counts what a file's primitives and nodes make (vertices, triangles, instances, joints ...), since many of them may
/// have the same data.
class GltfBudget {
public:
    /// Throws SceneError if they would take memory out of all proportion to the file.
    void charge(const GltfValue& owner, std::uint64_t elements);

private:
    std::uint64_t elements_ = 0;
};

/// Reads the triangles of a primitive, whose material is set to 0; nullopt if it has points or lines, of which it
/// warns. Only vertices that triangles use are kept. Throws SceneError.
std::optional<Mesh> read_gltf_primitive(GltfDocument& document, const GltfValue& primitive, const GltfBend& bend,
                                        GltfBudget& budget);

}  // namespace castor
