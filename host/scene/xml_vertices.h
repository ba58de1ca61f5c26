#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "castor/scene.h"
#include "scene/xml_document.h"

namespace castor {

/// The vertices that all objects of a file share, and the way from there to meshes with vertices of their own.
class XmlVertices {
public:
    XmlVertices(const XmlDocument& document, const std::vector<glm::vec3>& positions);

    /// The vertex that the file calls `number` (from 1) after adding `offset`; SceneError at `where` if there is none.
    std::uint32_t find(std::int64_t number, std::int64_t offset, const char* where) const;
    const glm::vec3& position(std::uint32_t vertex) const { return positions_[vertex]; }

    /// From now on `add` fills another mesh.
    void begin_mesh() { ++mesh_; }
    /// The place of a vertex in `mesh`, which gets it at its first use. Two vertices at the same position stay two.
    std::uint32_t add(Mesh& mesh, std::uint32_t vertex);

private:
    const XmlDocument& document_;
    const std::vector<glm::vec3>& positions_;
    // Valid where mesh_of_vertex_ is mesh_: so no mesh has to clear what may be much larger than itself.
    std::vector<std::uint32_t> place_of_vertex_;
    std::vector<std::uint64_t> mesh_of_vertex_;
    std::uint64_t mesh_ = 0;
};

}  // namespace castor
