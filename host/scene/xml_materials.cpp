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

Material read_material(XmlDocument& document, pugi::xml_node element) {
    document.expect_attributes(element, {"type", "degamma"});
    document.expect_children(element, {"AmbientReflectance", "DiffuseReflectance", "SpecularReflectance",
                                       "MirrorReflectance", "PhongExponent", "RefractionIndex", "AbsorptionIndex"});
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
    check_child(document, material.refraction_index > 0.0f, element, "RefractionIndex", "a positive number");
    material.absorption_index = read_float(document, element, "AbsorptionIndex", material.absorption_index);
    check_child(document, material.absorption_index >= 0.0f, element, "AbsorptionIndex", "a number of at least 0");
    return material;
}

}  // namespace

XmlMaterialIds read_materials(XmlDocument& document, Scene& scene) {
    XmlMaterialIds ids;
    for (const pugi::xml_node container : document.root().children("Materials")) {
        document.expect_attributes(container);
        document.expect_children(container, {}, {"Material"});
        for (const pugi::xml_node element : container.children("Material")) {
            if (!element.attribute("id"))
                document.fail(element, "<Material> needs an attribute id, by which objects name it");
            const std::int64_t id = read_integer_attribute(document, element, "id", 0);
            if (!ids.emplace(id, static_cast<std::uint32_t>(scene.materials.size())).second)
                document.warn(element, fmt::format("the material id {} occurs again: objects get the first one", id));
            scene.materials.push_back(read_material(document, element));
        }
    }
    return ids;
}

}  // namespace castor
