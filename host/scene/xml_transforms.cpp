#include "scene/xml_transforms.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <string>

#include "scene/xml_numbers.h"

namespace castor {

namespace {

glm::dmat4 read_translation(XmlDocument& document, pugi::xml_node element) {
    const auto v = read_numbers<float, 3>(document, element);
    return glm::translate(glm::dmat4(1.0), glm::dvec3(v[0], v[1], v[2]));
}

glm::dmat4 read_scaling(XmlDocument& document, pugi::xml_node element) {
    const auto v = read_numbers<float, 3>(document, element);
    return glm::scale(glm::dmat4(1.0), glm::dvec3(v[0], v[1], v[2]));
}

/// Reads a rotation: the angle in degrees, counter-clockwise, and the axis.
glm::dmat4 read_rotation(XmlDocument& document, pugi::xml_node element) {
    const auto v = read_numbers<float, 4>(document, element);
    const glm::dvec3 axis(v[1], v[2], v[3]);
    if (v[0] == 0.0f) return glm::dmat4(1.0);  // about any axis, and none
    if (axis == glm::dvec3(0.0))
        document.fail(element, "the axis of <Rotation> is 0 0 0: an angle and a direction were expected");
    return glm::rotate(glm::dmat4(1.0), glm::radians(static_cast<double>(v[0])), glm::normalize(axis));
}

/// Reads a matrix, row by row.
glm::dmat4 read_composite(XmlDocument& document, pugi::xml_node element) {
    const auto v = read_numbers<float, 16>(document, element);
    if (v[12] != 0.0f || v[13] != 0.0f || v[14] != 0.0f || v[15] != 1.0f)
        document.fail(element, fmt::format("the last row of <Composite> is {} {} {} {}: 0 0 0 1 was expected", v[12],
                                           v[13], v[14], v[15]));
    glm::dmat4 matrix;
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) matrix[column][row] = v[static_cast<std::size_t>(4 * row + column)];
    return matrix;
}

struct Kind {
    const char* name;
    char letter;
    glm::dmat4 (*read)(XmlDocument&, pugi::xml_node);
};
constexpr std::array kKinds = {Kind{"Translation", 't', read_translation}, Kind{"Scaling", 's', read_scaling},
                               Kind{"Rotation", 'r', read_rotation}, Kind{"Composite", 'c', read_composite}};

}  // namespace

XmlTransforms::XmlTransforms(XmlDocument& document) : document_(document) {
    for (const pugi::xml_node container : document.root().children("Transformations")) {
        document.expect_attributes(container);
        document.expect_children(container, {}, {"Translation", "Scaling", "Rotation", "Composite"});
        for (const pugi::xml_node element : container.children())
            for (const Kind& kind : kKinds)
                if (element.name() == std::string_view(kind.name))
                    read(element, kind.letter, kind.read(document, element));
    }
}

void XmlTransforms::read(pugi::xml_node element, char kind, const glm::dmat4& matrix) {
    if (!element.attribute("id"))
        document_.fail(element, fmt::format("<{}> has no id: objects could not name it", element.name()));
    const std::int64_t id = read_integer_attribute(document_, element, "id", 0);
    if (!matrices_.emplace(std::pair(kind, id), matrix).second)
        document_.warn(element,
                       fmt::format("the id {} of a <{}> occurs again: objects get the first one", id, element.name()));
}

glm::dmat4 XmlTransforms::of(pugi::xml_node element) const {
    glm::dmat4 result(1.0);
    const pugi::xml_node list = element.child("Transformations");
    if (!list) return result;
    document_.expect_attributes(list);
    const std::string text = read_string(document_, list);
    constexpr const char* kSpaces = " \t\r\n";
    for (std::size_t begin = text.find_first_not_of(kSpaces); begin != text.npos;) {
        const std::size_t end = std::min(text.find_first_of(kSpaces, begin), text.size());
        const std::string word = text.substr(begin, end - begin);
        std::int64_t id = 0;
        const auto parsed = std::from_chars(word.data() + 1, word.data() + word.size(), id);
        if (parsed.ec != std::errc() || parsed.ptr != word.data() + word.size() ||
            std::string_view("tsrc").find(word[0]) == std::string_view::npos)
            document_.fail(list,
                           fmt::format("'{}' is no transformation: t, s, r or c and its id were expected, as in t1",
                                       xml_excerpt(word)));
        const auto found = matrices_.find({word[0], id});
        if (found == matrices_.end()) document_.fail(list, fmt::format("the transformation {} does not exist", word));
        result = found->second * result;
        begin = text.find_first_not_of(kSpaces, end);
    }
    return result;
}

Transform to_transform(const glm::dmat4& matrix) {
    return Transform(glm::vec3(matrix[0]), glm::vec3(matrix[1]), glm::vec3(matrix[2]), glm::vec3(matrix[3]));
}

}  // namespace castor
