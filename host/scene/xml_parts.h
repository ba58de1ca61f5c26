#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <vector>

#include "castor/scene.h"
#include "scene/xml_document.h"
#include "scene/xml_transforms.h"

namespace castor {

// The readers of the containers of a <Scene>. All throw SceneError with the line.

/// The index in Scene::materials for each id of the file, which may be any integer.
using XmlMaterialIds = std::map<std::int64_t, std::uint32_t>;

void read_cameras(XmlDocument& document, Scene& scene);
void read_lights(XmlDocument& document, Scene& scene);
XmlMaterialIds read_materials(XmlDocument& document, Scene& scene);
std::vector<glm::vec3> read_vertex_data(XmlDocument& document);
void read_objects(XmlDocument& document, const XmlMaterialIds& ids, const std::vector<glm::vec3>& vertices,
                  const XmlTransforms& transforms, Scene& scene);

}  // namespace castor
