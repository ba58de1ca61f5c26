#include "scene/xml_vertices.h"

#include <limits>

#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

XmlVertices::XmlVertices(const XmlDocument& document, const XmlVertexData& data)
    : document_(document),
      positions_(data.positions),
      texture_coordinates_(data.texture_coordinates),
      place_of_vertex_(data.positions.size()),
      mesh_of_vertex_(data.positions.size()) {}

void XmlVertices::begin_mesh(std::int64_t texture_shift) {
    ++mesh_;
    texture_shift_ = texture_shift;
    lacks_coordinates_ = texture_coordinates_.empty();
}

glm::vec2 XmlVertices::texture_coordinates_of(std::uint32_t vertex) {
    const std::int64_t index = vertex + texture_shift_;
    if (index >= 0 && index < static_cast<std::int64_t>(texture_coordinates_.size()))
        return texture_coordinates_[static_cast<std::size_t>(index)];
    lacks_coordinates_ = true;
    return glm::vec2(0.0f);
}

std::uint32_t XmlVertices::find(std::int64_t number, std::int64_t offset, const char* where) const {
    // Neither sum nor difference overflows: the offset was checked when it was read.
    const auto count = static_cast<std::int64_t>(positions_.size());
    if (number >= 1 - offset && number <= count - offset) return static_cast<std::uint32_t>(number + offset - 1);
    const std::string with_offset = offset == 0 ? "" : fmt::format(" (plus the vertexOffset {})", offset);
    if (count == 0)
        document_.fail(where,
                       fmt::format("the vertex {}{} does not exist: the scene has no vertices", number, with_offset));
    document_.fail(where, fmt::format("the vertex {}{} does not exist: the scene has {} vertices, numbered from 1",
                                      number, with_offset, count));
}

std::uint32_t XmlVertices::add(Mesh& mesh, std::uint32_t vertex) {
    if (mesh_of_vertex_[vertex] != mesh_) {
        mesh_of_vertex_[vertex] = mesh_;
        place_of_vertex_[vertex] = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back(positions_[vertex]);
        if (!texture_coordinates_.empty()) mesh.texture_coordinates.push_back(texture_coordinates_of(vertex));
    }
    return place_of_vertex_[vertex];
}

namespace {

std::vector<glm::vec3> read_positions(XmlDocument& document) {
    std::vector<glm::vec3> positions;
    const pugi::xml_node element = document.root().child("VertexData");
    if (!element) return positions;
    document.expect_attributes(element, {"type", "binaryFile"});
    document.expect_text(element);
    if (element.attribute("binaryFile"))
        document.fail(element, "binaryFile of <VertexData> is not supported: coordinates were expected as text");
    read_word_attribute(document, element, "type", 0, {{"xyz", 0}});

    XmlNumbers numbers(document, element);
    glm::vec3 position;
    while (numbers.next(position.x)) {
        if (!numbers.next(position.y) || !numbers.next(position.z))
            document.fail(numbers.where(),
                          fmt::format("<VertexData> ends within a vertex, after {} whole ones: x y z were expected",
                                      positions.size()));
        positions.push_back(position);
    }
    if (positions.size() >= std::numeric_limits<std::uint32_t>::max())
        document.fail(element, fmt::format("<VertexData> holds {} vertices: fewer than 4294967295 were expected",
                                           positions.size()));
    return positions;
}

std::vector<glm::vec2> read_texture_coordinates(XmlDocument& document) {
    std::vector<glm::vec2> coordinates;
    const pugi::xml_node element = document.root().child("TexCoordData");
    if (!element) return coordinates;
    document.expect_attributes(element, {"type", "binaryFile"});
    document.expect_text(element);
    if (element.attribute("binaryFile"))
        document.fail(element, "binaryFile of <TexCoordData> is not supported: coordinates were expected as text");
    read_word_attribute(document, element, "type", 0, {{"uv", 0}});

    XmlNumbers numbers(document, element);
    glm::vec2 pair;
    while (numbers.next(pair.x)) {
        if (!numbers.next(pair.y))
            document.fail(numbers.where(),
                          fmt::format("<TexCoordData> ends within a pair, after {} whole ones: u v were expected",
                                      coordinates.size()));
        coordinates.push_back(pair);
    }
    return coordinates;
}

}  // namespace

XmlVertexData read_vertex_data(XmlDocument& document) {
    return {read_positions(document), read_texture_coordinates(document)};
}

}  // namespace castor
