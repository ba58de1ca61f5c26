#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "base/progress.h"
#include "base/section_file.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "scene/obj_reader.h"
#include "scene/ply_reader.h"
#include "scene/xml_reader.h"

namespace castor {

namespace {

// The shares of the time after which the file is read, and after which normals are computed. The rest is for the view.
constexpr double kReading = 0.7;
constexpr double kNormals = 0.85;

enum class SceneFormat { xml, ply, obj };

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
    return std::nullopt;
}

/// Returns the format that the first bytes show: XML, its twin in JSON, or PLY; OBJ files have no signature.
std::optional<SceneFormat> format_by_content(const std::filesystem::path& file) {
    char bytes[64] = {};
    std::ifstream(file, std::ios::binary).read(bytes, sizeof(bytes) - 1);
    std::string_view begin(bytes);
    if (begin.starts_with("ply\n") || begin.starts_with("ply\r")) return SceneFormat::ply;
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
        fmt::format("has {} and does not begin as XML, JSON or PLY: .xml, .json, .ply or .obj was expected",
                    extension.empty() ? "no extension" : fmt::format("the unknown extension '{}'", extension)));
}

Scene read_ply_scene(const std::filesystem::path& file, const Progress& progress) {
    Scene scene;
    scene.file = file.string();
    scene.meshes.push_back(read_ply(file, progress.part(0.0, kReading)));
    progress.reach(kReading);
    Mesh& mesh = scene.meshes.front();
    if (mesh.normals.empty()) compute_smooth_normals(mesh);
    progress.reach(kNormals);
    add_default_view(scene);
    return scene;
}

Scene read_obj_scene(const std::filesystem::path& file, const Progress& progress) {
    Scene scene = read_obj(file, progress.part(0.0, kReading));
    progress.reach(kReading);
    scene.file = file.string();
    add_default_view(scene);
    return scene;
}

/// Reads an XML scene. If it has no camera, it gets the one that a mesh alone would get, and keeps its own lights if it
/// has any.
Scene read_xml_scene_with_view(const std::filesystem::path& file, const Progress& progress) {
    Scene scene = read_xml_scene(file, progress.part(0.0, kReading));
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

Scene read_scene(const std::filesystem::path& file, const Progress& progress) {
    switch (find_format(file)) {
        case SceneFormat::ply:
            return read_ply_scene(file, progress);
        case SceneFormat::obj:
            return read_obj_scene(file, progress);
        case SceneFormat::xml:
            break;
    }
    return read_xml_scene_with_view(file, progress);
}

}  // namespace

Scene load_scene(const std::filesystem::path& file, const ProgressHook& hook) {
    const Progress progress(hook);
    Scene scene = read_scene(file, progress);
    progress.reach(1.0);
    return scene;
}

}  // namespace castor
