// castor info: says what a scene or a checkpoint holds, without any device.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>

#include "base/name_list.h"
#include "base/section_file.h"
#include "base/stopwatch.h"
#include "castor/merge.h"
#include "castor/scene.h"
#include "castor/tone_map.h"
#include "commands.h"
#include "interrupt.h"
#include "memory_options.h"
#include "render/checkpoint.h"
#include "render/light_planes.h"
#include "report.h"
#include "scene_input.h"
#include "trace/scene_contents.h"

namespace castor::cli {

namespace {

using cli::json_of;  // beside the overloads below

constexpr const char* kInfoFooter =
    R"(Needs no OpenCL device unless --device names some. "memory" is the size of the scene's columns and of each kind
of tree. "to render" is what a render needs on the host and on each device of --device; with --device, only the
trees that these devices traverse are planned. For checkpoints of castor render, info says to which picture
they belong, and how much of it is done by each and by all together.

Examples:
  castor info scene.xml
  castor info bunny.ply --json
  castor info picture.checkpoint
  castor info part1 part2 part3)";

struct InfoOptions {
    std::vector<std::string> files;  // a scene, or checkpoints
    std::string quality = "medium";
    std::string device;
    std::optional<std::uint64_t> memory_limit;
    DeviceLimits device_limits;
    bool strict = false;
    LoadOptions load;
    ReportOptions report;
};

template <class T>
std::uint64_t bytes_of(const Column<T>& column) {
    return column.size() * sizeof(T);
}

/// The memory of all chunks of a scene.
struct SceneBytes {
    std::uint64_t arrays = 0, compressed_tree = 0, wide_tree = 0;
    std::uint32_t levels = 0;  // levels of the highest compressed tree

    explicit SceneBytes(const SceneContents& contents) {
        for (const Chunk& chunk : contents.chunks) {
            const std::uint64_t compressed = bytes_of(chunk.compressed_nodes) + bytes_of(chunk.compressed_primitives);
            const std::uint64_t wide =
                bytes_of(chunk.wide_nodes) + bytes_of(chunk.triangle_blocks) + bytes_of(chunk.sphere_blocks);
            const std::uint64_t others = bytes_of(chunk.instance_nodes) + bytes_of(chunk.wide_instance_nodes) +
                                         bytes_of(chunk.compressed_roots) + bytes_of(chunk.wide_roots);
            for_each_column(chunk, [&](const char*, const auto& column) { arrays += bytes_of(column); });
            arrays -= compressed + wide + others;
            compressed_tree += compressed;
            wide_tree += wide;
            levels = std::max(levels, chunk.compressed_levels);
        }
    }
};

/// Returns the number of instances without number 0, which is everything that is placed once.
std::size_t instance_count(const SceneArrays& arrays) {
    return arrays.instances.empty() ? 0 : arrays.instances.size() - 1;
}

Json bounds_json(const Box& box) {
    if (box.is_empty()) return nullptr;
    return {{"lower", {box.lower[0], box.lower[1], box.lower[2]}},
            {"upper", {box.upper[0], box.upper[1], box.upper[2]}}};
}

Json json_of(const ToneMap& tone_map) {
    return {{"operator", std::string(to_string(tone_map.tone_operator))},
            {"key", tone_map.key},
            {"burn_percent", tone_map.burn_percent},
            {"saturation", tone_map.saturation},
            {"gamma", tone_map.is_srgb ? Json("sRGB") : Json(tone_map.gamma)},
            {"extension", tone_map.extension}};
}

Json json_of(const Camera& camera) {
    Json tone_maps = Json::array();
    for (const ToneMap& tone_map : camera.tone_maps) tone_maps.push_back(json_of(tone_map));
    return {{"image_name", camera.image_name},
            {"width", camera.width},
            {"height", camera.height},
            {"samples_per_pixel", camera.samples_per_pixel},
            {"position", json_of(camera.position)},
            {"gaze", json_of(camera.gaze)},
            {"up", json_of(camera.up)},
            {"window", {camera.left, camera.right, camera.bottom, camera.top}},
            {"distance", camera.distance},
            {"aperture_size", camera.aperture_size},
            {"focus_distance", camera.focus_distance},
            {"tone_maps", tone_maps},
            {"line", camera.line}};
}

/// JSON has no infinity: null.
Json range_of(float range) {
    return std::isfinite(range) ? Json(range) : Json();
}

Json parts_of(const Light& light) {
    switch (light.kind) {
        case Light::Kind::point:
            return {{"kind", "point"},
                    {"position", json_of(light.point.position)},
                    {"intensity", json_of(light.point.intensity)},
                    {"range", range_of(light.point.range)}};
        case Light::Kind::directional:
            return {{"kind", "directional"},
                    {"direction", json_of(light.directional.direction)},
                    {"radiance", json_of(light.directional.radiance)},
                    {"angle_radians", light.directional.angle_radians}};
        case Light::Kind::area:
            return {{"kind", "area"},
                    {"position", json_of(light.area.position)},
                    {"normal", json_of(light.area.normal)},
                    {"size", light.area.size},
                    {"radiance", json_of(light.area.radiance)}};
        case Light::Kind::mesh:
            return {{"kind", "mesh"}, {"mesh", light.object.object}};
        case Light::Kind::sphere:
            return {{"kind", "sphere"}, {"sphere", light.object.object}};
        case Light::Kind::instance:
            return {{"kind", "instance"}, {"instance", light.object.object}};
        case Light::Kind::environment:
            return {{"kind", "environment"}, {"image", light.environment.image}};
        case Light::Kind::spot:
            break;
    }
    return {{"kind", "spot"},
            {"position", json_of(light.spot.position)},
            {"direction", json_of(light.spot.direction)},
            {"intensity", json_of(light.spot.intensity)},
            {"falloff", light.spot.falloff == SpotFalloff::square ? "square" : "fourth_power"},
            {"range", range_of(light.spot.range)}};
}

Json json_of(const Light& light) {
    Json result = parts_of(light);
    result["names"] = names_of(light);
    return result;
}

std::string_view to_string(MaterialKind kind) {
    switch (kind) {
        case MaterialKind::plain:
            return "plain";
        case MaterialKind::mirror:
            return "mirror";
        case MaterialKind::conductor:
            return "conductor";
        case MaterialKind::dielectric:
            break;
    }
    return "dielectric";
}

std::string_view to_string(AlphaMode mode) {
    switch (mode) {
        case AlphaMode::mask:
            return "mask";
        case AlphaMode::blend:
            return "blend";
        case AlphaMode::opaque:
            break;
    }
    return "opaque";
}

/// Returns all that is not as it is where nothing is said.
Json json_of(const PrincipledMaterial& m) {
    const PrincipledMaterial usual;
    Json json = {{"base_color", json_of(m.base_color)}, {"metallic", m.metallic}, {"roughness", m.roughness}};
    const auto add = [&](const char* name, float value, float otherwise) {
        if (value != otherwise) json[name] = value;
    };
    const auto add_color = [&](const char* name, const glm::vec3& value, const glm::vec3& otherwise) {
        if (value != otherwise) json[name] = json_of(value);
    };
    const auto add_texture = [&](const char* name, const PrincipledMaterial::TextureIndex& texture) {
        if (texture) json["textures"][name] = *texture;
    };
    if (m.alpha_mode != AlphaMode::opaque) json["alpha_mode"] = std::string(to_string(m.alpha_mode));
    if (m.alpha_mode == AlphaMode::mask) json["alpha_cutoff"] = m.alpha_cutoff;
    if (m.is_unlit) json["unlit"] = true;
    if (m.is_double_sided) json["double_sided"] = true;
    add("alpha", m.alpha, usual.alpha);
    add_color("emissive", m.emissive, usual.emissive);
    add("emissive_strength", m.emissive_strength, usual.emissive_strength);
    add("ior", m.ior, usual.ior);
    add("specular", m.specular, usual.specular);
    add_color("specular_color", m.specular_color, usual.specular_color);
    add("transmission", m.transmission, usual.transmission);
    add("thickness", m.thickness, usual.thickness);
    add("attenuation_distance", m.attenuation_distance, usual.attenuation_distance);
    add_color("attenuation_color", m.attenuation_color, usual.attenuation_color);
    add_color("multiscatter_color", m.multiscatter_color, usual.multiscatter_color);
    add("scattering_anisotropy", m.scattering_anisotropy, usual.scattering_anisotropy);
    add("dispersion", m.dispersion, usual.dispersion);
    add("diffuse_transmission", m.diffuse_transmission, usual.diffuse_transmission);
    add_color("diffuse_transmission_color", m.diffuse_transmission_color, usual.diffuse_transmission_color);
    add("diffuse_roughness", m.diffuse_roughness, usual.diffuse_roughness);
    add("clearcoat", m.clearcoat, usual.clearcoat);
    add("clearcoat_roughness", m.clearcoat_roughness, usual.clearcoat_roughness);
    add_color("sheen_color", m.sheen_color, usual.sheen_color);
    add("sheen_roughness", m.sheen_roughness, usual.sheen_roughness);
    add("anisotropy", m.anisotropy, usual.anisotropy);
    add("anisotropy_rotation_radians", m.anisotropy_rotation_radians, usual.anisotropy_rotation_radians);
    add("clearcoat_normal_scale", m.clearcoat_normal_scale, usual.clearcoat_normal_scale);
    add("iridescence", m.iridescence, usual.iridescence);
    add("iridescence_ior", m.iridescence_ior, usual.iridescence_ior);
    add("iridescence_thickness_minimum", m.iridescence_thickness_minimum, usual.iridescence_thickness_minimum);
    add("iridescence_thickness_maximum", m.iridescence_thickness_maximum, usual.iridescence_thickness_maximum);
    add_texture("base_color", m.base_color_texture);
    add_texture("metallic_roughness", m.metallic_roughness_texture);
    add_texture("normal", m.normal_texture);
    add_texture("emissive", m.emissive_texture);
    add_texture("specular", m.specular_texture);
    add_texture("specular_color", m.specular_color_texture);
    add_texture("transmission", m.transmission_texture);
    add_texture("thickness", m.thickness_texture);
    add_texture("diffuse_transmission", m.diffuse_transmission_texture);
    add_texture("diffuse_transmission_color", m.diffuse_transmission_color_texture);
    add_texture("diffuse_roughness", m.diffuse_roughness_texture);
    add_texture("clearcoat", m.clearcoat_texture);
    add_texture("clearcoat_roughness", m.clearcoat_roughness_texture);
    add_texture("clearcoat_normal", m.clearcoat_normal_texture);
    add_texture("sheen_color", m.sheen_color_texture);
    add_texture("sheen_roughness", m.sheen_roughness_texture);
    add_texture("anisotropy", m.anisotropy_texture);
    add_texture("iridescence", m.iridescence_texture);
    add_texture("iridescence_thickness", m.iridescence_thickness_texture);
    return json;
}

Json json_of(const Material& material) {
    if (material.principled) return {{"kind", "principled"}, {"principled", json_of(*material.principled)}};
    return {{"kind", std::string(to_string(material.kind))},
            {"ambient", json_of(material.ambient)},
            {"diffuse", json_of(material.diffuse)},
            {"specular", json_of(material.specular)},
            {"phong_exponent", material.phong_exponent},
            {"mirror", json_of(material.mirror)},
            {"roughness", material.roughness},
            {"absorption", json_of(material.absorption)},
            {"emission", json_of(material.emission)},
            {"textures", material.textures}};
}

std::string_view to_string(TextureKind kind) {
    switch (kind) {
        case TextureKind::image:
            return "image";
        case TextureKind::perlin:
            return "perlin";
        case TextureKind::checkerboard:
            break;
    }
    return "checkerboard";
}

/// Returns the name that scene files have for a target.
std::string_view to_string(TextureTarget target) {
    switch (target) {
        case TextureTarget::replace_diffuse:
            return "replace_kd";
        case TextureTarget::blend_diffuse:
            return "blend_kd";
        case TextureTarget::replace_specular:
            return "replace_ks";
        case TextureTarget::replace_all:
            return "replace_all";
        case TextureTarget::background:
            return "replace_background";
        case TextureTarget::normal_map:
            return "replace_normal";
        case TextureTarget::principled:
            return "principled";
        case TextureTarget::bump_map:
            break;
    }
    return "bump_normal";
}

Json json_of(const Texture& texture) {
    Json result = {{"kind", std::string(to_string(texture.kind))},
                   {"target", std::string(to_string(texture.target))},
                   {"line", texture.line}};
    if (texture.kind == TextureKind::image) result["image"] = texture.image;
    return result;
}

/// `texels`: those of the image, which a built scene's description has not.
Json json_of(const Image& image, const shared::TextureImage& texels) {
    return {{"file", image.file},
            {"width", image.width},
            {"height", image.height},
            {"values", texels.format == CASTOR_TEXELS_FLOATS ? "floats" : "bytes"}};
}

template <class T>
Json list(const std::vector<T>& items) {
    Json result = Json::array();
    for (const T& item : items) result.push_back(json_of(item));
    return result;
}

Json document(const Scene& scene, const SceneContents& contents, const MemoryPlan& memory, double load_seconds) {
    const SceneArrays& arrays = contents.arrays();
    const SceneBytes bytes(contents);
    std::vector<Warning> warnings = scene.warnings;
    warnings.insert(warnings.end(), arrays.warnings.begin(), arrays.warnings.end());
    Json images = Json::array();
    for (std::size_t i = 0; i < scene.images.size(); ++i)
        images.push_back(json_of(scene.images[i], arrays.texture_images[i]));
    return {
        {"scene", scene.file},
        {"triangles", contents.counts.triangles},
        {"spheres", contents.counts.spheres},
        {"planes", contents.counts.planes},
        {"meshes", contents.counts.meshes},
        {"instances", instance_count(arrays)},
        {"vertices", contents.counts.vertices},
        {"chunks", contents.chunks.size()},
        {"bounds", bounds_json(contents.bounds())},
        {"cameras", list(scene.cameras)},
        {"lights", list(scene.lights)},
        {"materials", list(scene.materials)},
        {"images", images},
        {"textures", list(scene.textures)},
        {"animations", scene.animations},
        {"material_variants", scene.material_variants},
        {"bytes",
         {{"arrays", bytes.arrays}, {"compressed_tree", bytes.compressed_tree}, {"wide_tree", bytes.wide_tree}}},
        {"memory", json_of(memory)},
        {"tree_levels", bytes.levels},
        {"seconds", {{"load", load_seconds}, {"flatten", contents.flatten_seconds}, {"build", contents.build_seconds}}},
        {"warnings", json_of(warnings)}};
}

std::string bounds_text(const Box& box) {
    if (box.is_empty()) return "nothing bounded";
    return fmt::format("({}, {}, {}) to ({}, {}, {})", box.lower[0], box.lower[1], box.lower[2], box.upper[0],
                       box.upper[1], box.upper[2]);
}

/// Returns a line for each light that has a name, or for the first of them.
std::string named_lights_text(const Scene& scene) {
    constexpr std::size_t kMost = 20;
    std::string result;
    std::size_t count = 0;
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        const std::vector<std::string> names = names_of(scene.lights[i]);
        if (names.empty() || count++ >= kMost) continue;
        result += fmt::format("    light {}  {}\n", i, fmt::join(names, ", "));
    }
    if (count > kMost) result += fmt::format("    and {} more with names: see --json\n", count - kMost);
    return result;
}

/// Returns the lines about images and textures; nothing for a scene without any.
std::string pictures_text(const Scene& scene) {
    if (scene.images.empty() && scene.textures.empty()) return "";
    std::string result = fmt::format("  textures   {}, of {} images\n", scene.textures.size(), scene.images.size());
    for (const Image& image : scene.images)
        result += fmt::format("    image    {}x{}: {}\n", image.width, image.height, image.file);
    return result;
}

/// Returns a line with the numbers and names of what options can choose; nothing where there is none.
std::string choices_text(const char* title, const std::vector<std::string>& names) {
    if (names.empty()) return "";
    std::vector<std::string> choices;
    for (const std::string& name : names)
        choices.push_back(fmt::format("{}{}", choices.size() + 1, name.empty() ? "" : " \"" + name + "\""));
    return fmt::format("  {:<10} {}\n", title, list_some(choices, 20));
}

std::string text(const Scene& scene, const SceneContents& contents, const MemoryPlan& memory) {
    const SceneCounts& counts = contents.counts;
    const SceneBytes bytes(contents);
    std::string result = fmt::format(
        "{}\n"
        "  geometry   {} triangles in {} meshes, {} spheres, {} planes, {} instances\n"
        "  bounds     {}\n"
        "  materials  {}\n"
        "  lights     {}\n"
        "{}{}{}{}"
        "  memory     arrays {}, compressed tree {} ({} levels), wide tree {}{}\n",
        scene.file, counts.triangles, counts.meshes, counts.spheres, counts.planes, instance_count(contents.arrays()),
        bounds_text(contents.bounds()), scene.materials.size(), scene.lights.size(), named_lights_text(scene),
        pictures_text(scene), choices_text("animations", scene.animations),
        choices_text("variants", scene.material_variants), byte_count(bytes.arrays), byte_count(bytes.compressed_tree),
        bytes.levels, byte_count(bytes.wide_tree),
        contents.chunks.size() == 1 ? "" : fmt::format(", in {} chunks", contents.chunks.size()));
    for (const MemoryBudget& budget : memory) result += fmt::format("  to render  {}\n", to_string(budget));
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
        const Camera& camera = scene.cameras[i];
        result += fmt::format("  camera {}   {}x{}, {} sample{} a pixel, at ({}, {}, {}){}{}\n", i + 1, camera.width,
                              camera.height, camera.samples_per_pixel, camera.samples_per_pixel == 1 ? "" : "s",
                              camera.position.x, camera.position.y, camera.position.z,
                              camera.image_name.empty() ? "" : ": ", camera.image_name);
        for (const ToneMap& tone_map : camera.tone_maps)
            result += fmt::format("    tone map {}, key {}, burn {} %, saturation {}, gamma {}{}{}\n",
                                  to_string(tone_map.tone_operator), tone_map.key, tone_map.burn_percent,
                                  tone_map.saturation, tone_map.is_srgb ? "sRGB" : fmt::to_string(tone_map.gamma),
                                  tone_map.extension.empty() ? "" : ": ", tone_map.extension);
    }
    return result;
}

Json json_of(const std::string& file, const CheckpointSummary& summary) {
    return {{"checkpoint", file}, {"pixels_done", summary.pixels_done}, {"samples_done", summary.samples_done}};
}

double percentage(std::uint64_t part, std::uint64_t whole) {
    return 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Tells what several checkpoints of one picture have, and what they have together.
ExitStatus tell_of_checkpoints(const InfoOptions& options) {
    const MergedPicture together = merge_checkpoints({options.files.begin(), options.files.end()}, {}, {}, false);
    const auto pixels_done =
        static_cast<std::uint64_t>(std::count(together.film.done.begin(), together.film.done.end(), 1));
    Json checkpoints = Json::array();
    std::string text;
    std::vector<std::string> picture;
    for (const std::string& file : options.files) {
        const CheckpointSummary summary = summarize_checkpoint(file);
        checkpoints.push_back(json_of(file, summary));
        text += fmt::format("{}: {:.1f} % of the samples\n", file, percentage(summary.samples_done, summary.samples()));
        picture = summary.picture;
    }
    if (options.report.json) {
        print_json({{"checkpoints", checkpoints},
                    {"picture", picture},
                    {"width", together.film.width},
                    {"height", together.film.height},
                    {"samples_per_pixel", together.film.samples_per_pixel},
                    {"pixels_done", pixels_done},
                    {"samples_done", together.samples_done},
                    {"samples", together.samples()}});
        return ExitStatus::done;
    }
    text += fmt::format("together: {:.1f} % of the samples, {} of {} pixels are done\n",
                        percentage(together.samples_done, together.samples()), pixels_done, together.film.done.size());
    for (const std::string& line : picture) text += fmt::format("  {}\n", line);
    print_text(text);
    return ExitStatus::done;
}

ExitStatus tell_of_checkpoint(const InfoOptions& options) {
    const std::string& file = options.files.front();
    const CheckpointSummary summary = summarize_checkpoint(file);
    if (options.report.json) {
        print_json({{"checkpoint", file},
                    {"picture", summary.picture},
                    {"width", summary.width},
                    {"height", summary.height},
                    {"samples_per_pixel", summary.samples_per_pixel},
                    {"pixels_done", summary.pixels_done},
                    {"samples_done", summary.samples_done},
                    {"samples", summary.samples()}});
        return ExitStatus::done;
    }
    std::string text =
        fmt::format("{}\n  checkpoint of castor render: {:.1f} % of the samples, {} of {} pixels are done\n", file,
                    percentage(summary.samples_done, summary.samples()), summary.pixels_done, summary.pixels());
    for (const std::string& line : summary.picture) text += fmt::format("  {}\n", line);
    print_text(text);
    return ExitStatus::done;
}

ExitStatus run(const InfoOptions& options) {
    catch_interrupts();
    if (options.files.size() > 1) return tell_of_checkpoints(options);
    const std::string& file = options.files.front();
    if (is_section_file(file) && !is_built_scene(file)) return tell_of_checkpoint(options);
    const Stopwatch load_watch;
    const TreeQuality quality = tree_quality_from_string(options.quality);
    const SceneInput input = read_scene_input(file, quality, {options.report.quiet, options.strict, options.load});
    const double load_seconds = load_watch.seconds();
    const std::vector<StrategyChoice> all{StrategyChoice::all(Strategy::simt), StrategyChoice::all(Strategy::wide)};
    MemoryRequest request{.quality = quality, .limit = options.memory_limit};
    check_memory(plan_memory(input, request));  // for the trees that are built here
    if (!options.device.empty()) {
        request.devices = select_devices(options.device, options.device_limits);
    }
    for (const Camera& camera : input.scene.cameras)
        request.pictures.push_back({camera, {}, input.scene.lights.size()});
    const MemoryPlan memory = plan_memory(input, request);
    SceneContents built_here;
    if (!input.built) {
        Phase phase("building the trees", options.report.quiet);
        built_here = build_scene(input.scene, all, quality, {}, Progress(phase.hook()));
    }
    const SceneContents& contents = input.built ? contents_of(*input.built) : built_here;
    print_warnings(contents.arrays().warnings);
    input.refuse_warnings(file, contents.arrays().warnings.size());
    if (options.report.json)
        print_json(document(input.scene, contents, memory, load_seconds));
    else
        print_text(text(input.scene, contents, memory));
    return ExitStatus::done;
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand(
        "info", "Say what a scene holds (counts, bounds, cameras, lights, memory), or how far checkpoints are");
    const auto options = std::make_shared<InfoOptions>();
    command->add_option("SCENE", options->files, std::string(kSceneHelp) + "; or checkpoints of one picture")
        ->required();
    command->add_option("--quality", options->quality, "quality of the trees: medium or high")->capture_default_str();
    command->add_option("--device", options->device, "devices whose memory is planned too, as in castor render");
    add_memory_option(*command, options->memory_limit);
    add_device_limit_options(*command, options->device_limits);
    add_load_options(*command, options->load);
    add_strict_option(*command, options->strict);
    add_report_options(*command, options->report);
    command->footer(kInfoFooter);
    command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace castor::cli
