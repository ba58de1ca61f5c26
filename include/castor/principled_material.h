#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>

namespace castor {

/// What alpha means: nothing, that a surface is there where alpha is at least `alpha_cutoff`, or the share of the
/// surface that is there.
enum class AlphaMode { opaque, mask, blend };

/// A physically based material: base layer of dielectric or metal, under sheen and a clear coat, with the meanings that
/// glTF 2.0 and its KHR_materials extensions give the members of these names. Each factor is multiplied by its texture:
/// an index in Scene::textures, of target `principled`. Texels are divided by 255; those of colours are encoded by
/// sRGB's curve, all others are linear. R, G, B, A: the channel that a texture is read from. Colours are from 0 to 1;
/// `specular_color` and `emissive` may be more.
struct PrincipledMaterial {
    using TextureIndex = std::optional<std::uint32_t>;

    glm::vec3 base_color{1.0f};
    float alpha = 1.0f;
    TextureIndex base_color_texture{};  // A: alpha
    AlphaMode alpha_mode = AlphaMode::opaque;
    float alpha_cutoff = 0.5f;
    bool is_double_sided = false;
    bool is_unlit = false;  // sends its base colour, and reflects nothing

    float metallic = 1.0f;
    float roughness = 1.0f;
    TextureIndex metallic_roughness_texture{};  // G: roughness, B: metallic
    TextureIndex normal_texture{};              // in tangent space; green points up
    float normal_scale = 1.0f;

    glm::vec3 emissive{0.0f};  // radiance, 1 is white
    TextureIndex emissive_texture{};
    float emissive_strength = 1.0f;

    float ior = 1.5f;  // 0: all light is reflected
    float specular = 1.0f;
    TextureIndex specular_texture{};  // A
    glm::vec3 specular_color{1.0f};
    TextureIndex specular_color_texture{};

    float transmission = 0.0f;
    TextureIndex transmission_texture{};                                  // R
    float thickness = 0.0f;                                               // 0: the surface is a thin wall
    TextureIndex thickness_texture{};                                     // G
    float attenuation_distance = std::numeric_limits<float>::infinity();  // at which attenuation_color is left
    glm::vec3 attenuation_color{1.0f};
    float dispersion = 0.0f;  // 20 / Abbe number

    float diffuse_transmission = 0.0f;
    TextureIndex diffuse_transmission_texture{};  // A
    glm::vec3 diffuse_transmission_color{1.0f};
    TextureIndex diffuse_transmission_color_texture{};

    float clearcoat = 0.0f;
    TextureIndex clearcoat_texture{};  // R
    float clearcoat_roughness = 0.0f;
    TextureIndex clearcoat_roughness_texture{};  // G
    TextureIndex clearcoat_normal_texture{};
    float clearcoat_normal_scale = 1.0f;

    glm::vec3 sheen_color{0.0f};
    TextureIndex sheen_color_texture{};
    float sheen_roughness = 0.0f;
    TextureIndex sheen_roughness_texture{};  // A

    float anisotropy = 0.0f;
    float anisotropy_rotation_radians = 0.0f;  // counter-clockwise, from the tangent
    TextureIndex anisotropy_texture{};         // R, G: the direction, B: the strength

    float iridescence = 0.0f;
    TextureIndex iridescence_texture{};  // R
    float iridescence_ior = 1.3f;
    float iridescence_thickness_minimum = 100.0f;  // nanometres
    float iridescence_thickness_maximum = 400.0f;
    TextureIndex iridescence_thickness_texture{};  // G: between the two

    float diffuse_roughness = 0.0f;            // of the model EON; 0: the diffuse part is Lambert's
    TextureIndex diffuse_roughness_texture{};  // R

    // What is inside of a solid may scatter light: of what the attenuation takes, a part then goes on in another
    // direction. The colour is that of a thick layer. Black: nothing is scattered.
    glm::vec3 multiscatter_color{0.0f};
    float scattering_anisotropy = 0.0f;  // the mean cosine of the angle by which light is turned, above -1, below 1
};

}  // namespace castor
