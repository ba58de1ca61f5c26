#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <map>
#include <utility>

#include "castor/scene.h"
#include "scene/xml_document.h"

namespace castor {

/// The transformations that a file defines, by kind and id. They are composed in double precision.
class XmlTransforms {
public:
    /// Reads all <Transformations> of the root. Throws SceneError.
    explicit XmlTransforms(XmlDocument& document);

    /// What the child <Transformations> of an object lists, the first applied first: the identity if there is none.
    /// Throws SceneError where it names what does not exist.
    glm::dmat4 of(pugi::xml_node element) const;

private:
    void read(pugi::xml_node element, char kind, const glm::dmat4& matrix);

    XmlDocument& document_;
    std::map<std::pair<char, std::int64_t>, glm::dmat4> matrices_;  // by kind, as lists write it: t, s, r or c
};

/// Rounded once. Of a <Composite> the last row must be 0 0 0 1, which is checked where it is read.
Transform to_transform(const glm::dmat4& matrix);

}  // namespace castor
