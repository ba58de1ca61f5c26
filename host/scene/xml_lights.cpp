#include <glm/trigonometric.hpp>

#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

PointLight read_point_light(XmlDocument& document, pugi::xml_node element) {
    document.expect_children(element, {"Position", "Intensity"});
    return {require_vec3(document, element, "Position"), require_vec3(document, element, "Intensity")};
}

DirectionalLight read_directional_light(XmlDocument& document, pugi::xml_node element) {
    document.expect_children(element, {"Direction", "Radiance"});
    return {require_direction(document, element, "Direction"), require_vec3(document, element, "Radiance")};
}

SpotLight read_spot_light(XmlDocument& document, pugi::xml_node element) {
    document.expect_children(element, {"Position", "Direction", "Intensity", "CoverageAngle", "FalloffAngle"});
    SpotLight light;
    light.position = require_vec3(document, element, "Position");
    light.direction = require_direction(document, element, "Direction");
    light.intensity = require_vec3(document, element, "Intensity");
    const float coverage = require_float(document, element, "CoverageAngle");
    const float falloff = require_float(document, element, "FalloffAngle");
    check_child(document, coverage > 0.0f && coverage <= 360.0f, element, "CoverageAngle",
                "an angle of more than 0 and at most 360 degrees");
    check_child(document, falloff >= 0.0f && falloff <= coverage, element, "FalloffAngle",
                "an angle between 0 and the coverage angle");
    light.coverage_radians = glm::radians(coverage);
    light.falloff_radians = glm::radians(falloff);
    return light;
}

/// Reads a light. Returns false if the element is none.
bool read_light(XmlDocument& document, pugi::xml_node element, Light& light) {
    const std::string_view name = element.name();
    light.line = document.line(element);
    if (name == "PointLight") {
        light.kind = Light::Kind::point;
        light.point = read_point_light(document, element);
    } else if (name == "DirectionalLight") {
        light.kind = Light::Kind::directional;
        light.directional = read_directional_light(document, element);
    } else if (name == "SpotLight") {
        light.kind = Light::Kind::spot;
        light.spot = read_spot_light(document, element);
    } else {
        return false;
    }
    document.expect_attributes(element);
    return true;
}

}  // namespace

void read_lights(XmlDocument& document, Scene& scene) {
    for (const pugi::xml_node container : document.root().children("Lights")) {
        document.expect_attributes(container);
        document.expect_children(container, {"AmbientLight"}, {"PointLight", "DirectionalLight", "SpotLight"});
        scene.ambient_light = read_vec3(document, container, "AmbientLight", scene.ambient_light);
        Light light;
        for (const pugi::xml_node element : container.children())
            if (read_light(document, element, light)) scene.lights.push_back(light);
    }
}

}  // namespace castor
