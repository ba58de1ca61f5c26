#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "castor/scene.h"
#include "scene/xml_document.h"
#include "scene/xml_textures.h"
#include "scene/xml_transforms.h"

namespace castor {

// The readers of the containers of a <Scene>. All throw SceneError with the line.

/// The index in Scene::materials for each id of the file, which may be any integer.
using XmlMaterialIds = std::map<std::int64_t, std::uint32_t>;

/// An element of <BRDFs>, which materials name by its id.
struct XmlBrdf {
    BrdfModel model = BrdfModel::blinn_phong;
    bool is_normalized = false;
    bool has_diffuse_fresnel = false;
    float exponent = 1.0f;
};
using XmlBrdfs = std::map<std::int64_t, XmlBrdf>;

/// The vertices that the objects of a file share.
struct XmlVertexData {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec2> texture_coordinates;
};

/// Returns the element and its id, such as "PointLight-1", without which a light has no name.
std::vector<std::string> names_of_light(pugi::xml_node element);

void read_cameras(XmlDocument& document, const XmlTransforms& transforms, Scene& scene);
void read_lights(XmlDocument& document, const XmlTransforms& transforms, XmlTextures& textures, Scene& scene);
XmlBrdfs read_brdfs(XmlDocument& document);
XmlMaterialIds read_materials(XmlDocument& document, const XmlBrdfs& brdfs, Scene& scene);
XmlVertexData read_vertex_data(XmlDocument& document);
void read_objects(XmlDocument& document, const XmlMaterialIds& ids, const XmlVertexData& vertices,
                  const XmlTransforms& transforms, XmlTextures& textures, Scene& scene);
/// Reads the <Tonemap> elements of a camera.
std::vector<ToneMap> read_tone_maps(XmlDocument& document, pugi::xml_node camera);
/// Reads how a camera's picture is path traced; empty: it is not.
std::optional<PathTracing> read_path_tracing(XmlDocument& document, pugi::xml_node camera,
                                             std::uint32_t max_recursion_depth);

}  // namespace castor
