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

    /// Returns the product of the transformations that an object lists, of which the first is applied first; the
    /// identity if it lists none. Throws SceneError if one does not exist.
    glm::dmat4 of(pugi::xml_node element) const;

private:
    void read(pugi::xml_node element, char kind, const glm::dmat4& matrix);

    XmlDocument& document_;
    std::map<std::pair<char, std::int64_t>, glm::dmat4> matrices_;  // by kind, as lists write it: t, s, r or c
};

/// Rounds a matrix to single precision. Its last row is 0 0 0 1, which is checked when a <Composite> is read.
Transform to_transform(const glm::dmat4& matrix);

}  // namespace castor
