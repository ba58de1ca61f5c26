#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "base/progress.h"
#include "base/section_file.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "scene/environment.h"
#include "scene/gltf_reader.h"
#include "scene/obj_reader.h"
#include "scene/ply_reader.h"
#include "scene/principled.h"
#include "scene/stl_reader.h"
#include "scene/xml_reader.h"

namespace castor {

namespace {

// The shares of the time after which the file is read, and after which normals are computed. The rest is for the view.
constexpr double kReading = 0.7;
constexpr double kNormals = 0.85;

// glTF says nothing of samples; light from all sides needs some.
constexpr std::uint32_t kSamplesOfGltf = 16;

enum class SceneFormat { xml, ply, obj, gltf, stl };

std::string lower_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char character) { return static_cast<char>(std::tolower(character)); });
    return text;
}

std::optional<SceneFormat> format_by_extension(const std::filesystem::path& file) {
    const std::string extension = lower_case(file.extension().string());
    if (extension == ".xml" || extension == ".json") return SceneFormat::xml;
    if (extension == ".ply") return SceneFormat::ply;
    if (extension == ".obj") return SceneFormat::obj;
    if (extension == ".gltf" || extension == ".glb") return SceneFormat::gltf;
    if (extension == ".stl") return SceneFormat::stl;
    return std::nullopt;
}

/// Returns the format that the first bytes show: XML, its twin in JSON, PLY, glTF or STL; OBJ files have no signature.
std::optional<SceneFormat> format_by_content(const std::filesystem::path& file) {
    char bytes[128] = {};
    std::ifstream(file, std::ios::binary).read(bytes, sizeof(bytes) - 1);
    std::string_view begin(bytes);
    if (begin.starts_with("ply\n") || begin.starts_with("ply\r")) return SceneFormat::ply;
    if (begin.starts_with("glTF")) return SceneFormat::gltf;
    std::error_code error;
    if (is_binary_stl({bytes, sizeof(bytes)}, std::filesystem::file_size(file, error)) && !error)
        return SceneFormat::stl;
    if (begin.starts_with("solid ") || begin.starts_with("solid\n")) return SceneFormat::stl;
    if (begin.starts_with("\xef\xbb\xbf")) begin.remove_prefix(3);
    const std::size_t first = begin.find_first_not_of(" \t\r\n");
    if (first == begin.npos) return std::nullopt;
    // Other files are JSON too.
    if (begin[first] == '<' || (begin[first] == '{' && begin.find("\"Scene\"") != begin.npos)) return SceneFormat::xml;
    return std::nullopt;
}

SceneFormat find_format(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (file.empty()) throw SceneError("", 0, "the name of the scene file is empty");
    if (status.type() == std::filesystem::file_type::not_found) throw SceneError(file.string(), 0, "does not exist");
    if (error) throw SceneError(file.string(), 0, fmt::format("cannot be opened: {}", error.message()));
    if (std::filesystem::is_directory(status)) throw SceneError(file.string(), 0, "is a directory, not a scene file");
    if (const auto format = format_by_extension(file)) return *format;
    // The first bytes of a pipe could not be read again.
    if (std::filesystem::is_regular_file(status))
        if (const auto format = format_by_content(file)) return *format;
    if (is_section_file_of_another_kind(file, kBuiltSceneFile))
        throw SceneError(file.string(), 0, "is a checkpoint; a scene was expected");
    if (is_section_file(file))
        throw SceneError(file.string(), 0, "is a built scene; one that is not built was expected");
    const std::string extension = file.extension().string();
    throw SceneError(
        file.string(), 0,
        fmt::format(
            "has {} and does not begin as XML, JSON, PLY, glTF or STL: .xml, .json, .gltf, .glb, .ply, .obj or .stl "
            "was expected",
            extension.empty() ? "no extension" : fmt::format("the unknown extension '{}'", extension)));
}

void add_environment_of(Scene& scene, const LoadOptions& options) {
    if (!options.environment.empty()) add_environment(scene, options.environment);
}

Scene read_ply_scene(const std::filesystem::path& file, const LoadOptions& options, const Progress& progress) {
    Scene scene;
    scene.file = file.string();
    scene.meshes.push_back(read_ply(file, progress.part(0.0, kReading)));
    progress.reach(kReading);
    Mesh& mesh = scene.meshes.front();
    if (mesh.normals.empty()) compute_smooth_normals(mesh);
    progress.reach(kNormals);
    add_environment_of(scene, options);
    add_default_view(scene);
    return scene;
}

Scene read_stl_scene(const std::filesystem::path& file, const LoadOptions& options, const Progress& progress) {
    Scene scene;
    scene.file = file.string();
    scene.meshes.push_back(read_stl(file, progress.part(0.0, kReading)));
    scene.shades_both_sides = true;  // which side is outside is often wrong in such files
    progress.reach(kReading);
    add_environment_of(scene, options);
    add_default_view(scene);
    return scene;
}

/// Returns whether a material's emission is there to light a scene. Unlit surfaces show their colour, and pictures of
/// emissions of at most 1 are of lamps and screens on a model.
bool is_lamp(const Material& material) {
    const glm::vec3 emission = emission_of(material);
    if (emission == glm::vec3(0.0f)) return false;
    if (!material.principled) return true;
    const PrincipledMaterial& m = *material.principled;
    return !m.is_unlit && (!m.emissive_texture || std::max({emission.x, emission.y, emission.z}) > kWhite);
}

/// Returns whether the scene has light of its own.
bool has_light(const Scene& scene) {
    return !scene.lights.empty() || std::any_of(scene.materials.begin(), scene.materials.end(), is_lamp);
}

/// Reads a glTF scene, in which radiance 1 is white: its pictures are encoded by sRGB's curve, and not changed
/// otherwise. It gets a camera that sees all of it, and the light of a studio, where it has none.
Scene read_gltf_scene(const std::filesystem::path& file, const LoadOptions& options, const Progress& progress) {
    Scene scene = read_gltf(file, progress.part(0.0, kReading), options);
    progress.reach(kReading);
    const bool is_lit = has_light(scene) || !options.environment.empty();
    add_mesh_lights(scene);
    add_environment_of(scene, options);
    if (!is_lit) add_studio(scene);
    Scene viewed;  // its geometry alone, for a camera and what belongs to it
    std::swap(viewed.meshes, scene.meshes);
    std::swap(viewed.instances, scene.instances);
    add_default_view(viewed);
    std::swap(viewed.meshes, scene.meshes);
    std::swap(viewed.instances, scene.instances);
    scene.shadow_ray_epsilon = viewed.shadow_ray_epsilon;
    if (scene.cameras.empty()) scene.cameras = viewed.cameras;
    for (Camera& camera : scene.cameras) {
        camera.samples_per_pixel = kSamplesOfGltf;
        ToneMap map;
        map.tone_operator = ToneOperator::linear;
        map.key = 1.0f;
        map.is_srgb = true;
        camera.tone_maps = {map};
        camera.path_tracing.emplace();
    }
    return scene;
}

Scene read_obj_scene(const std::filesystem::path& file, const LoadOptions& options, const Progress& progress) {
    Scene scene = read_obj(file, progress.part(0.0, kReading));
    progress.reach(kReading);
    scene.file = file.string();
    add_environment_of(scene, options);
    add_default_view(scene);
    return scene;
}

/// Reads an XML scene. If it has no camera, it gets the one that a mesh alone would get, and keeps its own lights if it
/// has any.
Scene read_xml_scene_with_view(const std::filesystem::path& file, const LoadOptions& options,
                               const Progress& progress) {
    Scene scene = read_xml_scene(file, progress.part(0.0, kReading));
    for (const Light& light : scene.lights)
        if (light.kind == Light::Kind::environment)
            clamp_radiances(scene.images[light.environment.image], scene.warnings);
    add_environment_of(scene, options);
    progress.reach(kReading);
    if (!scene.cameras.empty()) return scene;
    if (scene.meshes.empty() && scene.spheres.empty() && scene.planes.empty())
        throw SceneError(scene.file, 0, "the scene has no <Camera> and no object");
    const std::vector<Light> lights = scene.lights;
    const glm::vec3 ambient_light = scene.ambient_light, background = scene.background;
    add_default_view(scene);
    scene.background = background;
    if (!lights.empty() || ambient_light != glm::vec3(0.0f)) {
        scene.lights = lights;
        scene.ambient_light = ambient_light;
    }
    scene.warnings.push_back({scene.file, 0, "the scene has no <Camera>: one that sees all of it was chosen"});
    return scene;
}

/// Sets the angle of all directional lights.
void set_sun_angle(Scene& scene, float radians) {
    if (!(radians >= 0.0f && radians <= std::numbers::pi_v<float>))
        throw UsageError(fmt::format("the sun's angle is {} degrees, expected 0 to 180", glm::degrees(radians)));
    bool has_sun = false;
    for (Light& light : scene.lights) {
        if (light.kind != Light::Kind::directional) continue;
        light.directional.angle_radians = radians;
        has_sun = true;
    }
    if (!has_sun) throw UsageError(fmt::format("{}: the scene has no directional light", scene.file));
}

Scene read_file(const std::filesystem::path& file, const LoadOptions& options, const Progress& progress) {
    const SceneFormat format = find_format(file);
    if (options.time_seconds && format != SceneFormat::gltf)
        throw UsageError(fmt::format("{}: only a glTF file has a time to be shown at", file.string()));
    if (options.time_seconds && !std::isfinite(*options.time_seconds))
        throw UsageError(fmt::format("the time is {}, expected a finite number of seconds", *options.time_seconds));
    if (options.animation && !options.time_seconds)
        throw UsageError(
            fmt::format("{}: the animation \"{}\" needs a time to be shown at", file.string(), *options.animation));
    if (options.material_variant && format != SceneFormat::gltf)
        throw UsageError(fmt::format("{}: only a glTF file has material variants", file.string()));
    switch (format) {
        case SceneFormat::ply:
            return read_ply_scene(file, options, progress);
        case SceneFormat::obj:
            return read_obj_scene(file, options, progress);
        case SceneFormat::gltf:
            return read_gltf_scene(file, options, progress);
        case SceneFormat::stl:
            return read_stl_scene(file, options, progress);
        case SceneFormat::xml:
            break;
    }
    return read_xml_scene_with_view(file, options, progress);
}

Scene read_scene(const std::filesystem::path& file, const LoadOptions& options, const Progress& progress) {
    Scene scene = read_file(file, options, progress);
    if (options.sun_angle_radians) set_sun_angle(scene, *options.sun_angle_radians);
    return scene;
}

}  // namespace

Scene load_scene(const std::filesystem::path& file, const ProgressHook& hook) {
    return load_scene(file, LoadOptions(), hook);
}

Scene load_scene(const std::filesystem::path& file, const LoadOptions& options, const ProgressHook& hook) {
    const Progress progress(hook);
    Scene scene = read_scene(file, options, progress);
    progress.reach(1.0);
    return scene;
}

}  // namespace castor
