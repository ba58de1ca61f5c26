#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "scene/gltf_value.h"

namespace castor {

/// Whether this build has the library that decodes KHR_draco_mesh_compression.
bool decodes_draco();

/// An attribute of a mesh that Draco compressed: `components` values a vertex, one vertex after the other.
struct DracoAttribute {
    std::size_t components = 0;
    bool has_floats = false;  // else all values are whole numbers
    std::vector<double> values;
};

/// A mesh that Draco compressed. Indices are below the number of vertices.
struct DracoMesh {
    std::vector<glm::uvec3> triangles;
    std::map<std::string, DracoAttribute> attributes;  // by the names that the extension gives them
};

/// How many triangles the bytes of a mesh say they hold, before any of them is decoded. Throws SceneError with the
/// extension's path, here as below, if the bytes do not begin as Draco's.
std::uint64_t draco_triangle_count(const GltfValue& extension, std::string_view bytes);

/// Decodes a mesh, which must have so many vertices, and the attributes that the extension names.
DracoMesh decode_draco(const GltfValue& extension, std::string_view bytes, std::size_t vertex_count);

}  // namespace castor
