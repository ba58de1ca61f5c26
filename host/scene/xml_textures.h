#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "castor/scene.h"
#include "scene/xml_document.h"

namespace castor {

/// The images and textures of a file, by id. A picture that cannot be read is a warning, and a checkerboard of magenta
/// and black takes its place.
class XmlTextures {
public:
    /// Reads all <Textures> of the root into the scene. A texture that replaces the background becomes
    /// Scene::background_texture. Throws SceneError.
    XmlTextures(XmlDocument& document, Scene& scene);

    /// Returns the indices in Scene::textures of those that an object lists in <Textures>, or in <Texture>.
    std::vector<std::uint32_t> of(pugi::xml_node element);

    /// Returns the index in Scene::images of the image that the child <ImageId> names.
    std::uint32_t image_of(pugi::xml_node element);

private:
    void read_images(pugi::xml_node container);
    void read_textures(pugi::xml_node container);
    Texture read_texture(pugi::xml_node element);
    std::uint32_t find_texture(std::int64_t id, pugi::xml_node list) const;
    std::uint32_t load_image(pugi::xml_node element);

    XmlDocument& document_;
    Scene& scene_;
    std::map<std::int64_t, std::uint32_t> images_;            // index in Scene::images by id
    std::map<std::int64_t, std::uint32_t> textures_;          // index in Scene::textures by id
    std::map<std::filesystem::path, std::uint32_t> by_file_;  // so that a picture is read once
};

}  // namespace castor
