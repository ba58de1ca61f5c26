#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <string>
#include <utility>
#include <vector>

#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

glm::vec3 moved_point(const glm::dmat4& matrix, const glm::vec3& point) {
    return glm::vec3(matrix * glm::dvec4(point, 1.0));
}

glm::vec3 turned(const glm::dmat4& matrix, const glm::vec3& direction) {
    return glm::vec3(glm::dmat3(matrix) * glm::dvec3(direction));
}

PointLight read_point_light(XmlDocument& document, pugi::xml_node element, const glm::dmat4& matrix) {
    document.expect_children(element, {"Position", "Intensity", "Transformations"});
    return {moved_point(matrix, require_vec3(document, element, "Position")),
            require_vec3(document, element, "Intensity")};
}

DirectionalLight read_directional_light(XmlDocument& document, pugi::xml_node element, const glm::dmat4& matrix) {
    document.expect_children(element, {"Direction", "Radiance", "Angle", "Transformations"});
    const float angle = read_float(document, element, "Angle", 0.0f);
    check_child(document, angle >= 0.0f && angle <= 180.0f, element, "Angle", "an angle of 0 to 180 degrees");
    return {turned(matrix, require_direction(document, element, "Direction")),
            require_vec3(document, element, "Radiance"), glm::radians(angle)};
}

SpotLight read_spot_light(XmlDocument& document, pugi::xml_node element, const glm::dmat4& matrix) {
    document.expect_children(
        element, {"Position", "Direction", "Intensity", "CoverageAngle", "FalloffAngle", "Transformations"});
    SpotLight light;
    light.position = moved_point(matrix, require_vec3(document, element, "Position"));
    light.direction = turned(matrix, require_direction(document, element, "Direction"));
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

/// Reads an area light. A transformation keeps it square: it moves the centre, turns the normal and scales the edge by
/// the mean of its scales.
AreaLight read_area_light(XmlDocument& document, pugi::xml_node element, const glm::dmat4& matrix) {
    document.expect_children(element, {"Position", "Normal", "Size", "Radiance", "Transformations"});
    AreaLight light;
    light.position = moved_point(matrix, require_vec3(document, element, "Position"));
    light.normal = require_direction(document, element, "Normal");
    light.size = require_float(document, element, "Size");
    light.radiance = require_vec3(document, element, "Radiance");
    check_child(document, light.size > 0.0f, element, "Size", "a positive number");
    if (matrix == glm::dmat4(1.0)) return light;
    const glm::dmat3 linear(matrix);
    light.normal = glm::vec3(glm::normalize(glm::transpose(glm::inverse(linear)) * glm::dvec3(light.normal)));
    light.size = static_cast<float>(light.size * std::cbrt(std::abs(glm::determinant(linear))));
    return light;
}

EnvironmentLight read_environment_light(XmlDocument& document, pugi::xml_node element, XmlTextures& textures) {
    document.expect_attributes(element, {"type"});
    document.expect_children(element, {"ImageId", "Sampler"});
    EnvironmentLight light;
    light.image = textures.image_of(element);
    light.mapping =
        read_word_attribute(document, element, "type", light.mapping,
                            {{"latlong", EnvironmentMapping::latlong}, {"probe", EnvironmentMapping::probe}});
    light.sampling =
        read_word_child(document, element, "Sampler", light.sampling,
                        {{"cosine", EnvironmentSampling::cosine}, {"uniform", EnvironmentSampling::uniform}});
    return light;
}

/// Returns the product of the transformations of a light. Throws SceneError if it has no inverse.
glm::dmat4 matrix_of(XmlDocument& document, pugi::xml_node element, const XmlTransforms& transforms) {
    const glm::dmat4 matrix = transforms.of(element);
    if (glm::determinant(matrix) == 0.0)
        document.fail(element.child("Transformations"),
                      fmt::format("the transformations of <{}> have no inverse", element.name()));
    return matrix;
}

/// Reads a light. Returns false if the element is none.
bool read_light(XmlDocument& document, pugi::xml_node element, const XmlTransforms& transforms, XmlTextures& textures,
                Light& light) {
    const std::string_view name = element.name();
    light.line = document.line(element);
    if (name == "SphericalDirectionalLight") {
        light.kind = Light::Kind::environment;
        light.environment = read_environment_light(document, element, textures);
        return true;
    }
    const glm::dmat4 matrix = matrix_of(document, element, transforms);
    if (name == "PointLight") {
        light.kind = Light::Kind::point;
        light.point = read_point_light(document, element, matrix);
    } else if (name == "DirectionalLight") {
        light.kind = Light::Kind::directional;
        light.directional = read_directional_light(document, element, matrix);
    } else if (name == "SpotLight") {
        light.kind = Light::Kind::spot;
        light.spot = read_spot_light(document, element, matrix);
    } else if (name == "AreaLight") {
        light.kind = Light::Kind::area;
        light.area = read_area_light(document, element, matrix);
    } else {
        return false;
    }
    document.expect_attributes(element);
    return true;
}

}  // namespace

std::vector<std::string> names_of_light(pugi::xml_node element) {
    const pugi::xml_attribute id = element.attribute("id");
    if (!id) return {};
    return {fmt::format("{}-{}", element.name(), id.value())};
}

void read_lights(XmlDocument& document, const XmlTransforms& transforms, XmlTextures& textures, Scene& scene) {
    for (const pugi::xml_node container : document.root().children("Lights")) {
        document.expect_attributes(container);
        document.expect_children(
            container, {"AmbientLight"},
            {"PointLight", "DirectionalLight", "SpotLight", "AreaLight", "SphericalDirectionalLight"});
        scene.ambient_light = read_vec3(document, container, "AmbientLight", scene.ambient_light);
        for (const pugi::xml_node element : container.children()) {
            Light light;
            if (!read_light(document, element, transforms, textures, light)) continue;
            light.names = names_of_light(element);
            scene.lights.push_back(std::move(light));
        }
    }
}

}  // namespace castor
