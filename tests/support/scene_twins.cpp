#include "support/scene_twins.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <pugixml.hpp>

namespace castor::test {

namespace {

using Json = nlohmann::ordered_json;

std::string text(const glm::vec2& v) {
    return fmt::format("({} {})", v.x, v.y);
}
std::string text(const glm::vec3& v) {
    return fmt::format("({} {} {})", v.x, v.y, v.z);
}
std::string text(const glm::uvec3& v) {
    return fmt::format("({} {} {})", v.x, v.y, v.z);
}
std::string text(const Transform& m) {
    return text(m[0]) + text(m[1]) + text(m[2]) + text(m[3]);
}
template <class T>
std::string text(const std::vector<T>& values) {
    std::string result;
    for (const T& value : values) result += text(value) + ' ';
    return result;
}

std::string describe(const Image& image) {
    return fmt::format("image {} {}x{} {} {}\n", image.file, image.width, image.height, fmt::join(image.bytes, " "),
                       fmt::join(image.floats, " "));
}

std::string describe(const Texture& t) {
    return fmt::format("texture {} {} image {} {} {} normalizer {} bump {} noise {} {} {} checker {} {} {} {}\n",
                       int(t.kind), int(t.target), t.image, int(t.filter), int(t.wrap), t.normalizer, t.bump_factor,
                       t.noise_scale, t.noise_octaves, int(t.noise_conversion), text(t.black), text(t.white),
                       t.checker_scale, t.checker_offset);
}

std::string describe(const Material& m) {
    return fmt::format(
        "material {} {} {} {} {} phong {} index {} {} absorption {} rough {} emission {} brdf {} {} {} [{}]\n",
        int(m.kind), text(m.ambient), text(m.diffuse), text(m.specular), text(m.mirror), m.phong_exponent,
        m.refraction_index, m.absorption_index, text(m.absorption), m.roughness, text(m.emission), int(m.brdf),
        m.brdf_normalized, m.diffuse_fresnel, fmt::join(m.textures, " "));
}

std::string describe(const Mesh& m) {
    return fmt::format("mesh {} / {} / {} / {} material {} transform {} motion {}\n", text(m.positions),
                       text(m.normals), text(m.texture_coordinates), text(m.triangles), m.material, text(m.transform),
                       text(m.motion));
}

std::string describe(const MeshInstance& i) {
    return fmt::format("instance of {} material {} transform {} motion {}\n", i.mesh, i.material, text(i.transform),
                       text(i.motion));
}

std::string describe(const Sphere& s) {
    return fmt::format("sphere {} {} material {} transform {} motion {}\n", text(s.center), s.radius, s.material,
                       text(s.transform), text(s.motion));
}

std::string describe(const Plane& p) {
    return fmt::format("plane {} {} material {}\n", text(p.point), text(p.normal), p.material);
}

std::string describe(const Light& l) {
    return fmt::format(
        "light {} point {} {} directional {} {} spot {} {} {} {} {} {} area {} {} {} {} object {} environment {} {} "
        "{} names {}\n",
        int(l.kind), text(l.point.position), text(l.point.intensity), text(l.directional.direction),
        text(l.directional.radiance), text(l.spot.position), text(l.spot.direction), text(l.spot.intensity),
        l.spot.coverage_radians, l.spot.falloff_radians, int(l.spot.falloff), text(l.area.position),
        text(l.area.normal), l.area.size, text(l.area.radiance), l.object.object, l.environment.image,
        int(l.environment.mapping), int(l.environment.sampling), fmt::join(l.names, ", "));
}

std::string describe(const ToneMap& t) {
    return fmt::format("tone map {} {} {} {} {} {} {}; ", int(t.tone_operator), t.key, t.burn_percent, t.saturation,
                       t.is_srgb, t.gamma, t.extension);
}

std::string describe(const Camera& c) {
    std::string result = fmt::format(
        "camera {} {} {} {} window {} {} {} {} {} range {} {} {}x{} {} left-handed {} lens {} {} ", c.image_name,
        text(c.position), text(c.gaze), text(c.up), c.left, c.right, c.bottom, c.top, c.distance, c.t_min, c.t_max,
        c.width, c.height, c.samples_per_pixel, c.left_handed, c.aperture_size, c.focus_distance);
    for (const ToneMap& tone_map : c.tone_maps) result += describe(tone_map);
    if (const auto& p = c.path_tracing)
        result += fmt::format("path tracing {} {} {} {} {} {} {}", p->samples_brdf, p->samples_lights, p->weighs,
                              p->roulette_from.value_or(1u << 30), p->bounces.value_or(1u << 30), p->largest_sample,
                              static_cast<int>(p->light_choice));
    return result + '\n';
}

template <class T>
std::string describe(const std::vector<T>& things) {
    std::string result;
    for (const T& thing : things) result += describe(thing);
    return result;
}

std::string trimmed(const std::string& text) {
    constexpr const char* kSpaces = " \t\r\n";
    const std::size_t begin = text.find_first_not_of(kSpaces);
    return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(kSpaces) + 1 - begin);
}

Json to_json(pugi::xml_node element) {
    Json object = Json::object();
    std::string text;
    bool has_children = false;
    for (const pugi::xml_node child : element.children()) {
        if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) text += child.value();
        if (child.type() != pugi::node_element) continue;
        has_children = true;
        if (!object.contains(child.name())) {
            object[child.name()] = to_json(child);
        } else {
            Json& present = object[child.name()];
            if (!present.is_array()) present = Json::array({present});
            present.push_back(to_json(child));
        }
    }
    text = trimmed(text);
    if (!has_children && !element.first_attribute()) return text;
    // After the children, to show that the order of keys is free.
    for (const pugi::xml_attribute attribute : element.attributes())
        object[std::string("_") + attribute.name()] = attribute.value();
    if (!text.empty()) object["_data"] = text;
    return object;
}

}  // namespace

std::string describe(const Scene& scene) {
    return fmt::format("background {} ambient {} epsilon {} depth {} background texture {}\n", text(scene.background),
                       text(scene.ambient_light), scene.shadow_ray_epsilon, scene.max_recursion_depth,
                       scene.background_texture ? std::to_string(*scene.background_texture) : "none") +
           describe(scene.cameras) + describe(scene.lights) + describe(scene.images) + describe(scene.textures) +
           describe(scene.materials) + describe(scene.meshes) + describe(scene.instances) + describe(scene.spheres) +
           describe(scene.planes);
}

std::string to_json(const std::string& xml) {
    pugi::xml_document document;
    document.load_buffer(xml.data(), xml.size());
    return Json{{"Scene", to_json(document.document_element())}}.dump(2);
}

}  // namespace castor::test
