#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "castor/scene.h"
#include "scene/xml_document.h"
#include "scene/xml_parts.h"

namespace castor {

/// The vertices that all objects of a file share, and their copies in the meshes, which have vertices of their own.
class XmlVertices {
public:
    XmlVertices(const XmlDocument& document, const XmlVertexData& data);

    /// Returns the index of the vertex that the file calls `number` + `offset`, counted from 1. Throws SceneError with
    /// the line of `where` if there is none.
    std::uint32_t find(std::int64_t number, std::int64_t offset, const char* where) const;
    const glm::vec3& position(std::uint32_t vertex) const { return positions_[vertex]; }

    /// Begins another mesh, which `add` then fills. The texture coordinates of a vertex are those with its index plus
    /// `texture_shift`.
    void begin_mesh(std::int64_t texture_shift = 0);
    /// Returns the index of a vertex in `mesh`, to which it is added at its first use, with its texture coordinates if
    /// the file has any. Two vertices at the same position stay two.
    std::uint32_t add(Mesh& mesh, std::uint32_t vertex);
    /// Returns whether a vertex of the mesh has no texture coordinates in the file. They are (0, 0) then.
    bool lacks_coordinates() const { return lacks_coordinates_; }

private:
    glm::vec2 texture_coordinates_of(std::uint32_t vertex);

    const XmlDocument& document_;
    const std::vector<glm::vec3>& positions_;
    const std::vector<glm::vec2>& texture_coordinates_;
    // Valid where mesh_of_vertex_ is mesh_, so that a small mesh need not clear an array for all vertices.
    std::vector<std::uint32_t> place_of_vertex_;
    std::vector<std::uint64_t> mesh_of_vertex_;
    std::uint64_t mesh_ = 0;
    std::int64_t texture_shift_ = 0;
    bool lacks_coordinates_ = false;
};

}  // namespace castor
