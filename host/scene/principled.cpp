#include "scene/principled.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "castor/shared/constants.h"

namespace castor {

namespace {

constexpr std::size_t kMostInstanceEmitters = std::size_t{1} << 20;  // 80 MiB

void store(float (&to)[3], const glm::vec3& from) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

std::uint32_t flags_of(const PrincipledMaterial& m) {
    const bool is_matched =
        m.thickness > 0.0f && m.transmission > 0.0f && m.ior == 1.0f && m.clearcoat == 0.0f && !m.is_unlit;
    return (m.thickness == 0.0f ? CASTOR_PRINCIPLED_THIN : 0) | (is_matched ? CASTOR_PRINCIPLED_MATCHED : 0) |
           (m.is_unlit ? CASTOR_PRINCIPLED_UNLIT : 0) |
           (m.alpha_mode == AlphaMode::mask ? CASTOR_PRINCIPLED_ALPHA_MASK : 0) |
           (m.alpha_mode == AlphaMode::blend ? CASTOR_PRINCIPLED_ALPHA_BLEND : 0);
}

}  // namespace

glm::vec3 emission_of(const Material& material) {
    if (!material.principled) return material.emission;
    const PrincipledMaterial& m = *material.principled;
    if (m.is_unlit) return kWhite * m.base_color;
    // A factor that is the same for rays that meet a lamp and for points that are drawn on it, whose normals differ.
    constexpr float kHeadOn = 0.04f;
    const float below_coat = m.clearcoat_texture ? 1.0f : 1.0f - kHeadOn * m.clearcoat;
    return kWhite * below_coat * (m.emissive_strength * m.emissive);
}

bool can_be_light(const Material& material) {
    if (emission_of(material) == glm::vec3(0.0f)) return false;
    if (!material.principled) return true;
    const PrincipledMaterial& m = *material.principled;
    const bool is_whole = m.alpha_mode == AlphaMode::opaque || (m.alpha >= 1.0f && !m.base_color_texture);
    return is_whole && !m.is_unlit;
}

shared::PrincipledMaterial to_shared(const PrincipledMaterial& m) {
    shared::PrincipledMaterial result{};
    store(result.base_color, m.base_color);
    result.metallic = m.metallic;
    store(result.specular_color, m.specular_color);
    result.specular = m.specular;
    store(result.sheen_color, m.sheen_color);
    result.sheen_roughness = m.sheen_roughness;
    store(result.diffuse_transmission_color, m.diffuse_transmission_color);
    result.diffuse_transmission = m.diffuse_transmission;
    result.roughness = m.roughness;
    result.anisotropy = m.anisotropy;
    result.diffuse_roughness = m.diffuse_roughness;
    result.transmission = m.transmission;
    constexpr float kLargestIndex = 1e3f;  // of 0, which means that all light is reflected
    result.refraction_index = m.ior == 0.0f ? kLargestIndex : m.ior;
    result.clearcoat = m.clearcoat;
    result.clearcoat_roughness = m.clearcoat_roughness;
    result.flags = flags_of(m);
    result.alpha = m.alpha;
    result.alpha_cutoff = m.alpha_cutoff;
    result.normal_scale = m.normal_scale;
    result.anisotropy_cosine = static_cast<float>(std::cos(double{m.anisotropy_rotation_radians}));
    result.anisotropy_sine = static_cast<float>(std::sin(double{m.anisotropy_rotation_radians}));
    result.clearcoat_normal_scale = m.clearcoat_normal_scale;
    result.dispersion = m.dispersion;
    result.scattering_anisotropy = m.scattering_anisotropy;
    result.iridescence = m.iridescence;
    result.iridescence_index = m.iridescence_ior;
    result.iridescence_thickness_minimum = m.iridescence_thickness_minimum;
    result.iridescence_thickness_maximum = m.iridescence_thickness_maximum;
    const auto set = [&](std::uint32_t slot, const PrincipledMaterial::TextureIndex& texture) {
        result.texture[slot] = texture.value_or(CASTOR_INVALID_INDEX);
    };
    set(CASTOR_SLOT_BASE_COLOR, m.base_color_texture);
    set(CASTOR_SLOT_METALLIC_ROUGHNESS, m.metallic_roughness_texture);
    set(CASTOR_SLOT_NORMAL, m.normal_texture);
    set(CASTOR_SLOT_EMISSION, m.is_unlit ? m.base_color_texture : m.emissive_texture);
    set(CASTOR_SLOT_SPECULAR, m.specular_texture);
    set(CASTOR_SLOT_SPECULAR_COLOR, m.specular_color_texture);
    set(CASTOR_SLOT_TRANSMISSION, m.transmission_texture);
    set(CASTOR_SLOT_DIFFUSE_TRANSMISSION, m.diffuse_transmission_texture);
    set(CASTOR_SLOT_DIFFUSE_TRANSMISSION_COLOR, m.diffuse_transmission_color_texture);
    set(CASTOR_SLOT_CLEARCOAT, m.clearcoat_texture);
    set(CASTOR_SLOT_CLEARCOAT_ROUGHNESS, m.clearcoat_roughness_texture);
    set(CASTOR_SLOT_SHEEN_COLOR, m.sheen_color_texture);
    set(CASTOR_SLOT_SHEEN_ROUGHNESS, m.sheen_roughness_texture);
    set(CASTOR_SLOT_ANISOTROPY, m.anisotropy_texture);
    set(CASTOR_SLOT_CLEARCOAT_NORMAL, m.clearcoat_normal_texture);
    set(CASTOR_SLOT_IRIDESCENCE, m.iridescence_texture);
    set(CASTOR_SLOT_IRIDESCENCE_THICKNESS, m.iridescence_thickness_texture);
    set(CASTOR_SLOT_DIFFUSE_ROUGHNESS, m.diffuse_roughness_texture);
    return result;
}

glm::vec3 absorption_of(const PrincipledMaterial& m) {
    glm::vec3 absorption(0.0f);
    const bool is_solid = m.thickness > 0.0f && (m.transmission > 0.0f || m.diffuse_transmission > 0.0f);
    if (!is_solid || !std::isfinite(m.attenuation_distance)) return absorption;
    constexpr float kDarkest = 1e-6f, kDensest = 1e30f;
    for (int i = 0; i < 3; ++i)
        absorption[i] =
            std::min(-std::log(std::clamp(m.attenuation_color[i], kDarkest, 1.0f)) / m.attenuation_distance, kDensest);
    return absorption;
}

glm::vec3 scattering_albedo_of(const PrincipledMaterial& m) {
    glm::vec3 albedo(0.0f);
    if (absorption_of(m) == glm::vec3(0.0f)) return albedo;
    for (int i = 0; i < 3; ++i) {
        const double color = std::clamp(double{m.multiscatter_color[i]}, 0.0, 1.0);
        const double s = 4.09712 + 4.20863 * color - std::sqrt(9.59217 + 41.6808 * color + 17.7126 * color * color);
        const double single = (1.0 - s * s) / (1.0 - double{m.scattering_anisotropy} * s * s);
        if (color > 0.0) albedo[i] = static_cast<float>(std::clamp(single, 0.0, 1.0));
    }
    return albedo;
}

void add_mesh_lights(Scene& scene) {
    std::size_t triangles = 0, left_out = 0;  // of further placements
    const auto can_shine = [&](const Mesh& mesh, std::uint32_t material) {
        const auto& principled = scene.materials[material].principled;
        const bool has_alpha = principled && principled->alpha_mode != AlphaMode::opaque && !mesh.colors.empty();
        return !has_alpha && can_be_light(scene.materials[material]);
    };
    const auto add = [&](Light::Kind kind, std::size_t object, std::uint32_t material) {
        Light light;
        light.kind = kind;
        light.object.object = static_cast<std::uint32_t>(object);
        if (const std::string& name = scene.materials[material].name; !name.empty()) light.names = {name};
        scene.lights.push_back(std::move(light));
    };
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
        if (const std::uint32_t material = scene.meshes[i].material; can_shine(scene.meshes[i], material))
            add(Light::Kind::mesh, i, material);
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[scene.instances[i].mesh];
        if (!can_shine(mesh, scene.instances[i].material)) continue;
        if (triangles + mesh.triangles.size() > kMostInstanceEmitters) {
            ++left_out;
            continue;
        }
        triangles += mesh.triangles.size();
        add(Light::Kind::instance, i, scene.instances[i].material);
    }
    if (left_out == 0) return;
    scene.warnings.push_back(
        {scene.file, 0,
         fmt::format(
             "{} of the instances that emit have more than {} triangles together, and are no lamps: their light "
             "is found by chance",
             left_out, kMostInstanceEmitters)});
}

}  // namespace castor
