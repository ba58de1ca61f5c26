#include "castor/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/type_ptr.hpp>
#include <optional>

#include "c/handle.h"
#include "castor/image_io.h"
#include "castor/scene_io.h"
#include "render/light_planes.h"

using namespace castor;
using namespace castor::c;

namespace {

static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::uvec3) == 12 && sizeof(glm::vec4) == 16);

glm::vec3 to_vec3(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}
void put(const glm::vec3& v, float (&target)[3]) {
    for (int i = 0; i < 3; ++i) target[i] = v[i];
}

/// Twelve floats, row by row.
struct Rows {
    float rows[3][4];
};
Transform to_transform(const Rows& given) {
    Transform transform;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) transform[column][row] = given.rows[row][column];
    return transform;
}

template <class Element, class Value>
std::vector<Element> copy(const Value* first, std::size_t count, std::string_view name) {
    const auto elements = array<Element>(first, count, name);
    return {elements.begin(), elements.end()};
}

/// Appends `count` things that `make(i)` returns: all of them, or none. Tells the number of the first one.
template <class Thing, class Make>
void append(std::vector<Thing>& things, std::size_t count, std::string_view name, std::uint32_t* first,
            const Make& make) {
    if (count > std::numeric_limits<std::uint32_t>::max() - things.size())
        throw ArgumentError(name, fmt::format("cannot have {} more elements: numbers have 32 bits", count));
    const std::size_t old_count = things.size();
    if (things.capacity() - old_count < count) things.reserve(std::max(old_count + count, 2 * old_count));
    try {
        for (std::size_t i = 0; i < count; ++i) things.push_back(make(i));
    } catch (...) {
        things.resize(old_count);
        throw;
    }
    if (first) *first = static_cast<std::uint32_t>(old_count);
}

template <class Thing>
void append_one(std::vector<Thing>& things, Thing&& thing, std::string_view name, std::uint32_t* index) {
    append(things, 1, name, index, [&](std::size_t) { return std::move(thing); });
}

/// The i-th element, or the default where the caller has no array.
template <class Element>
std::span<const Element> optional_array(const auto* first, std::size_t count, std::string_view name) {
    return first ? array<Element>(first, count, name) : std::span<const Element>();
}
template <class Element>
Element at_or(std::span<const Element> elements, std::size_t i, const Element& missing) {
    return elements.empty() ? missing : elements[i];
}

template <class Thing>
void set_motions(std::vector<Thing>& things, std::uint32_t first, std::size_t count, const float* motions,
                 std::string_view name) {
    if (first > things.size() || count > things.size() - first)
        throw ArgumentError(name, fmt::format("are {}: found {} from number {} on", things.size(), count, first));
    const auto given = array<glm::vec3>(motions, count, "motions");
    for (std::size_t i = 0; i < count; ++i) things[first + i].motion = given[i];
}

// Members of a principled material in C and in C++.
void read(float given, float& member) {
    member = given;
}
void read(const float (&given)[3], glm::vec3& member) {
    member = to_vec3(given);
}
void read(std::uint32_t given, PrincipledMaterial::TextureIndex& member) {
    member = given == CASTOR_NO_TEXTURE ? std::nullopt : PrincipledMaterial::TextureIndex(given);
}
void write(float member, float& target) {
    target = member;
}
void write(const glm::vec3& member, float (&target)[3]) {
    put(member, target);
}
void write(const PrincipledMaterial::TextureIndex& member, std::uint32_t& target) {
    target = member.value_or(CASTOR_NO_TEXTURE);
}

/// Calls `each` with every member that both have but flags and the mode of alpha.
template <class InC, class InCpp, class Each>
void for_each_member(InC& c, InCpp& m, const Each& each) {
    each(c.base_color, m.base_color);
    each(c.alpha, m.alpha);
    each(c.alpha_cutoff, m.alpha_cutoff);
    each(c.metallic, m.metallic);
    each(c.roughness, m.roughness);
    each(c.normal_scale, m.normal_scale);
    each(c.emissive, m.emissive);
    each(c.emissive_strength, m.emissive_strength);
    each(c.ior, m.ior);
    each(c.specular, m.specular);
    each(c.specular_color, m.specular_color);
    each(c.transmission, m.transmission);
    each(c.thickness, m.thickness);
    each(c.attenuation_distance, m.attenuation_distance);
    each(c.attenuation_color, m.attenuation_color);
    each(c.dispersion, m.dispersion);
    each(c.diffuse_transmission, m.diffuse_transmission);
    each(c.diffuse_transmission_color, m.diffuse_transmission_color);
    each(c.clearcoat, m.clearcoat);
    each(c.clearcoat_roughness, m.clearcoat_roughness);
    each(c.clearcoat_normal_scale, m.clearcoat_normal_scale);
    each(c.sheen_color, m.sheen_color);
    each(c.sheen_roughness, m.sheen_roughness);
    each(c.anisotropy, m.anisotropy);
    each(c.anisotropy_rotation_radians, m.anisotropy_rotation_radians);
    each(c.iridescence, m.iridescence);
    each(c.iridescence_ior, m.iridescence_ior);
    each(c.iridescence_thickness_minimum, m.iridescence_thickness_minimum);
    each(c.iridescence_thickness_maximum, m.iridescence_thickness_maximum);
    each(c.base_color_texture, m.base_color_texture);
    each(c.metallic_roughness_texture, m.metallic_roughness_texture);
    each(c.normal_texture, m.normal_texture);
    each(c.emissive_texture, m.emissive_texture);
    each(c.specular_texture, m.specular_texture);
    each(c.specular_color_texture, m.specular_color_texture);
    each(c.transmission_texture, m.transmission_texture);
    each(c.thickness_texture, m.thickness_texture);
    each(c.diffuse_transmission_texture, m.diffuse_transmission_texture);
    each(c.diffuse_transmission_color_texture, m.diffuse_transmission_color_texture);
    each(c.clearcoat_texture, m.clearcoat_texture);
    each(c.clearcoat_roughness_texture, m.clearcoat_roughness_texture);
    each(c.clearcoat_normal_texture, m.clearcoat_normal_texture);
    each(c.sheen_color_texture, m.sheen_color_texture);
    each(c.sheen_roughness_texture, m.sheen_roughness_texture);
    each(c.anisotropy_texture, m.anisotropy_texture);
    each(c.iridescence_texture, m.iridescence_texture);
    each(c.iridescence_thickness_texture, m.iridescence_thickness_texture);
    each(c.diffuse_roughness, m.diffuse_roughness);
    each(c.diffuse_roughness_texture, m.diffuse_roughness_texture);
    each(c.multiscatter_color, m.multiscatter_color);
    each(c.scattering_anisotropy, m.scattering_anisotropy);
}

castor_principled_material default_principled() {
    castor_principled_material told{};  // flags and the mode of alpha are 0
    const PrincipledMaterial usual;
    for_each_member(told, usual, [](auto& target, const auto& member) { write(member, target); });
    return told;
}

PrincipledMaterial to_principled(const castor_principled_material& caller_given) {
    castor_principled_material given = read_struct(caller_given, "material");
    const castor_principled_material usual = default_principled();
    if (caller_given.size < sizeof given)
        std::memcpy(reinterpret_cast<char*>(&given) + caller_given.size,
                    reinterpret_cast<const char*>(&usual) + caller_given.size, sizeof given - caller_given.size);
    PrincipledMaterial material;
    for_each_member(given, material, [](const auto& from, auto& member) { read(from, member); });
    static_assert(static_cast<int>(AlphaMode::blend) == CASTOR_ALPHA_MODE_BLEND);
    material.alpha_mode = enumerator<AlphaMode>(given.alpha_mode, 3, "alpha_mode");
    material.is_double_sided = flag(given.double_sided, "double_sided");
    material.is_unlit = flag(given.unlit, "unlit");
    return material;
}

constexpr Rows kIdentity{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

castor_scene* load(const char* path, const LoadOptions& options, const ProgressHook& progress) {
    auto loaded = std::make_unique<castor_scene>();
    loaded->scene = load_scene(&require(path, "path"), options, progress);
    return loaded.release();
}

}  // namespace

namespace castor::c {

namespace {

void put_path_tracing(const PathTracing& tracing, castor_camera& told) {
    const auto bit = [](bool is_set, std::uint32_t value) { return is_set ? value : 0; };
    told.path_tracing = bit(true, CASTOR_PATH_TRACING_ON) |
                        bit(tracing.samples_brdf, CASTOR_PATH_TRACING_SAMPLES_BRDF) |
                        bit(tracing.samples_lights, CASTOR_PATH_TRACING_SAMPLES_LIGHTS) |
                        bit(tracing.weighs, CASTOR_PATH_TRACING_WEIGHS) |
                        bit(tracing.roulette_from.has_value(), CASTOR_PATH_TRACING_ROULETTE) |
                        bit(tracing.bounces.has_value(), CASTOR_PATH_TRACING_BOUNCES) |
                        bit(tracing.light_choice == LightChoice::uniform, CASTOR_PATH_TRACING_UNIFORM_LIGHTS);
    told.roulette_from = tracing.roulette_from.value_or(0);
    told.bounces = tracing.bounces.value_or(0);
    told.largest_sample = std::isinf(tracing.largest_sample) ? 0.0f : tracing.largest_sample;
}

std::optional<PathTracing> to_path_tracing(const castor_camera& given) {
    constexpr std::uint32_t kAll = 2 * CASTOR_PATH_TRACING_UNIFORM_LIGHTS - 1;
    const std::uint32_t bits = given.path_tracing;
    if (bits == 0) return std::nullopt;
    if (bits > kAll || !(bits & CASTOR_PATH_TRACING_ON))
        throw ArgumentError("path_tracing",
                            fmt::format("is {}, expected a sum of CASTOR_PATH_TRACING_ON and others", bits));
    PathTracing tracing;
    tracing.samples_brdf = bits & CASTOR_PATH_TRACING_SAMPLES_BRDF;
    tracing.samples_lights = bits & CASTOR_PATH_TRACING_SAMPLES_LIGHTS;
    tracing.weighs = bits & CASTOR_PATH_TRACING_WEIGHS;
    if (bits & CASTOR_PATH_TRACING_UNIFORM_LIGHTS) tracing.light_choice = LightChoice::uniform;
    tracing.roulette_from.reset();
    tracing.bounces.reset();
    if (bits & CASTOR_PATH_TRACING_ROULETTE) tracing.roulette_from = given.roulette_from;
    if (bits & CASTOR_PATH_TRACING_BOUNCES) tracing.bounces = given.bounces;
    tracing.largest_sample = value_or(given.largest_sample, tracing.largest_sample);
    return tracing;
}

}  // namespace

void get_camera(const std::vector<Camera>& cameras, std::size_t i, castor_camera* camera) {
    const Camera& found = cameras[position(i, cameras.size(), "the cameras")];
    castor_camera told{};
    told.image_name = found.image_name.c_str();
    put(found.position, told.position);
    put(found.gaze, told.gaze);
    put(found.up, told.up);
    told.left = found.left;
    told.right = found.right;
    told.bottom = found.bottom;
    told.top = found.top;
    told.distance = found.distance;
    told.t_min = found.t_min;
    told.t_max = found.t_max;
    told.width = found.width;
    told.height = found.height;
    told.samples_per_pixel = found.samples_per_pixel;
    told.left_handed = found.left_handed;
    told.orthographic = found.is_orthographic;
    told.aperture_size = found.aperture_size;
    told.focus_distance = found.focus_distance;
    if (found.path_tracing) put_path_tracing(*found.path_tracing, told);
    write_struct(camera, told, "camera");
}

void find_lights(const std::vector<Light>& lights, const char* word, std::uint32_t* numbers, std::size_t capacity,
                 std::size_t* count) {
    const std::string known = &require(word, "word");
    const auto target = array<std::uint32_t>(numbers, capacity, "lights");
    std::size_t& told = require(count, "count");
    const std::vector<std::uint32_t> found = castor::find_lights(lights, {known});
    std::copy_n(found.begin(), std::min(found.size(), capacity), target.begin());
    told = found.size();
}

std::size_t tone_map_count(const std::vector<Camera>& cameras, std::size_t camera) {
    return cameras[position(camera, cameras.size(), "the cameras")].tone_maps.size();
}

void get_tone_map(const std::vector<Camera>& cameras, std::size_t camera, std::size_t i, castor_tone_map* tone_map,
                  const char** extension) {
    require(tone_map, "tone_map");
    const std::vector<ToneMap>& tone_maps = cameras[position(camera, cameras.size(), "the cameras")].tone_maps;
    const ToneMap& found = tone_maps[position(i, tone_maps.size(), "the tone maps")];
    castor_tone_map told{};
    told.tone_operator = static_cast<castor_tone_operator>(found.tone_operator);
    told.srgb = found.is_srgb;
    told.key = found.key;
    told.burn_percent = found.burn_percent;
    told.saturation = found.saturation;
    told.gamma = found.gamma;
    write_struct(tone_map, told, "tone_map");
    if (extension) *extension = found.extension.c_str();
}

Camera to_camera(const castor_camera& caller_given) {
    const castor_camera given = read_struct(caller_given, "camera");
    Camera camera;
    if (given.image_name) camera.image_name = given.image_name;
    camera.position = to_vec3(given.position);
    camera.gaze = value_or(to_vec3(given.gaze), camera.gaze);
    camera.up = value_or(to_vec3(given.up), camera.up);
    if (given.left != 0.0f || given.right != 0.0f || given.bottom != 0.0f || given.top != 0.0f) {
        camera.left = given.left;
        camera.right = given.right;
        camera.bottom = given.bottom;
        camera.top = given.top;
    }
    camera.distance = value_or(given.distance, camera.distance);
    camera.t_min = given.t_min;
    camera.t_max = value_or(given.t_max, camera.t_max);
    camera.width = value_or(given.width, camera.width);
    camera.height = value_or(given.height, camera.height);
    camera.samples_per_pixel = value_or(given.samples_per_pixel, camera.samples_per_pixel);
    camera.left_handed = flag(given.left_handed, "left_handed");
    camera.is_orthographic = flag(given.orthographic, "orthographic");
    camera.aperture_size = given.aperture_size;
    camera.focus_distance = value_or(given.focus_distance, camera.focus_distance);
    camera.path_tracing = to_path_tracing(given);
    return camera;
}

}  // namespace castor::c

castor_status castor_scene_create(castor_scene** scene) {
    return guarded([&] { make_handle(scene, "scene", [] { return new castor_scene; }); });
}

castor_status castor_scene_load(const char* path, castor_progress_function progress, void* user, castor_scene** scene) {
    return guarded(
        [&] { make_handle(scene, "scene", [&] { return load(path, LoadOptions(), progress_hook(progress, user)); }); });
}

castor_status castor_scene_load_with_options(const char* path, const castor_load_options* options,
                                             castor_scene** scene) {
    return guarded([&] {
        make_handle(scene, "scene", [&] {
            const castor_load_options given = read_options(options);
            LoadOptions load_options;
            if (given.environment) load_options.environment = given.environment;
            if (given.time_seconds) load_options.time_seconds = *given.time_seconds;
            if (given.animation) load_options.animation = given.animation;
            if (given.material_variant) load_options.material_variant = given.material_variant;
            if (given.sun_angle_radians) load_options.sun_angle_radians = *given.sun_angle_radians;
            return load(path, load_options, progress_hook(given.progress, given.progress_user));
        });
    });
}

void castor_scene_retain(castor_scene* scene) {
    retain(scene);
}
void castor_scene_release(castor_scene* scene) {
    release(scene);
}

castor_status castor_scene_get_settings(const castor_scene* scene, castor_scene_settings* settings) {
    return guarded([&] {
        const Scene& from = require(scene, "scene").scene;
        castor_scene_settings told{};
        put(from.background, told.background);
        put(from.ambient_light, told.ambient_light);
        told.shadow_ray_epsilon = from.shadow_ray_epsilon;
        told.max_recursion_depth = from.max_recursion_depth;
        write_struct(settings, told, "settings");
    });
}

castor_status castor_scene_set_settings(castor_scene* scene, const castor_scene_settings* settings) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_scene_settings given = read_struct(require(settings, "settings"), "settings");
        to.background = to_vec3(given.background);
        to.ambient_light = to_vec3(given.ambient_light);
        to.shadow_ray_epsilon = given.shadow_ray_epsilon;
        to.max_recursion_depth = given.max_recursion_depth;
    });
}

castor_status castor_scene_find_lights(const castor_scene* scene, const char* word, uint32_t* lights, size_t capacity,
                                       size_t* count) {
    return guarded([&] { find_lights(require(scene, "scene").scene.lights, word, lights, capacity, count); });
}

castor_status castor_scene_add_material(castor_scene* scene, const castor_material* material, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_material given = read_struct(require(material, "material"), "material");
        static_assert(static_cast<int>(MaterialKind::dielectric) == CASTOR_MATERIAL_KIND_DIELECTRIC);
        Material added;
        added.kind = enumerator<MaterialKind>(given.kind, 4, "kind");
        added.ambient = to_vec3(given.ambient);
        added.diffuse = to_vec3(given.diffuse);
        added.specular = to_vec3(given.specular);
        added.mirror = to_vec3(given.mirror);
        added.phong_exponent = value_or(given.phong_exponent, added.phong_exponent);
        added.refraction_index = value_or(given.refraction_index, added.refraction_index);
        added.absorption_index = given.absorption_index;
        added.absorption = to_vec3(given.absorption);
        added.roughness = given.roughness;
        added.emission = to_vec3(given.emission);
        static_assert(static_cast<int>(BrdfModel::torrance_sparrow) == CASTOR_BRDF_KIND_TORRANCE_SPARROW);
        added.brdf = enumerator<BrdfModel>(given.brdf, 5, "brdf");
        added.brdf_normalized = flag(given.brdf_normalized, "brdf_normalized");
        added.diffuse_fresnel = flag(given.diffuse_fresnel, "diffuse_fresnel");
        added.textures = copy<std::uint32_t>(given.textures, given.texture_count, "textures");
        append_one(to.materials, std::move(added), "the materials", index);
    });
}

castor_status castor_principled_material_get_default(castor_principled_material* material) {
    return guarded([&] { write_struct(material, default_principled(), "material"); });
}

castor_status castor_scene_add_principled_material(castor_scene* scene, const castor_principled_material* material,
                                                   uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        Material added;
        added.principled = to_principled(require(material, "material"));
        append_one(to.materials, std::move(added), "the materials", index);
    });
}

castor_status castor_scene_add_image(castor_scene* scene, const castor_image* image, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_image given = read_struct(require(image, "image"), "image");
        if ((given.bytes == nullptr) == (given.floats == nullptr))
            throw ArgumentError("bytes and floats", given.bytes ? "are both given" : "are both NULL");
        const std::uint64_t texels = std::uint64_t{given.width} * given.height;
        if (texels == 0 || texels > kMaxTexels)
            throw ArgumentError(
                "the size", fmt::format("is {}x{}, expected 1 to {} texels", given.width, given.height, kMaxTexels));
        Image added{given.name ? given.name : "", given.width, given.height, {}, {}};
        if (given.bytes) added.bytes = copy<std::uint8_t>(given.bytes, 3 * texels, "bytes");
        if (given.floats) added.floats = copy<float>(given.floats, 3 * texels, "floats");
        if (given.alpha) {
            if (!given.bytes) throw ArgumentError("alpha", "is given without bytes");
            added.alpha = copy<std::uint8_t>(given.alpha, texels, "alpha");
        }
        append_one(to.images, std::move(added), "the images", index);
    });
}

castor_status castor_scene_add_image_file(castor_scene* scene, const char* path, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        append_one(to.images, read_image(&require(path, "path")), "the images", index);
    });
}

castor_status castor_scene_add_texture(castor_scene* scene, const castor_texture* texture, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_texture given = read_struct(require(texture, "texture"), "texture");
        static_assert(static_cast<int>(TextureKind::checkerboard) == CASTOR_TEXTURE_KIND_CHECKERBOARD);
        static_assert(static_cast<int>(TextureTarget::principled) == CASTOR_TEXTURE_TARGET_PRINCIPLED);
        static_assert(static_cast<int>(TextureFilter::trilinear) == CASTOR_TEXTURE_FILTER_TRILINEAR);
        Texture added;
        added.kind = enumerator<TextureKind>(given.kind, 3, "kind");
        added.target = enumerator<TextureTarget>(given.target, 8, "target");
        added.image = given.image;
        added.filter = enumerator<TextureFilter>(given.filter, 3, "filter");
        added.wrap = flag(given.clamp, "clamp") ? TextureWrap::clamp : TextureWrap::repeat;
        added.normalizer = value_or(given.normalizer, added.normalizer);
        added.bump_factor = value_or(given.bump_factor, added.bump_factor);
        added.noise_scale = value_or(given.noise_scale, added.noise_scale);
        added.noise_octaves = value_or(given.noise_octaves, added.noise_octaves);
        added.noise_conversion =
            flag(given.noise_absolute, "noise_absolute") ? NoiseConversion::absolute : NoiseConversion::linear;
        added.black = to_vec3(given.black);
        added.white = value_or(to_vec3(given.white), added.white);
        added.checker_scale = value_or(given.checker_scale, added.checker_scale);
        added.checker_offset = given.checker_offset;
        if (flag(given.mirror, "mirror")) {
            if (given.clamp) throw ArgumentError("mirror", "and clamp are both 1");
            added.wrap = TextureWrap::mirror;
        }
        added.coordinate_set = flag(given.coordinate_set, "coordinate_set");
        if (given.transform) {
            const auto rows = array<glm::vec3>(given.transform, 2, "transform");
            for (int column = 0; column < 3; ++column) added.transform[column] = {rows[0][column], rows[1][column]};
        }
        append_one(to.textures, std::move(added), "the textures", index);
    });
}

castor_status castor_scene_set_background_texture(castor_scene* scene, uint32_t texture) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        position(texture, to.textures.size(), "the textures");
        to.background_texture = texture;
    });
}

castor_status castor_scene_add_light(castor_scene* scene, const castor_light* light, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_light given = read_struct(require(light, "light"), "light");
        static_assert(static_cast<int>(Light::Kind::instance) == CASTOR_LIGHT_KIND_INSTANCE);
        static_assert(static_cast<int>(EnvironmentMapping::probe) == CASTOR_ENVIRONMENT_MAPPING_PROBE);
        require_zero(given.reserved);
        require_zero(given.reserved_2);
        Light added;
        added.kind = enumerator<Light::Kind>(given.kind, 8, "kind");
        added.point.position = added.spot.position = added.area.position = to_vec3(given.position);
        added.directional.direction = added.spot.direction = added.area.normal =
            value_or(to_vec3(given.direction), added.directional.direction);
        added.point.intensity = added.directional.radiance = added.spot.intensity = added.area.radiance =
            to_vec3(given.intensity);
        added.area.size = value_or(given.edge, added.area.size);
        added.object.object = given.object;
        added.environment.image = given.image;
        added.environment.mapping = enumerator<EnvironmentMapping>(given.mapping, 2, "mapping");
        added.environment.sampling =
            flag(given.cosine_sampling, "cosine_sampling") ? EnvironmentSampling::cosine : EnvironmentSampling::picture;
        if (given.coverage_radians != 0.0f || given.falloff_radians != 0.0f) {
            added.spot.coverage_radians = given.coverage_radians;
            added.spot.falloff_radians = given.falloff_radians;
        }
        added.spot.falloff =
            flag(given.square_falloff, "square_falloff") ? SpotFalloff::square : SpotFalloff::fourth_power;
        added.directional.angle_radians = given.angle_radians;
        added.point.range = added.spot.range = value_or(given.range, added.point.range);
        append_one(to.lights, std::move(added), "the lights", index);
    });
}

castor_status castor_scene_add_camera(castor_scene* scene, const castor_camera* camera, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        append_one(to.cameras, to_camera(require(camera, "camera")), "the cameras", index);
    });
}

castor_status castor_scene_get_camera(const castor_scene* scene, size_t i, castor_camera* camera) {
    return guarded([&] { get_camera(require(scene, "scene").scene.cameras, i, camera); });
}

castor_status castor_scene_add_tone_map(castor_scene* scene, size_t camera, const castor_tone_map* tone_map,
                                        const char* extension) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_tone_map given = read_struct(require(tone_map, "tone_map"), "tone_map");
        static_assert(static_cast<int>(ToneOperator::agx) == CASTOR_TONE_OPERATOR_AGX);
        ToneMap added;
        added.tone_operator = enumerator<ToneOperator>(given.tone_operator, 5, "tone_operator");
        added.is_srgb = flag(given.srgb, "srgb");
        added.key = value_or(given.key, added.key);
        added.burn_percent = given.burn_percent;
        added.saturation = given.saturation;
        added.gamma = value_or(given.gamma, added.gamma);
        if (extension) added.extension = extension;
        to.cameras[position(camera, to.cameras.size(), "the cameras")].tone_maps.push_back(std::move(added));
    });
}

castor_status castor_scene_get_tone_map_count(const castor_scene* scene, size_t camera, size_t* count) {
    return guarded([&] {
        const std::vector<Camera>& cameras = require(scene, "scene").scene.cameras;
        require(count, "count") = tone_map_count(cameras, camera);
    });
}

castor_status castor_scene_get_tone_map(const castor_scene* scene, size_t camera, size_t i, castor_tone_map* tone_map,
                                        const char** extension) {
    return guarded([&] { get_tone_map(require(scene, "scene").scene.cameras, camera, i, tone_map, extension); });
}

castor_status castor_camera_resize(castor_camera* camera, uint32_t width, uint32_t height) {
    return guarded([&] {
        Camera resized = to_camera(require(camera, "camera"));
        if (width == 0 || height == 0)
            throw ArgumentError("the size", fmt::format("is {}x{}, expected at least 1x1", width, height));
        resize(resized, width, height);
        const char* const image_name = camera->image_name;
        get_camera({resized}, 0, camera);
        camera->image_name = image_name;
    });
}

castor_status castor_scene_add_default_view(castor_scene* scene) {
    return guarded([&] { add_default_view(require(scene, "scene").scene); });
}

castor_status castor_scene_add_mesh(castor_scene* scene, const castor_mesh* mesh, uint32_t* index) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const castor_mesh given = read_struct(require(mesh, "mesh"), "mesh");
        Mesh added;
        added.positions = copy<glm::vec3>(given.vertices, given.vertex_count, "vertices");
        added.triangles = copy<glm::uvec3>(given.triangles, given.triangle_count, "triangles");
        if (given.normals) added.normals = copy<glm::vec3>(given.normals, given.vertex_count, "normals");
        if (given.transform) added.transform = to_transform(array<Rows>(given.transform, 1, "transform")[0]);
        added.material = given.material;
        require_zero(given.reserved);
        if (given.texture_coordinates)
            added.texture_coordinates =
                copy<glm::vec2>(given.texture_coordinates, given.vertex_count, "texture_coordinates");
        added.motion = to_vec3(given.motion);
        if (given.texture_coordinates_1)
            added.texture_coordinates_1 =
                copy<glm::vec2>(given.texture_coordinates_1, given.vertex_count, "texture_coordinates_1");
        if (given.colors) added.colors = copy<glm::vec4>(given.colors, given.vertex_count, "colors");
        if (given.tangents) added.tangents = copy<glm::vec4>(given.tangents, given.vertex_count, "tangents");
        if (flag(given.smooth, "smooth")) {
            if (given.normals) throw ArgumentError("normals", "are given, and smooth is 1: expected one of them");
            for (const glm::uvec3& triangle : added.triangles)
                for (int i = 0; i < 3; ++i)
                    if (triangle[i] >= given.vertex_count)
                        throw ArgumentError("triangles", fmt::format("name vertex {}, and there are {}", triangle[i],
                                                                     given.vertex_count));
            compute_smooth_normals(added);
        }
        append_one(to.meshes, std::move(added), "the meshes", index);
    });
}

castor_status castor_scene_add_instances(castor_scene* scene, size_t count, const uint32_t* meshes,
                                         const uint32_t* materials, const float* transforms, uint32_t* first) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const auto mesh_of = array<std::uint32_t>(meshes, count, "meshes");
        const auto material_of = optional_array<std::uint32_t>(materials, count, "materials");
        const auto transform_of = array<Rows>(transforms, count, "transforms");
        append(to.instances, count, "the instances", first, [&](std::size_t i) {
            MeshInstance instance;
            instance.mesh = mesh_of[i];
            instance.transform = to_transform(transform_of[i]);
            instance.material = at_or(material_of, i, 0u);
            return instance;
        });
    });
}

castor_status castor_scene_add_spheres(castor_scene* scene, size_t count, const float* centers_radii,
                                       const uint32_t* materials, const float* transforms, uint32_t* first) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const auto center_radius = array<glm::vec4>(centers_radii, count, "centers_radii");
        const auto material_of = optional_array<std::uint32_t>(materials, count, "materials");
        const auto transform_of = optional_array<Rows>(transforms, count, "transforms");
        append(to.spheres, count, "the spheres", first, [&](std::size_t i) {
            Sphere sphere;
            sphere.center = glm::vec3(center_radius[i]);
            sphere.radius = center_radius[i].w;
            sphere.material = at_or(material_of, i, 0u);
            sphere.transform = to_transform(at_or(transform_of, i, kIdentity));
            return sphere;
        });
    });
}

castor_status castor_scene_set_instance_motions(castor_scene* scene, uint32_t first, size_t count,
                                                const float* motions) {
    return guarded(
        [&] { set_motions(require(scene, "scene").scene.instances, first, count, motions, "the instances"); });
}

castor_status castor_scene_set_sphere_motions(castor_scene* scene, uint32_t first, size_t count, const float* motions) {
    return guarded([&] { set_motions(require(scene, "scene").scene.spheres, first, count, motions, "the spheres"); });
}

castor_status castor_scene_add_planes(castor_scene* scene, size_t count, const float* points, const float* normals,
                                      const uint32_t* materials, uint32_t* first) {
    return guarded([&] {
        Scene& to = require(scene, "scene").scene;
        const auto point = array<glm::vec3>(points, count, "points");
        const auto normal = array<glm::vec3>(normals, count, "normals");
        const auto material_of = optional_array<std::uint32_t>(materials, count, "materials");
        append(to.planes, count, "the planes", first, [&](std::size_t i) {
            return Plane{.point = point[i], .normal = normal[i], .material = at_or(material_of, i, 0u)};
        });
    });
}

castor_status castor_scene_get_counts(const castor_scene* scene, castor_scene_counts* counts) {
    return guarded([&] {
        const Scene& from = require(scene, "scene").scene;
        castor_scene_counts told{};
        for (const Mesh& mesh : from.meshes) {
            told.vertices += mesh.positions.size();
            told.triangles += mesh.triangles.size();
        }
        told.meshes = from.meshes.size();
        told.instances = from.instances.size();
        told.spheres = from.spheres.size();
        told.planes = from.planes.size();
        told.materials = from.materials.size();
        told.lights = from.lights.size();
        told.cameras = from.cameras.size();
        told.images = from.images.size();
        told.textures = from.textures.size();
        write_struct(counts, told, "counts");
    });
}

castor_status castor_scene_get_warning_count(const castor_scene* scene, size_t* count) {
    return guarded([&] { require(count, "count") = require(scene, "scene").scene.warnings.size(); });
}

castor_status castor_scene_get_warning(const castor_scene* scene, size_t i, castor_warning* warning) {
    return guarded([&] { get_warning(require(scene, "scene").scene.warnings, i, warning); });
}
