#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "castor/scene.h"
#include "scene/xml_document.h"

namespace castor {

/// The vertices that all objects of a file share, and their copies in the meshes, which have vertices of their own.
class XmlVertices {
public:
    XmlVertices(const XmlDocument& document, const std::vector<glm::vec3>& positions);

    /// Returns the index of the vertex that the file calls `number` + `offset`, counted from 1. Throws SceneError with
    /// the line of `where` if there is none.
    std::uint32_t find(std::int64_t number, std::int64_t offset, const char* where) const;
    const glm::vec3& position(std::uint32_t vertex) const { return positions_[vertex]; }

    /// Begins another mesh, which `add` then fills.
    void begin_mesh() { ++mesh_; }
    /// Returns the index of a vertex in `mesh`, to which it is added at its first use. Two vertices at the same
    /// position stay two.
    std::uint32_t add(Mesh& mesh, std::uint32_t vertex);

private:
    const XmlDocument& document_;
    const std::vector<glm::vec3>& positions_;
    // Valid where mesh_of_vertex_ is mesh_, so that a small mesh need not clear an array for all vertices.
    std::vector<std::uint32_t> place_of_vertex_;
    std::vector<std::uint64_t> mesh_of_vertex_;
    std::uint64_t mesh_ = 0;
};

}  // namespace castor
