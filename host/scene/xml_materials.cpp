#include <cmath>
#include <glm/vector_relational.hpp>

#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

float remove_gamma(float value) {
    return static_cast<float>(std::pow(double{value}, 2.2));
}

glm::vec3 read_reflectance(XmlDocument& document, pugi::xml_node element, const char* name, bool degamma) {
    glm::vec3 value = read_vec3(document, element, name, glm::vec3(0.0f));
    check_child(document, glm::all(glm::greaterThanEqual(value, glm::vec3(0.0f))), element, name,
                "three numbers of at least 0");
    if (!degamma) return value;
    // The power of a larger number may exceed the range of float.
    constexpr float kLargest = 1e17f;
    check_child(document, glm::all(glm::lessThanEqual(value, glm::vec3(kLargest))), element, name,
                "three numbers of at most 1e17 with degamma");
    return {remove_gamma(value.x), remove_gamma(value.y), remove_gamma(value.z)};
}

/// Reads what is left of light in a dielectric: e^(-c s) of AbsorptionCoefficient c after a length s, or, in older
/// files, t^s of Transparency t. Those files have no type="dielectric": what is transparent is one.
void read_absorption(XmlDocument& document, pugi::xml_node element, Material& material) {
    material.absorption = read_vec3(document, element, "AbsorptionCoefficient", material.absorption);
    check_child(document, glm::all(glm::greaterThanEqual(material.absorption, glm::vec3(0.0f))), element,
                "AbsorptionCoefficient", "three numbers of at least 0");
    if (!element.child("Transparency")) return;
    if (element.child("AbsorptionCoefficient")) {
        document.warn(element.child("Transparency"), "<Transparency> is ignored: there is an <AbsorptionCoefficient>");
        return;
    }
    const glm::vec3 transparency = require_vec3(document, element, "Transparency");
    const auto is_share = [](float t) { return t >= 0.0f && t <= 1.0f; };
    check_child(document, is_share(transparency.x) && is_share(transparency.y) && is_share(transparency.z), element,
                "Transparency", "three numbers of 0 to 1");
    if (transparency == glm::vec3(0.0f)) return;
    if (!element.attribute("type")) material.kind = MaterialKind::dielectric;
    for (int i = 0; i < 3; ++i) {
        // The logarithm of 0 is no number: nothing that can be seen is left after a thousandth of a unit of length.
        constexpr float kOpaque = 1e5f;
        material.absorption[i] =
            transparency[i] == 0.0f ? kOpaque : static_cast<float>(std::abs(std::log(double{transparency[i]})));
    }
}

void read_brdf(XmlDocument& document, pugi::xml_node element, const XmlBrdfs& brdfs, Material& material) {
    if (!element.attribute("BRDF")) return;
    const std::int64_t id = read_integer_attribute(document, element, "BRDF", 0);
    const auto found = brdfs.find(id);
    if (found == brdfs.end())
        document.fail(element.attribute("BRDF").name(),
                      fmt::format("the BRDF {} does not exist: {}", id, list_ids(brdfs, "BRDFs")));
    if (element.child("PhongExponent"))
        document.warn(element.child("PhongExponent"), "<PhongExponent> is ignored: the BRDF has an <Exponent>");
    const XmlBrdf& brdf = found->second;
    material.brdf = brdf.model;
    material.brdf_normalized = brdf.is_normalized;
    material.diffuse_fresnel = brdf.has_diffuse_fresnel;
    material.phong_exponent = brdf.exponent;
}

Material read_material(XmlDocument& document, pugi::xml_node element, const XmlBrdfs& brdfs) {
    document.expect_attributes(element, {"type", "degamma", "BRDF"});
    document.expect_children(element, {"AmbientReflectance", "DiffuseReflectance", "SpecularReflectance",
                                       "MirrorReflectance", "PhongExponent", "RefractionIndex", "AbsorptionIndex",
                                       "AbsorptionCoefficient", "Transparency", "Roughness"});
    Material material;
    material.kind = read_word_attribute(document, element, "type", MaterialKind::plain,
                                        {{"mirror", MaterialKind::mirror},
                                         {"conductor", MaterialKind::conductor},
                                         {"dielectric", MaterialKind::dielectric}});
    const bool degamma = read_word_attribute(document, element, "degamma", false, {{"true", true}, {"false", false}});
    material.ambient = read_reflectance(document, element, "AmbientReflectance", degamma);
    material.diffuse = read_reflectance(document, element, "DiffuseReflectance", degamma);
    material.specular = read_reflectance(document, element, "SpecularReflectance", degamma);
    material.mirror = read_reflectance(document, element, "MirrorReflectance", degamma);
    material.phong_exponent = read_float(document, element, "PhongExponent", material.phong_exponent);
    check_child(document, material.phong_exponent >= 0.0f, element, "PhongExponent", "a number of at least 0");
    material.refraction_index = read_float(document, element, "RefractionIndex", material.refraction_index);
    check_child(document, material.refraction_index >= 0.0f, element, "RefractionIndex", "a number of at least 0");
    material.absorption_index = read_float(document, element, "AbsorptionIndex", material.absorption_index);
    check_child(document, material.absorption_index >= 0.0f, element, "AbsorptionIndex", "a number of at least 0");
    read_absorption(document, element, material);
    check_child(document, material.refraction_index > 0.0f || material.kind != MaterialKind::dielectric, element,
                "RefractionIndex", "a positive number of a dielectric");
    material.roughness = read_float(document, element, "Roughness", material.roughness);
    check_child(document, material.roughness >= 0.0f, element, "Roughness", "a number of at least 0");
    read_brdf(document, element, brdfs, material);
    return material;
}

}  // namespace

XmlMaterialIds read_materials(XmlDocument& document, const XmlBrdfs& brdfs, Scene& scene) {
    XmlMaterialIds ids;
    for (const pugi::xml_node container : document.root().children("Materials")) {
        document.expect_attributes(container);
        document.expect_children(container, {}, {"Material"});
        for (const pugi::xml_node element : container.children("Material")) {
            const std::int64_t id = require_id(document, element);
            if (!ids.emplace(id, static_cast<std::uint32_t>(scene.materials.size())).second)
                document.warn(element, fmt::format("the material id {} occurs again: objects get the first one", id));
            scene.materials.push_back(read_material(document, element, brdfs));
        }
    }
    return ids;
}

}  // namespace castor
