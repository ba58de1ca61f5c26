#include "scene/xml_textures.h"

#include <cmath>
#include <string_view>
#include <utility>

#include "scene/named_files.h"
#include "scene/scene_limits.h"
#include "scene/xml_files.h"
#include "scene/xml_numbers.h"

namespace castor {

namespace {

void read_image_use(XmlDocument& document, pugi::xml_node element, Texture& texture) {
    texture.target = read_word_child(document, element, "DecalMode", texture.target,
                                     {{"replace_kd", TextureTarget::replace_diffuse},
                                      {"blend_kd", TextureTarget::blend_diffuse},
                                      {"replace_ks", TextureTarget::replace_specular},
                                      {"replace_all", TextureTarget::replace_all},
                                      {"replace_background", TextureTarget::background},
                                      {"replace_normal", TextureTarget::normal_map},
                                      {"bump_normal", TextureTarget::bump_map}});
    texture.filter = read_word_child(document, element, "Interpolation", texture.filter,
                                     {{"nearest", TextureFilter::nearest},
                                      {"bilinear", TextureFilter::bilinear},
                                      {"trilinear", TextureFilter::trilinear}});
    texture.wrap = read_word_child(document, element, "Appearance", texture.wrap,
                                   {{"repeat", TextureWrap::repeat}, {"clamp", TextureWrap::clamp}});
    texture.normalizer = read_float(document, element, "Normalizer", texture.normalizer);
    check_child(document, texture.normalizer > 0.0f, element, "Normalizer", "a positive number");
    texture.bump_factor = read_float(document, element, "BumpFactor", texture.bump_factor);
}

void read_noise(XmlDocument& document, pugi::xml_node element, Texture& texture) {
    texture.noise_conversion =
        read_word_child(document, element, "NoiseConversion", texture.noise_conversion,
                        {{"linear", NoiseConversion::linear}, {"absval", NoiseConversion::absolute}});
    texture.noise_scale = read_float(document, element, "NoiseScale", texture.noise_scale);
    const std::int64_t octaves = read_integer(document, element, "NumOctaves", texture.noise_octaves);
    check_child(document, octaves >= 1 && octaves <= kMaxNoiseOctaves, element, "NumOctaves",
                "a number of 1 to 32 octaves");
    texture.noise_octaves = static_cast<std::uint32_t>(octaves);
}

void read_checkerboard(XmlDocument& document, pugi::xml_node element, Texture& texture) {
    texture.black = read_vec3(document, element, "BlackColor", texture.black);
    texture.white = read_vec3(document, element, "WhiteColor", texture.white);
    texture.checker_scale = read_float(document, element, "Scale", texture.checker_scale);
    texture.checker_offset = read_float(document, element, "Offset", texture.checker_offset);
}

}  // namespace

XmlTextures::XmlTextures(XmlDocument& document, Scene& scene) : document_(document), scene_(scene) {
    for (const pugi::xml_node container : document.root().children("Textures")) {
        document.expect_attributes(container);
        document.expect_children(container, {}, {"Images", "TextureMap", "Texture"});
        for (const pugi::xml_node images : container.children("Images")) read_images(images);
    }
    // Textures name images, and may precede them in the file.
    for (const pugi::xml_node container : document.root().children("Textures")) read_textures(container);
}

void XmlTextures::read_images(pugi::xml_node container) {
    document_.expect_attributes(container);
    document_.expect_children(container, {}, {"Image"});
    for (const pugi::xml_node element : container.children("Image")) {
        const std::int64_t id = require_id(document_, element);
        if (!images_.emplace(id, load_image(element)).second)
            document_.warn(element, fmt::format("the image id {} occurs again: textures get the first one", id));
    }
}

void XmlTextures::read_textures(pugi::xml_node container) {
    for (const pugi::xml_node element : container.children()) {
        const std::string_view name = element.name();
        if (name != "TextureMap" && name != "Texture") continue;
        const std::int64_t id = require_id(document_, element);
        const auto index = static_cast<std::uint32_t>(scene_.textures.size());
        scene_.textures.push_back(read_texture(element));
        if (!textures_.emplace(id, index).second)
            document_.warn(element, fmt::format("the texture id {} occurs again: objects get the first one", id));
        if (scene_.textures.back().target != TextureTarget::background) continue;
        if (scene_.background_texture)
            document_.warn(element, "another texture replaces the background already: this one is ignored");
        else
            scene_.background_texture = index;
    }
}

Texture XmlTextures::read_texture(pugi::xml_node element) {
    document_.expect_attributes(element, {"type"});
    document_.expect_children(
        element, {"ImageId", "ImageName", "DecalMode", "Interpolation", "Appearance", "Normalizer", "BumpFactor",
                  "NoiseConversion", "NoiseScale", "NumOctaves", "BlackColor", "WhiteColor", "Scale", "Offset"});
    Texture texture;
    texture.line = document_.line(element);
    texture.kind = read_word_attribute(
        document_, element, "type", TextureKind::image,
        {{"image", TextureKind::image}, {"perlin", TextureKind::perlin}, {"checkerboard", TextureKind::checkerboard}});
    if (texture.kind == TextureKind::image) {
        const pugi::xml_node name = element.child("ImageName");
        texture.image = name ? load_image(name) : image_of(element);
    }
    read_image_use(document_, element, texture);
    read_noise(document_, element, texture);
    read_checkerboard(document_, element, texture);
    return texture;
}

std::uint32_t XmlTextures::load_image(pugi::xml_node element) {
    const std::string name = read_string(document_, element);
    const std::filesystem::path file = path_beside(document_, name);
    const auto [known, is_new] = by_file_.emplace(file, static_cast<std::uint32_t>(scene_.images.size()));
    if (!is_new) return known->second;
    warn_if_outside(document_, element.name(), file, fmt::format("<{}>", element.name()));
    std::string problem;
    scene_.images.push_back(read_named_picture(file, problem));
    if (!problem.empty()) document_.warn(element, problem);
    return known->second;
}

std::uint32_t XmlTextures::image_of(pugi::xml_node element) {
    const std::int64_t id = require_integer(document_, element, "ImageId");
    const auto found = images_.find(id);
    if (found == images_.end())
        document_.fail(element.child("ImageId"),
                       fmt::format("the image {} does not exist: {}", id, list_ids(images_, "images")));
    return found->second;
}

std::uint32_t XmlTextures::find_texture(std::int64_t id, pugi::xml_node list) const {
    const auto found = textures_.find(id);
    if (found == textures_.end())
        document_.fail(list, fmt::format("the texture {} does not exist: {}", id, list_ids(textures_, "textures")));
    return found->second;
}

std::vector<std::uint32_t> XmlTextures::of(pugi::xml_node element) {
    std::vector<std::uint32_t> result;
    for (const pugi::xml_node list : element.children()) {
        if (list.name() != std::string_view("Textures") && list.name() != std::string_view("Texture")) continue;
        document_.expect_attributes(list);
        document_.expect_text(list);
        XmlNumbers ids(document_, list);
        std::int64_t id = 0;
        while (ids.next(id)) {
            const std::uint32_t texture = find_texture(id, list);
            if (scene_.textures[texture].target == TextureTarget::background)
                document_.warn(list, fmt::format("the texture {} replaces the background, and is ignored here", id));
            else
                result.push_back(texture);
        }
    }
    return result;
}

}  // namespace castor
