// Cameras and lights of glTF files.
#include "scene/gltf_lights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>

#include "scene/scene_limits.h"

namespace castor {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// glTF gives a shape, but no size in pixels.
constexpr double kHeight = 720.0;
constexpr float kUsualAspect = 16.0f / 9.0f;

std::uint32_t pixels(double count) {
    return static_cast<std::uint32_t>(std::clamp(std::round(count), 1.0, static_cast<double>(kMaxImageResolution)));
}

void set_window(Camera& camera, double half_width, double half_height) {
    camera.right = static_cast<float>(half_width);
    camera.top = static_cast<float>(half_height);
    camera.left = -camera.right;
    camera.bottom = -camera.top;
    camera.height = pixels(half_width > half_height ? kHeight : kHeight * half_height / half_width);
    camera.width = pixels(camera.height * half_width / half_height);
}

/// A direction of a node's own space in the world, of length one; the same direction where it has none.
glm::vec3 world_direction(const glm::dmat4& world, const glm::dvec3& own) {
    const glm::dvec3 direction(world * glm::dvec4(own, 0.0));
    const double length = glm::length(direction);
    return glm::vec3(length > 0.0 ? direction / length : own);
}

/// glTF 2.0, section 3.10.2: scale has no effect on where a camera looks, only on where it stands.
Camera read_camera(GltfDocument& document, GltfValue value, const glm::dmat4& world, const glm::dmat4& rotation) {
    value.remember_what_is_read();
    Camera camera;
    const std::string type = value.require("type").text();
    const float smallest = std::numeric_limits<float>::min();
    if (type == "perspective") {
        GltfValue lens = value.require("perspective");
        lens.remember_what_is_read();
        const GltfValue angle = lens.require("yfov");
        const double half = 0.5 * double{angle.number()};
        if (!(half > 0.0 && half < 0.5 * std::numbers::pi)) angle.reject("expected an angle between 0 and pi");
        const double aspect = double{lens.number("aspectRatio", kUsualAspect, 1e-3f, 1e3f)};
        set_window(camera, std::tan(half) * aspect, std::tan(half));
        document.warn_of_unread_members(lens);
    } else if (type == "orthographic") {
        GltfValue lens = value.require("orthographic");
        lens.remember_what_is_read();
        const double x = std::abs(double{lens.require("xmag").number()}),
                     y = std::abs(double{lens.require("ymag").number()});
        if (!(x >= smallest && y >= smallest && x / y <= 1e3 && y / x <= 1e3))
            lens.reject(fmt::format("xmag {} and ymag {} are no window", x, y));
        set_window(camera, x, y);
        camera.is_orthographic = true;
        document.warn_of_unread_members(lens);
    } else {
        value.require("type").reject(fmt::format("\"{}\" is none of perspective and orthographic", type.substr(0, 40)));
    }
    camera.position = glm::vec3(world[3]);
    camera.gaze = world_direction(rotation, {0, 0, -1});
    camera.up = world_direction(rotation, {0, 1, 0});
    document.warn_of_unread_members(value);
    return camera;
}

Light read_light(GltfDocument& document, GltfValue value, const glm::dmat4& world) {
    value.remember_what_is_read();
    const auto rgb = value.numbers<3>("color", {1, 1, 1}, 0.0f);
    const float intensity = kGltfWhite * value.number("intensity", 1.0f, 0.0f, kInfinity);
    glm::vec3 color;
    for (int i = 0; i < 3; ++i) {
        color[i] = intensity * rgb[static_cast<std::size_t>(i)];
        if (!std::isfinite(color[i])) value.reject("its colour or intensity is out of range");
    }
    Light light;
    const glm::vec3 position(world[3]), direction = world_direction(world, {0, 0, -1});
    const std::string type = value.require("type").text();
    const float range = value.number("range", kInfinity, 0.0f, kInfinity);
    if (!(range > 0.0f)) value.require("range").reject("is 0, expected a number above 0");
    if (type == "point") {
        light.kind = Light::Kind::point;
        light.point = {position, color, range};
    } else if (type == "directional") {
        light.kind = Light::Kind::directional;
        light.directional = {direction, color};
    } else if (type == "spot") {
        constexpr float kQuarter = 1.57079632679489661923f;
        auto spot = value.find("spot");
        if (spot) spot->remember_what_is_read();
        const float outer = spot ? spot->number("outerConeAngle", 0.5f * kQuarter, 0.0f, kQuarter) : 0.5f * kQuarter;
        const float inner = spot ? spot->number("innerConeAngle", 0.0f, 0.0f, kQuarter) : 0.0f;
        if (!(outer > 0.0f)) value.reject("outerConeAngle is 0, expected an angle above 0");
        // Exporters write equal angles, which glTF does not allow, for spots with a hard edge.
        if (!(inner <= outer)) value.reject(fmt::format("innerConeAngle {} is above outerConeAngle {}", inner, outer));
        light.kind = Light::Kind::spot;
        light.spot = {position, direction, color, 2.0f * outer, 2.0f * inner, SpotFalloff::square, range};
        if (spot) document.warn_of_unread_members(*spot);
    } else {
        value.require("type").reject(fmt::format("\"{}\" is none of point, spot and directional", type.substr(0, 40)));
    }
    document.warn_of_unread_members(value);
    return light;
}

}  // namespace

void read_gltf_cameras(GltfDocument& document, const GltfNodes& nodes, Scene& scene) {
    for (const std::size_t node : nodes.shown)
        if (const auto index = document.element("nodes", node).find("camera"))
            scene.cameras.push_back(read_camera(document, document.element("cameras", index->index_of("cameras")),
                                                nodes.world[node], nodes.rotation[node]));
}

void read_gltf_lights(GltfDocument& document, const GltfNodes& nodes, Scene& scene) {
    const auto extension = document.root().find_extension("KHR_lights_punctual");
    const auto lights = extension ? extension->find("lights") : std::nullopt;
    for (const std::size_t node : nodes.shown) {
        const auto reference = document.element("nodes", node).find_extension("KHR_lights_punctual");
        if (!reference) continue;
        const GltfValue index = reference->require("light");
        const std::size_t count = lights ? lights->size() : 0;
        if (index.whole() >= count)
            index.reject(fmt::format("{} is no index of lights, of which there are {}", index.whole(), count));
        const GltfValue light = lights->at(index.whole());
        document.warn_above_one(light, "color");
        Light& added = scene.lights.emplace_back(read_light(document, light, nodes.world[node]));
        for (const std::string& name : {document.element("nodes", node).name(), light.name()})
            if (!name.empty() && (added.names.empty() || added.names[0] != name)) added.names.push_back(name);
    }
}

}  // namespace castor
