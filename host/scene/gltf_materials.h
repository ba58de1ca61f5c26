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
    /// With the materials of a variant: see LoadOptions::material_variant. Throws UsageError if there is no such one.
    GltfMaterials(GltfDocument& document, Scene& scene, const std::optional<std::string>& variant);

    /// Reads all materials.
    void read();
    /// Returns the index of the material of a primitive, which the variant may choose; that of the default material
    /// where it names none.
    std::uint32_t material_of(const GltfValue& primitive);
    /// Returns the set of texture coordinates along which a material needs tangents; nullopt if it needs none.
    std::optional<std::uint32_t> tangent_set(std::uint32_t material) const;
    /// Decodes the pictures that materials use, in parallel. After all materials are known.
    void read_images();

private:
    using TextureIndex = PrincipledMaterial::TextureIndex;

    PrincipledMaterial read_material(GltfValue value);
    void read_extensions(const GltfValue& value, PrincipledMaterial& material);
    void read_specular_glossiness(const GltfValue& extension, PrincipledMaterial& material);
    void read_scattering(const GltfValue& extension, float strength, const glm::vec3& otherwise, PrincipledMaterial& m);
    /// Where a factor of glossiness is given, the texture is one of the roughness instead: 1 - factor * A. `scale`: of
    /// a normal map, set where there is one.
    TextureIndex texture(const GltfValue& owner, const char* key, std::optional<float> glossiness = std::nullopt,
                         float* scale = nullptr);
    TextureIndex texture_of(const GltfValue& info, std::optional<float> glossiness);
    void read_sampler(const GltfValue& texture, Texture& to) const;
    /// Returns the index of a texture's image; nullopt if it names none that is read.
    std::optional<std::uint32_t> image_of(const GltfValue& texture, std::optional<float> glossiness);
    std::string_view image_bytes(const GltfValue& image);
    /// Makes the pictures of roughness of those of glossiness. A file of few bytes may have many factors: SceneError if
    /// they make more texels.
    void make_roughness(std::uint64_t most_texels);

    GltfDocument& document_;
    Scene& scene_;
    std::map<std::string, std::uint32_t> textures_;
    struct ImageUse {
        std::size_t number = 0;           // in the file
        std::optional<float> glossiness;  // whose roughness the image is to hold: see texture()
        auto operator<=>(const ImageUse&) const = default;
    };
    std::map<ImageUse, std::uint32_t> images_;
    std::vector<ImageUse> image_uses_;
    std::vector<std::size_t> variants_;  // that are chosen
    std::uint32_t default_material_ = 0;
    bool has_default_material_ = false;
};

}  // namespace castor
