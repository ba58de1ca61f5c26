#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "scene/gltf_document.h"

namespace castor {

/// Makes the scene's materials, textures and images of a file's. Material i is the file's material i.
class GltfMaterials {
public:
    GltfMaterials(GltfDocument& document, Scene& scene) : document_(document), scene_(scene) {}

    /// Reads all materials.
    void read();
    /// Returns the index of the material of a primitive; that of the default material where it names none.
    std::uint32_t material_of(const GltfValue& primitive);
    /// Returns the set of texture coordinates along which a material needs tangents; nullopt if it needs none.
    std::optional<std::uint32_t> tangent_set(std::uint32_t material) const;
    /// Decodes the pictures that materials use, in parallel. After all materials are known.
    void read_images();

private:
    using TextureIndex = PrincipledMaterial::TextureIndex;

    PrincipledMaterial read_material(const GltfValue& value);
    void read_extensions(const GltfValue& value, PrincipledMaterial& material);
    TextureIndex texture(const GltfValue& owner, const char* key);
    void read_sampler(const GltfValue& texture, Texture& to) const;
    /// Returns the index of a texture's image; nullopt if it names none that is read.
    std::optional<std::uint32_t> image_of(const GltfValue& texture);
    std::string_view image_bytes(const GltfValue& image);

    GltfDocument& document_;
    Scene& scene_;
    std::map<std::string, std::uint32_t> textures_;
    std::map<std::size_t, std::uint32_t> images_;
    std::vector<std::size_t> image_numbers_;  // in the file
    std::uint32_t default_material_ = 0;
    bool has_default_material_ = false;
};

}  // namespace castor
