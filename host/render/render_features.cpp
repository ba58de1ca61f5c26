#include "render/render_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace castor {

namespace {

bool is_black(const float (&colour)[3]) {
    return colour[0] == 0.0f && colour[1] == 0.0f && colour[2] == 0.0f;
}

bool bounds_solid(const shared::PrincipledMaterial& m) {
    return (m.transmission > 0.0f || m.diffuse_transmission > 0.0f) && !(m.flags & CASTOR_PRINCIPLED_THIN);
}

}  // namespace

RenderFeatures features_of(const SceneArrays& arrays) {
    const auto any_material = [&](const auto& predicate) {
        return std::any_of(arrays.materials.begin(), arrays.materials.end(), predicate);
    };
    const auto any_principled = [&](const auto& predicate) {
        return std::any_of(arrays.principled_materials.begin(), arrays.principled_materials.end(), predicate);
    };
    const auto any_light = [&](const auto& predicate) {
        return std::any_of(arrays.lights.begin(), arrays.lights.end(), predicate);
    };
    RenderFeatures features;
    features.has_textures = arrays.background_texture != CASTOR_INVALID_INDEX ||
                            any_material([](const shared::Material& m) { return m.texture_count > 0; });
    features.has_other_textures = std::any_of(arrays.textures.begin(), arrays.textures.end(), [](const auto& texture) {
        return texture.target == CASTOR_TARGET_REPLACE_ALL || texture.target == CASTOR_TARGET_REPLACE_SPECULAR ||
               texture.target == CASTOR_TARGET_BACKGROUND;
    });
    features.has_textures_with_axes =
        std::any_of(arrays.textures.begin(), arrays.textures.end(), [](const auto& texture) {
            return texture.target == CASTOR_TARGET_NORMAL_MAP || texture.target == CASTOR_TARGET_BUMP_MAP ||
                   (texture.target < CASTOR_TARGET_BACKGROUND && texture.filter == CASTOR_TEXTURE_TRILINEAR);
        });
    features.has_dielectrics =
        any_material([](const shared::Material& m) { return m.kind == CASTOR_MATERIAL_DIELECTRIC; }) ||
        any_principled(bounds_solid);
    features.has_roughness = any_material([](const shared::Material& m) { return m.roughness > 0.0f; });
    features.has_brdfs = any_material([](const shared::Material& m) { return m.brdf != CASTOR_BRDF_BLINN_PHONG; });
    features.has_emission = any_material([](const shared::Material& m) { return !is_black(m.emission); });
    features.has_sampled_lights = any_light([](const shared::Light& light) { return CASTOR_IS_SAMPLED_LIGHT(light); });
    features.has_environment =
        any_light([](const shared::Light& light) { return light.kind == CASTOR_LIGHT_ENVIRONMENT; });
    features.has_light_shapes = any_light([](const shared::Light& light) {
        return CASTOR_IS_SAMPLED_LIGHT(light) && light.kind != CASTOR_LIGHT_ENVIRONMENT;
    });
    features.has_light_tree = !arrays.light_nodes.empty();
    features.has_light_ranges = any_light([](const shared::Light& light) {
        return (light.kind == CASTOR_LIGHT_POINT || light.kind == CASTOR_LIGHT_SPOT) && light.size > 0.0f;
    });
    features.has_suns = any_light([](const shared::Light& light) { return CASTOR_IS_SUN(light); });
    features.has_motion = std::any_of(arrays.instances.begin(), arrays.instances.end(), [](const shared::Instance& i) {
        return i.motion[0] != 0.0f || i.motion[1] != 0.0f || i.motion[2] != 0.0f;
    });
    features.has_principled = !arrays.principled_materials.empty();
    features.has_classic = any_material([](const shared::Material& m) { return m.kind != CASTOR_MATERIAL_PRINCIPLED; });
    features.has_opacity = any_principled([&](const shared::PrincipledMaterial& m) {
        return m.flags & (CASTOR_PRINCIPLED_ALPHA_MASK | CASTOR_PRINCIPLED_ALPHA_BLEND) &&
               (m.alpha < 1.0f || m.texture[CASTOR_SLOT_BASE_COLOR] != CASTOR_INVALID_INDEX ||
                !arrays.vertex_attributes.empty());
    });
    features.has_optics = any_principled([](const shared::PrincipledMaterial& m) {
        const std::uint32_t of_base = m.texture[CASTOR_SLOT_NORMAL], of_coat = m.texture[CASTOR_SLOT_CLEARCOAT_NORMAL];
        const bool is_one =
            of_base == of_coat && (m.normal_scale == m.clearcoat_normal_scale || of_base == CASTOR_INVALID_INDEX);
        const bool has_specular = m.specular != 1.0f || m.specular_color[0] != 1.0f || m.specular_color[1] != 1.0f ||
                                  m.specular_color[2] != 1.0f ||
                                  m.texture[CASTOR_SLOT_SPECULAR] != CASTOR_INVALID_INDEX ||
                                  m.texture[CASTOR_SLOT_SPECULAR_COLOR] != CASTOR_INVALID_INDEX;
        const bool is_other_glass =  // for which there is no table
            m.transmission > 0.0f && !(m.flags & CASTOR_PRINCIPLED_THIN) && (m.anisotropy > 0.0f || has_specular);
        return m.iridescence > 0.0f || m.dispersion > 0.0f || (m.clearcoat > 0.0f && !is_one) || is_other_glass;
    });
    features.has_panes = any_principled([](const shared::PrincipledMaterial& m) {
        const bool may_be_smooth = (m.roughness * m.roughness < CASTOR_LEAST_ALPHA && m.metallic < 1.0f) ||
                                   m.texture[CASTOR_SLOT_METALLIC_ROUGHNESS] != CASTOR_INVALID_INDEX;
        return m.transmission > 0.0f && (m.flags & CASTOR_PRINCIPLED_THIN) && may_be_smooth;
    });
    features.has_matched_solids =
        any_principled([](const shared::PrincipledMaterial& m) { return m.flags & CASTOR_PRINCIPLED_MATCHED; }) &&
        any_light([](const shared::Light& light) { return is_met_by_none(light); });
    features.has_panes |= features.has_matched_solids;
    features.has_scattering = any_material([](const shared::Material& m) { return !is_black(m.scattering_albedo); });
    features.has_attributes =
        features.has_principled &&
        (!arrays.vertex_attributes.empty() || any_principled([](const shared::PrincipledMaterial& m) {
            const bool has_texture = std::any_of(std::begin(m.texture), std::end(m.texture),
                                                 [](std::uint32_t texture) { return texture != CASTOR_INVALID_INDEX; });
            return has_texture || m.anisotropy > 0.0f;  // which lies along tangents
        }));
    return features;
}

bool is_met_by_none(const shared::Light& light) {
    return light.kind <= CASTOR_LIGHT_AREA && !CASTOR_IS_SUN(light);
}

std::vector<bool> solid_materials(const SceneArrays& arrays) {
    const auto is_solid = [&](const shared::Material& m) {
        if (m.kind != CASTOR_MATERIAL_PRINCIPLED) return m.kind == CASTOR_MATERIAL_DIELECTRIC;
        return bounds_solid(arrays.principled_materials[m.principled]);
    };
    std::vector<bool> solid;
    if (std::any_of(arrays.materials.begin(), arrays.materials.end(),
                    [&](const shared::Material& m) { return is_solid(m) && !is_black(m.absorption); }))
        std::transform(arrays.materials.begin(), arrays.materials.end(), std::back_inserter(solid), is_solid);
    return solid;
}

std::string build_options(const RenderFeatures& features) {
    return fmt::format(
               "-DCASTOR_HAS_TEXTURES={} -DCASTOR_HAS_OTHER_TEXTURES={} -DCASTOR_HAS_TEXTURES_WITH_AXES={} "
               "-DCASTOR_HAS_DIELECTRICS={} -DCASTOR_HAS_ROUGHNESS={} -DCASTOR_HAS_BRDFS={} -DCASTOR_HAS_EMISSION={} "
               "-DCASTOR_HAS_SAMPLED_LIGHTS={} -DCASTOR_HAS_ENVIRONMENT={} -DCASTOR_HAS_MOTION={}",
               int{features.has_textures}, int{features.has_other_textures}, int{features.has_textures_with_axes},
               int{features.has_dielectrics}, int{features.has_roughness}, int{features.has_brdfs},
               int{features.has_emission}, int{features.has_sampled_lights}, int{features.has_environment},
               int{features.has_motion}) +
           (features.traces_paths
                ? fmt::format(" -DCASTOR_TRACES_PATHS=1 -DCASTOR_HAS_CLASSIC={} -DCASTOR_HAS_PRINCIPLED={} "
                              "-DCASTOR_HAS_ATTRIBUTES={} -DCASTOR_HAS_OPTICS={} -DCASTOR_HAS_LIGHT_SHAPES={} "
                              "-DCASTOR_HAS_LIGHT_TREE={}",
                              int{features.has_classic}, int{features.has_principled}, int{features.has_attributes},
                              int{features.has_optics}, int{features.has_light_shapes}, int{features.has_light_tree}) +
                      (features.has_panes ? " -DCASTOR_HAS_PANES=1" : "") +
                      (features.has_matched_solids ? " -DCASTOR_HAS_MATCHED_SOLIDS=1" : "") +
                      (features.has_scattering ? " -DCASTOR_HAS_SCATTERING=1" : "") +
                      (features.has_suns ? " -DCASTOR_HAS_SUNS=1" : "")
                : "") +
           (features.has_light_ranges ? " -DCASTOR_HAS_LIGHT_RANGES=1" : "") +
           (features.has_light_groups ? " -DCASTOR_HAS_LIGHT_GROUPS=1" : "");
}

KernelProgram wave_program(const RenderFeatures& features) {
    KernelProgram program{features.has_textures ? "textured_wave.lanes" : "wave.lanes", ""};
    if (features.has_slot_sums()) program.options += " -DCASTOR_HAS_SLOT_SUMS=1";
    if (features.has_light_groups) program.options += " -DCASTOR_HAS_LIGHT_GROUPS=1";
    if (features.has_textures && !features.has_other_textures) program.options += " -DCASTOR_HAS_OTHER_TEXTURES=0";
    return program;
}

}  // namespace castor
