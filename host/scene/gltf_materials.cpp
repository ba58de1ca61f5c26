#include "scene/gltf_materials.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "castor/error.h"
#include "image/decode.h"
#include "scene/gltf_choice.h"

namespace castor {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

glm::vec3 color(const GltfValue& value, const char* key, const glm::vec3& otherwise) {
    const auto c = value.numbers<3>(key, {otherwise.x, otherwise.y, otherwise.z}, 0.0f);
    return {c[0], c[1], c[2]};
}

/// A colour by which surfaces multiply light. Above 1 they would send more than they receive.
glm::vec3 color_of_shares(const GltfValue& value, const char* key, const glm::vec3& otherwise) {
    const auto c = value.shares<3>(key, {otherwise.x, otherwise.y, otherwise.z});
    return {c[0], c[1], c[2]};
}

/// KHR_texture_transform: uv' = offset + R (scale * uv), with R the turn that a viewer sees as counter-clockwise, v
/// pointing down.
glm::mat3x2 read_transform(const GltfValue& extension) {
    const auto offset = extension.numbers<2>("offset", {0, 0}), scale = extension.numbers<2>("scale", {1, 1});
    const double rotation = double{extension.number("rotation", 0.0f)};
    const double cosine = std::cos(rotation), sine = std::sin(rotation);
    glm::mat3x2 m;
    m[0] = {static_cast<float>(cosine * scale[0]), static_cast<float>(-sine * scale[0])};
    m[1] = {static_cast<float>(sine * scale[1]), static_cast<float>(cosine * scale[1])};
    m[2] = {offset[0], offset[1]};
    return m;
}

TextureWrap read_wrap(const GltfValue& sampler, const char* key) {
    switch (sampler.whole(key, 10497)) {
        case 33071:
            return TextureWrap::clamp;
        case 33648:
            return TextureWrap::mirror;
        case 10497:
            return TextureWrap::repeat;
        default:
            sampler.require(key).reject("is none of 33071, 33648 and 10497");
    }
}

TextureFilter read_filter(const GltfValue& sampler) {
    constexpr std::uint64_t kNearest = 9728, kLinear = 9729, kFirstMipmap = 9984, kLastMipmap = 9987;
    const std::uint64_t larger = sampler.whole("magFilter", kLinear), smaller = sampler.whole("minFilter", kLastMipmap);
    if (larger != kNearest && larger != kLinear) sampler.require("magFilter").reject("is none of 9728 and 9729");
    const bool has_mipmaps = smaller >= kFirstMipmap && smaller <= kLastMipmap;
    if (!has_mipmaps && smaller != kNearest && smaller != kLinear)
        sampler.require("minFilter").reject("is none of 9728, 9729 and 9984 to 9987");
    if (larger == kNearest) return TextureFilter::nearest;
    return has_mipmaps ? TextureFilter::trilinear : TextureFilter::bilinear;
}

// A picture may have many texels a byte, but not each of very many.
constexpr std::uint64_t kFewTexels = 1 << 26, kTexelsAByte = 8 * 1032;

std::uint64_t texel_count(const Image& image) {
    return std::uint64_t{image.width} * image.height;
}

/// Returns a picture of roughness, of one whose alpha is glossiness before its factor.
Image roughness_of(const Image& image, float glossiness) {
    Image result{image.file, image.width, image.height};
    result.bytes.reserve(image.bytes.size());
    for (std::size_t i = 0; i < texel_count(image); ++i) {
        const float alpha = image.alpha.empty() ? 255.0f : static_cast<float>(image.alpha[i]);
        result.bytes.insert(result.bytes.end(), 3, static_cast<std::uint8_t>(std::lround(255.0f - glossiness * alpha)));
    }
    return result;
}

}  // namespace

GltfMaterials::GltfMaterials(GltfDocument& document, Scene& scene, const std::optional<std::string>& variant)
    : document_(document), scene_(scene) {
    if (!variant) return;
    variants_ = choose_gltf_elements(document, gltf_material_variants(document), *variant, "material variant");
}

void GltfMaterials::read_sampler(const GltfValue& texture, Texture& to) const {
    to.filter = TextureFilter::trilinear;
    const auto index = texture.find("sampler");
    if (!index) return;
    const GltfValue sampler = document_.element("samplers", index->index_of("samplers"));
    to.wrap = read_wrap(sampler, "wrapS");
    const TextureWrap wrap_v = read_wrap(sampler, "wrapT");
    if (wrap_v != to.wrap) to.wrap_v = wrap_v;
    to.filter = read_filter(sampler);
}

std::optional<std::uint32_t> GltfMaterials::image_of(const GltfValue& texture, std::optional<float> glossiness) {
    auto source = texture.find("source");
    if (const auto webp = texture.find_extension("EXT_texture_webp"); webp && decodes_webp())
        source = webp->require("source");
    if (!source) return std::nullopt;
    const ImageUse use{source->index_of("images"), glossiness};
    const auto [known, is_new] = images_.emplace(use, static_cast<std::uint32_t>(image_uses_.size()));
    if (is_new) image_uses_.push_back(use);
    return known->second;
}

GltfMaterials::TextureIndex GltfMaterials::texture(const GltfValue& owner, const char* key,
                                                   std::optional<float> glossiness, float* scale) {
    auto info = owner.find(key);
    if (!info) return std::nullopt;
    info->remember_what_is_read();
    if (scale) *scale = info->number("scale", 1.0f);
    const TextureIndex found = texture_of(*info, glossiness);
    document_.warn_of_unread_members(*info);
    return found;
}

GltfMaterials::TextureIndex GltfMaterials::texture_of(const GltfValue& info, std::optional<float> glossiness) {
    const GltfValue index = info.require("index");
    const GltfValue value = document_.element("textures", index.index_of("textures"));
    Texture texture;
    texture.target = TextureTarget::principled;
    std::uint64_t set = info.whole("texCoord", 0);
    auto transform = info.find_extension("KHR_texture_transform");
    if (transform) {
        transform->remember_what_is_read();
        texture.transform = read_transform(*transform);
        set = transform->whole("texCoord", set);
        document_.warn_of_unread_members(*transform);
    }
    if (set > 1) {
        document_.warn_at(info.path(), fmt::format("texture coordinates {} are not read, only sets 0 and 1", set));
        return std::nullopt;
    }
    texture.coordinate_set = static_cast<std::uint32_t>(set);
    std::string name = fmt::format("{} {} {}", index.whole(), set, transform ? transform->dump() : std::string());
    if (glossiness) name += fmt::format(" glossiness {}", *glossiness);
    if (const auto known = textures_.find(name); known != textures_.end()) return known->second;
    read_sampler(value, texture);
    const auto image = image_of(value, glossiness);
    if (!image) {
        document_.warn_at(value.path(), "has no source that is read, and is left out");
        return std::nullopt;
    }
    texture.image = *image;
    const auto number = static_cast<std::uint32_t>(scene_.textures.size());
    textures_.emplace(name, number);
    scene_.textures.push_back(texture);
    return number;
}

void GltfMaterials::read_extensions(const GltfValue& value, PrincipledMaterial& m) {
    std::vector<GltfValue> extensions;
    const auto extension = [&](const char* name) {
        auto found = value.find_extension(name);
        if (!found) return found;
        found->remember_what_is_read();
        extensions.push_back(*found);
        return found;
    };
    m.is_unlit = extension("KHR_materials_unlit").has_value();
    if (const auto e = extension("KHR_materials_emissive_strength"))
        m.emissive_strength = e->number("emissiveStrength", 1.0f, 0.0f, kInfinity);
    if (const auto e = extension("KHR_materials_ior")) {
        m.ior = e->number("ior", 1.5f, 0.0f, kInfinity);
        if (m.ior > 0.0f && m.ior < 1.0f) e->require("ior").reject("expected 0, or at least 1");
    }
    if (const auto e = extension("KHR_materials_specular")) {
        m.specular = e->number("specularFactor", 1.0f, 0.0f, 1.0f);
        m.specular_texture = texture(*e, "specularTexture");
        m.specular_color = color(*e, "specularColorFactor", m.specular_color);
        m.specular_color_texture = texture(*e, "specularColorTexture");
    }
    if (const auto e = extension("KHR_materials_transmission")) {
        m.transmission = e->number("transmissionFactor", 0.0f, 0.0f, 1.0f);
        m.transmission_texture = texture(*e, "transmissionTexture");
    }
    if (const auto e = extension("KHR_materials_volume")) {
        m.thickness = e->number("thicknessFactor", 0.0f, 0.0f, kInfinity);
        m.thickness_texture = texture(*e, "thicknessTexture");
        m.attenuation_distance = e->number("attenuationDistance", kInfinity, 0.0f, kInfinity);
        if (m.attenuation_distance == 0.0f) e->require("attenuationDistance").reject("expected a number above 0");
        m.attenuation_color = color_of_shares(*e, "attenuationColor", m.attenuation_color);
    }
    if (const auto e = extension("KHR_materials_volume_scatter")) read_scattering(*e, 1.0f, glm::vec3(0.0f), m);
    if (const auto e = extension("KHR_materials_scatter"))
        read_scattering(*e, e->number("scatterStrengthFactor", 0.0f, 0.0f, 1.0f), glm::vec3(1.0f), m);
    if (const auto e = extension("KHR_materials_dispersion"))
        m.dispersion = e->number("dispersion", 0.0f, 0.0f, kInfinity);
    if (const auto e = extension("KHR_materials_diffuse_transmission")) {
        m.diffuse_transmission = e->number("diffuseTransmissionFactor", 0.0f, 0.0f, 1.0f);
        m.diffuse_transmission_texture = texture(*e, "diffuseTransmissionTexture");
        m.diffuse_transmission_color =
            color_of_shares(*e, "diffuseTransmissionColorFactor", m.diffuse_transmission_color);
        m.diffuse_transmission_color_texture = texture(*e, "diffuseTransmissionColorTexture");
    }
    if (const auto e = extension("KHR_materials_clearcoat")) {
        m.clearcoat = e->number("clearcoatFactor", 0.0f, 0.0f, 1.0f);
        m.clearcoat_texture = texture(*e, "clearcoatTexture");
        m.clearcoat_roughness = e->number("clearcoatRoughnessFactor", 0.0f, 0.0f, 1.0f);
        m.clearcoat_roughness_texture = texture(*e, "clearcoatRoughnessTexture");
        m.clearcoat_normal_texture = texture(*e, "clearcoatNormalTexture", std::nullopt, &m.clearcoat_normal_scale);
    }
    if (const auto e = extension("KHR_materials_sheen")) {
        m.sheen_color = color_of_shares(*e, "sheenColorFactor", m.sheen_color);
        m.sheen_color_texture = texture(*e, "sheenColorTexture");
        m.sheen_roughness = e->number("sheenRoughnessFactor", 0.0f, 0.0f, 1.0f);
        m.sheen_roughness_texture = texture(*e, "sheenRoughnessTexture");
    }
    if (const auto e = extension("KHR_materials_anisotropy")) {
        m.anisotropy = e->number("anisotropyStrength", 0.0f, 0.0f, 1.0f);
        m.anisotropy_rotation_radians = e->number("anisotropyRotation", 0.0f);
        m.anisotropy_texture = texture(*e, "anisotropyTexture");
    }
    if (const auto e = extension("KHR_materials_iridescence")) {
        m.iridescence = e->number("iridescenceFactor", 0.0f, 0.0f, 1.0f);
        m.iridescence_texture = texture(*e, "iridescenceTexture");
        m.iridescence_ior = e->number("iridescenceIor", 1.3f, 1.0f, kInfinity);
        m.iridescence_thickness_minimum = e->number("iridescenceThicknessMinimum", 100.0f, 0.0f, kInfinity);
        m.iridescence_thickness_maximum = e->number("iridescenceThicknessMaximum", 400.0f, 0.0f, kInfinity);
        m.iridescence_thickness_texture = texture(*e, "iridescenceThicknessTexture");
    }
    if (const auto e = extension("KHR_materials_diffuse_roughness")) {
        m.diffuse_roughness = e->number("diffuseRoughnessFactor", 0.0f, 0.0f, 1.0f);
        m.diffuse_roughness_texture = texture(*e, "diffuseRoughnessTexture");
    }
    if (const auto e = extension("KHR_materials_pbrSpecularGlossiness")) read_specular_glossiness(*e, m);
    for (const GltfValue& read : extensions) document_.warn_of_unread_members(read);
}

/// Of what is inside of a solid. Colours are those of the whole solid: their textures are not read.
void GltfMaterials::read_scattering(const GltfValue& extension, float strength, const glm::vec3& otherwise,
                                    PrincipledMaterial& m) {
    // Files of the draft have either name.
    const char* color = extension.find("multiscatterColor") ? "multiscatterColor" : "multiscatterColorFactor";
    m.multiscatter_color = strength * color_of_shares(extension, color, otherwise);
    constexpr float kBelowOne = 0x1.fffffep-1f;  // the range is open
    m.scattering_anisotropy = extension.number("scatterAnisotropy", 0.0f, -kBelowOne, kBelowOne);
    for (const char* key : {"multiscatterColorTexture", "scatterStrengthTexture"})
        if (const auto info = extension.find(key))
            document_.warn_at(info->path(), "is not read: what is inside of a solid has one colour");
    if (m.thickness == 0.0f && m.multiscatter_color != glm::vec3(0.0f))
        document_.warn_at(extension.path(), "scatters nothing: the material has no thickness (KHR_materials_volume)");
}

/// In place of metal and roughness. The same surface is one without metal that reflects all light head-on, in the
/// colour that is given (KHR_materials_specular, 2021, "Conversions").
void GltfMaterials::read_specular_glossiness(const GltfValue& extension, PrincipledMaterial& m) {
    const auto diffuse = extension.shares<4>("diffuseFactor", {1, 1, 1, 1});
    m.base_color = {diffuse[0], diffuse[1], diffuse[2]};
    m.alpha = diffuse[3];
    m.base_color_texture = texture(extension, "diffuseTexture");
    m.metallic = 0.0f;
    m.ior = 0.0f;
    m.specular = 1.0f;
    m.specular_texture = std::nullopt;
    m.specular_color = color_of_shares(extension, "specularFactor", glm::vec3(1.0f));
    m.specular_color_texture = texture(extension, "specularGlossinessTexture");
    const float glossiness = extension.number("glossinessFactor", 1.0f, 0.0f, 1.0f);
    m.metallic_roughness_texture = texture(extension, "specularGlossinessTexture", glossiness);
    m.roughness = m.metallic_roughness_texture ? 1.0f : 1.0f - glossiness;
}

PrincipledMaterial GltfMaterials::read_material(GltfValue value) {
    PrincipledMaterial m;
    value.remember_what_is_read();
    if (auto pbr = value.find("pbrMetallicRoughness")) {
        pbr->remember_what_is_read();
        const auto base = pbr->shares<4>("baseColorFactor", {1, 1, 1, 1});
        m.base_color = {base[0], base[1], base[2]};
        m.alpha = base[3];
        m.base_color_texture = texture(*pbr, "baseColorTexture");
        m.metallic = pbr->number("metallicFactor", 1.0f, 0.0f, 1.0f);
        m.roughness = pbr->number("roughnessFactor", 1.0f, 0.0f, 1.0f);
        m.metallic_roughness_texture = texture(*pbr, "metallicRoughnessTexture");
        document_.warn_of_unread_members(*pbr);
    }
    m.normal_texture = texture(value, "normalTexture", std::nullopt, &m.normal_scale);
    m.emissive = color(value, "emissiveFactor", m.emissive);
    document_.warn_above_one(value, "emissiveFactor");
    m.emissive_texture = texture(value, "emissiveTexture");
    const std::string mode = value.text("alphaMode", "OPAQUE");
    if (mode == "MASK")
        m.alpha_mode = AlphaMode::mask;
    else if (mode == "BLEND")
        m.alpha_mode = AlphaMode::blend;
    else if (mode != "OPAQUE")
        value.require("alphaMode").reject(fmt::format("\"{}\" is none of OPAQUE, MASK and BLEND", mode.substr(0, 40)));
    m.alpha_cutoff = value.number("alphaCutoff", 0.5f, 0.0f, kInfinity);
    m.is_double_sided = value.flag("doubleSided", false);
    read_extensions(value, m);
    document_.warn_of_unread_members(value);
    return m;
}

void GltfMaterials::read() {
    for (std::size_t i = 0; i < document_.count("materials"); ++i) {
        Material material;
        const GltfValue value = document_.element("materials", i);
        material.principled = read_material(value);
        material.name = value.name();
        scene_.materials.push_back(std::move(material));
    }
}

std::uint32_t GltfMaterials::material_of(const GltfValue& primitive) {
    auto index = primitive.find("material");
    if (const auto extension = primitive.find_extension("KHR_materials_variants"); extension && !variants_.empty()) {
        const GltfValue mappings = extension->require("mappings");
        for (std::size_t i = 0; i < mappings.size(); ++i) {
            const GltfValue mapping = mappings.at(i), list = mapping.require("variants");
            for (std::size_t k = 0; k < list.size(); ++k)
                if (std::ranges::find(variants_, list.at(k).whole()) != variants_.end())
                    index = mapping.require("material");
        }
    }
    if (index) return static_cast<std::uint32_t>(index->index_of("materials"));
    if (!has_default_material_) {
        has_default_material_ = true;
        default_material_ = static_cast<std::uint32_t>(scene_.materials.size());
        scene_.materials.emplace_back().principled.emplace();
    }
    return default_material_;
}

std::string_view GltfMaterials::image_bytes(const GltfValue& image) {
    if (const auto view = image.find("bufferView")) return document_.buffer_view(view->index_of("bufferViews"));
    return document_.resource(image.require("uri"));
}

std::optional<std::uint32_t> GltfMaterials::tangent_set(std::uint32_t material) const {
    const PrincipledMaterial& m = *scene_.materials[material].principled;
    for (const TextureIndex texture : {m.normal_texture, m.clearcoat_normal_texture, m.anisotropy_texture})
        if (texture) return scene_.textures[*texture].coordinate_set;
    return m.anisotropy > 0.0f ? std::optional<std::uint32_t>(0) : std::nullopt;
}

void GltfMaterials::read_images() {
    struct Job {
        std::size_t image;
        GltfValue value;
        std::string_view bytes;
    };
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < image_uses_.size(); ++i) {
        const GltfValue value = document_.element("images", image_uses_[i].number);
        if (!image_uses_[i].glossiness) jobs.push_back({i, value, image_bytes(value)});
    }
    scene_.images.resize(image_uses_.size());
    std::vector<std::string> errors(jobs.size());
    const std::uint64_t most_texels = kFewTexels + kTexelsAByte * document_.byte_count();
    std::atomic<std::uint64_t> texels = 0;
    tbb::parallel_for(std::size_t{0}, jobs.size(), [&](std::size_t i) {
        try {
            Image& image = scene_.images[jobs[i].image] = decode_picture(jobs[i].bytes, false);
            texels += texel_count(image);
            if (texels > most_texels) {
                image = {};
                errors[i] = fmt::format("with it, the pictures of {} bytes have more than {} texels",
                                        document_.byte_count(), most_texels);
                return;
            }
            if (image.bytes.empty()) errors[i] = "a picture of 8 or 16 bits was expected, not one of floats";
            image.file = jobs[i].value.path();
        } catch (const Error& error) {
            errors[i] = error.what();
        } catch (const std::bad_alloc&) {
            errors[i] = "there is not enough memory for the picture";
        }
    });
    for (std::size_t i = 0; i < jobs.size(); ++i)
        if (!errors[i].empty()) jobs[i].value.reject(errors[i]);
    make_roughness(kFewTexels + 4 * texels);
}

void GltfMaterials::make_roughness(std::uint64_t most_texels) {
    const auto image_of = [&](const ImageUse& use) -> const Image& {
        return scene_.images[images_.at({use.number, std::nullopt})];  // of the specular colours
    };
    std::uint64_t texels = 0;
    for (const ImageUse& use : image_uses_) {
        if (use.glossiness) texels += texel_count(image_of(use));
        if (texels > most_texels)
            document_.element("images", use.number)
                .reject(fmt::format("its factors of glossiness are so many that roughness has more than {} texels",
                                    most_texels));
    }
    for (std::size_t i = 0; i < image_uses_.size(); ++i)
        if (image_uses_[i].glossiness)
            scene_.images[i] = roughness_of(image_of(image_uses_[i]), *image_uses_[i].glossiness);
}

}  // namespace castor
