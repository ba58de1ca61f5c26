#include "scene/principled.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "castor/shared/constants.h"
#include "image/srgb.h"

namespace castor {

namespace {

constexpr float kWhite = 255.0f;

class StandIns {
public:
    explicit StandIns(Scene& scene) : scene_(scene) {}

    void make() {
        // Materials are few; the list does not grow meanwhile.
        for (Material& material : scene_.materials)
            if (material.principled) make(material, *material.principled);
        add_mesh_lights();
    }

private:
    using TextureIndex = PrincipledMaterial::TextureIndex;

    void make(Material& to, const PrincipledMaterial& from) {
        const glm::vec3 emission = kWhite * (from.is_unlit ? from.base_color : from.emissive_strength * from.emissive);
        const TextureIndex emission_texture = from.is_unlit ? from.base_color_texture : from.emissive_texture;
        if (emits(from)) {
            if (emission_texture)
                to.textures.push_back(
                    picture_texture(*emission_texture, TextureTarget::replace_all, emission, std::nullopt, 0.0f));
            else
                to.emission = emission;
            return;
        }
        if (from.emissive != glm::vec3(0.0f) && !from.is_unlit) warn("surfaces that both reflect and emit do not emit");
        if (from.alpha_mode == AlphaMode::mask) warn("surfaces with holes by alpha are drawn without them");
        const float metallic = from.metallic * mean(from.metallic_roughness_texture).z;
        const float roughness = from.roughness * mean(from.metallic_roughness_texture).y;
        const float alpha = std::max(roughness * roughness, 1e-3f);
        const bool is_see_through = from.alpha_mode == AlphaMode::blend && from.alpha < 0.5f;
        if (from.transmission > 0.5f || is_see_through) {
            make_glass(to, from, is_see_through, alpha);
            return;
        }
        to.brdf = BrdfModel::torrance_sparrow;
        to.phong_exponent = std::clamp(2.0f / (alpha * alpha) - 2.0f, 0.0f, 1e5f);
        const glm::vec3 base = from.base_color * mean_color(from.base_color_texture);
        if (metallic >= 0.5f) {
            to.kind = MaterialKind::mirror;
            to.mirror = to.specular = base;
            to.roughness = 2.0f * alpha;
            to.refraction_index = 1.0f;
            to.absorption_index = 1e4f;  // whose Fresnel term is 1
        } else {
            to.specular = glm::min(from.specular * from.specular_color, glm::vec3(1.0f));
            to.diffuse_fresnel = true;
            to.refraction_index = from.ior == 0.0f ? 1e4f : from.ior;
        }
        to.diffuse = base * (1.0f - metallic);
        if (from.base_color_texture && to.diffuse != glm::vec3(0.0f))
            to.textures.push_back(picture_texture(*from.base_color_texture, TextureTarget::replace_diffuse,
                                                  from.base_color, from.metallic_roughness_texture, from.metallic));
        if (from.normal_texture && has_first_set(*from.normal_texture))
            to.textures.push_back(normal_texture(*from.normal_texture, from.normal_scale));
    }

    /// Whether a surface sends light and reflects none. Of one that does both, the stand-in reflects.
    static bool emits(const PrincipledMaterial& from) {
        if (from.is_unlit) return true;
        const auto brightest = [](const glm::vec3& c) { return std::max({c.x, c.y, c.z}); };
        const float emitted = from.emissive_strength * brightest(from.emissive);
        if (from.emissive_texture) return emitted > 0.0f && brightest(from.base_color) == 0.0f;
        return emitted > 0.5f * brightest(from.base_color);
    }

    static void make_glass(Material& to, const PrincipledMaterial& from, bool is_see_through, float alpha) {
        to.kind = MaterialKind::dielectric;
        const bool is_thin = is_see_through || from.thickness == 0.0f;
        to.refraction_index = is_thin ? 1.0f : std::max(from.ior, 1.0f);
        to.roughness = is_thin ? 0.0f : 2.0f * alpha;
        if (is_thin || !std::isfinite(from.attenuation_distance)) return;
        constexpr float kDarkest = 1e-6f;
        for (int i = 0; i < 3; ++i)
            to.absorption[i] =
                -std::log(std::clamp(from.attenuation_color[i], kDarkest, 1.0f)) / from.attenuation_distance;
    }

    void add_mesh_lights() {
        constexpr std::size_t kMost = 16;
        std::vector<bool> has_instances(scene_.meshes.size());
        for (const MeshInstance& instance : scene_.instances) has_instances[instance.mesh] = true;
        std::size_t count = 0;
        for (std::size_t i = 0; i < scene_.meshes.size(); ++i) {
            const Material& material = scene_.materials[scene_.meshes[i].material];
            if (!material.principled || material.principled->is_unlit || material.emission == glm::vec3(0.0f)) continue;
            if (has_instances[i] || ++count > kMost) {
                warn("of meshes that emit, those with instances and all but the first 16 are seen, but light nothing");
                continue;
            }
            Light light;
            light.kind = Light::Kind::mesh;
            light.object.object = static_cast<std::uint32_t>(i);
            scene_.lights.push_back(light);
        }
    }

    const Image& image_of(std::uint32_t texture) const { return scene_.images[scene_.textures[texture].image]; }

    bool has_first_set(std::uint32_t texture) {
        if (scene_.textures[texture].coordinate_set == 0) return true;
        warn("pictures by the second texture coordinates are not drawn");
        return false;
    }

    /// Returns the mean of the channels, of 1 in all; (1, 1, 1) without a texture.
    glm::vec3 mean(const TextureIndex& texture) {
        return mean(texture, [](std::uint8_t byte) { return byte / kWhite; });
    }
    glm::vec3 mean_color(const TextureIndex& texture) { return mean(texture, linear_of_srgb); }

    template <class Value>
    glm::vec3 mean(const TextureIndex& texture, const Value& value) const {
        if (!texture) return glm::vec3(1.0f);
        const Image& image = image_of(*texture);
        std::array<std::array<std::uint64_t, 256>, 3> counts{};
        for (std::size_t i = 0; i < image.bytes.size(); ++i) ++counts[i % 3][image.bytes[i]];
        glm::dvec3 sum(0.0);
        for (int c = 0; c < 3; ++c)
            for (std::size_t byte = 0; byte < 256; ++byte)
                sum[c] += static_cast<double>(counts[static_cast<std::size_t>(c)][byte]) *
                          double{value(static_cast<std::uint8_t>(byte))};
        return glm::vec3(sum / (static_cast<double>(image.bytes.size()) / 3.0));
    }

    /// Adds a texture as another one is, but of another picture. What interpolates does so between the middles of
    /// texels.
    std::uint32_t add_texture(std::uint32_t like, TextureTarget target, Image&& image) {
        Texture texture = scene_.textures[like];
        texture.target = target;
        texture.coordinate_set = 0;
        texture.normalizer = target == TextureTarget::replace_diffuse ? 1.0f : 255.0f;
        texture.image = static_cast<std::uint32_t>(scene_.images.size());
        if (texture.filter != TextureFilter::nearest) {
            const auto shift = [](TextureWrap wrap, std::uint32_t size) {
                return wrap == TextureWrap::mirror ? 0.0f : 0.5f / static_cast<float>(size);
            };
            texture.transform[2].x -= shift(texture.wrap, image.width);
            texture.transform[2].y -= shift(texture.wrap_v.value_or(texture.wrap), image.height);
        }
        scene_.images.push_back(std::move(image));
        scene_.textures.push_back(texture);
        return static_cast<std::uint32_t>(scene_.textures.size() - 1);
    }

    /// Returns a texture of the linear picture times `factor`, and 1 - `metallic` times blue of `metals`.
    std::uint32_t picture_texture(std::uint32_t texture, TextureTarget target, const glm::vec3& factor,
                                  const TextureIndex& metals, float metallic) {
        has_first_set(texture);
        const auto key = std::make_tuple(texture, target, metals.value_or(CASTOR_INVALID_INDEX), metallic,
                                         std::array{factor.x, factor.y, factor.z});
        if (const auto known = pictures_.find(key); known != pictures_.end()) return known->second;
        const Image& from = image_of(texture);
        Image made;
        made.file = from.file;
        made.width = from.width;
        made.height = from.height;
        made.floats.resize(from.bytes.size());
        const Image* metal = metals && metallic > 0.0f ? &image_of(*metals) : nullptr;
        for (std::uint32_t y = 0; y < from.height; ++y)
            for (std::uint32_t x = 0; x < from.width; ++x) {
                float share = 1.0f - (metal ? 0.0f : metallic);
                if (metal) {
                    const std::size_t column = std::size_t{x} * metal->width / from.width;
                    const std::size_t row = std::size_t{y} * metal->height / from.height;
                    share = 1.0f - metallic * metal->bytes[3 * (row * metal->width + column) + 2] / kWhite;
                }
                const std::size_t i = 3 * (std::size_t{y} * from.width + x);
                for (std::size_t c = 0; c < 3; ++c)
                    made.floats[i + c] = linear_of_srgb(from.bytes[i + c]) * factor[static_cast<int>(c)] * share;
            }
        return pictures_[key] = add_texture(texture, target, std::move(made));
    }

    std::uint32_t normal_texture(std::uint32_t texture, float scale) {
        const auto key = std::make_tuple(texture, TextureTarget::normal_map, CASTOR_INVALID_INDEX, scale,
                                         std::array{0.0f, 0.0f, 0.0f});
        if (const auto known = pictures_.find(key); known != pictures_.end()) return known->second;
        Image made = image_of(texture);
        made.alpha.clear();
        const auto scaled = [&](std::uint8_t byte, float by) {
            return static_cast<std::uint8_t>(
                std::clamp(127.5f + by * (static_cast<float>(byte) - 127.5f), 0.0f, 255.0f) + 0.5f);
        };
        for (std::size_t i = 0; i + 2 < made.bytes.size(); i += 3) {
            made.bytes[i] = scaled(made.bytes[i], scale);
            made.bytes[i + 1] = scaled(made.bytes[i + 1], -scale);
        }
        return pictures_[key] = add_texture(texture, TextureTarget::normal_map, std::move(made));
    }

    void warn(const std::string& text) {
        for (const Warning& known : scene_.warnings)
            if (known.text == text) return;
        scene_.warnings.push_back({scene_.file, 0, text});
    }

    Scene& scene_;
    std::map<std::tuple<std::uint32_t, TextureTarget, std::uint32_t, float, std::array<float, 3>>, std::uint32_t>
        pictures_;
};

}  // namespace

void stand_in_for_principled(Scene& scene) {
    StandIns(scene).make();
}

}  // namespace castor
