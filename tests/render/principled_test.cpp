// Principled materials in path-traced pictures: closed formulas, textures, opacity, and the same bytes however the work
// is done. All scenes have the same features, so that the kernels are compiled once.
#include "scene/principled.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "image/srgb.h"
#include "reference/meshes.h"
#include "render/render_features.h"
#include "support/blocks.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/divided_scene.h"
#include "support/estimate.h"
#include "support/picture.h"
#include "support/principled_scene.h"
#include "support/same_picture.h"

namespace castor::test {

namespace {

using glm::dvec3;
using glm::vec3;

PrincipledMaterial glass(const vec3& attenuation) {
    PrincipledMaterial material;
    material.metallic = material.roughness = 0.0f;
    material.transmission = 1.0f;
    material.thickness = 1.0f;
    material.attenuation_color = attenuation;
    material.attenuation_distance = 1.0f;
    return material;
}

/// Shows its colour, of which 1 is 255, and needs no light.
PrincipledMaterial unlit(const vec3& color) {
    PrincipledMaterial material;
    material.base_color = color;
    material.is_unlit = true;
    return material;
}

std::uint32_t add_texture(Scene& scene, Image image, TextureFilter filter) {
    Texture texture;
    texture.target = TextureTarget::principled;
    texture.filter = filter;
    texture.image = static_cast<std::uint32_t>(scene.images.size());
    scene.images.push_back(std::move(image));
    scene.textures.push_back(texture);
    return static_cast<std::uint32_t>(scene.textures.size() - 1);
}

Image picture(std::uint32_t width, std::uint32_t height, std::vector<std::uint8_t> bytes,
              std::vector<std::uint8_t> alpha = {}) {
    Image image{"", width, height};
    image.bytes = std::move(bytes);
    image.alpha = std::move(alpha);
    return image;
}

/// A scene in light of this radiance from everywhere, with one material of each kind that kernels are compiled for.
Scene scene_in(float radiance) {
    Scene scene = empty_scene_in(radiance);
    PrincipledMaterial textured = matt(vec3(1.0f));
    textured.base_color_texture = add_texture(scene, picture(1, 1, {255, 255, 255}), TextureFilter::trilinear);
    PrincipledMaterial veil = unlit(vec3(1.0f));
    veil.alpha_mode = AlphaMode::blend;
    veil.alpha = 0.5f;
    PrincipledMaterial prism = glass(vec3(1.0f));
    prism.dispersion = 1.0f;
    scene.materials = {material_of(textured), material_of(prism), material_of(veil)};
    return scene;
}

/// A rectangle with texture coordinates: u along `u`, v against `v`, as pictures lie upright.
Mesh textured_rectangle(const vec3& centre, const vec3& u, const vec3& v, std::uint32_t material) {
    Mesh mesh = rectangle(centre, u, v, material);
    mesh.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    return mesh;
}

/// What a picture of the rectangle [-1, 1]^2 at z = -1, of the material that was added last, shows.
Film seen(const Scene& scene, std::uint32_t samples, std::uint32_t size = 8) {
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.samples_per_pixel = samples;
    return renderer.render(square_camera({}, {0, 0, -1}, 0.5f, size), options);
}

Scene wall_of(const PrincipledMaterial& material, float radiance = 0.0f) {
    Scene scene = scene_in(radiance);
    const std::uint32_t number = add_material(scene, material_of(material));
    scene.meshes = {textured_rectangle({0, 0, -1}, {1, 0, 0}, {0, 1, 0}, number)};
    return scene;
}

/// Everything that principled materials have, in one scene.
Scene busy_principled_scene() {
    Scene scene = scene_in(60.0f);
    RandomSource random(7);
    const auto noise = [&](std::uint32_t size, bool has_alpha) {
        Image image{"", size, size};
        for (std::uint32_t i = 0; i < 3 * size * size; ++i)
            image.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
        for (std::uint32_t i = 0; has_alpha && i < size * size; ++i)
            image.alpha.push_back(static_cast<std::uint8_t>(random.below(256)));
        return image;
    };
    const std::uint32_t colors = add_texture(scene, noise(16, true), TextureFilter::trilinear);
    const std::uint32_t numbers = add_texture(scene, noise(7, true), TextureFilter::bilinear);
    const std::uint32_t normals = add_texture(scene, noise(5, false), TextureFilter::nearest);
    scene.textures[numbers].coordinate_set = 1;
    scene.textures[normals].wrap = TextureWrap::mirror;
    PrincipledMaterial all;
    all.base_color_texture = colors;
    all.alpha_mode = AlphaMode::blend;
    all.metallic_roughness_texture = numbers;
    all.normal_texture = normals;
    all.emissive = vec3(0.2f);
    all.emissive_texture = colors;
    all.specular_texture = all.specular_color_texture = numbers;
    all.clearcoat = 0.5f;
    all.clearcoat_texture = all.clearcoat_roughness_texture = numbers;
    all.clearcoat_normal_texture = colors;
    all.iridescence = 0.7f;
    all.iridescence_texture = all.iridescence_thickness_texture = numbers;
    all.sheen_color = vec3(0.5f);
    all.sheen_color_texture = all.sheen_roughness_texture = colors;
    all.anisotropy = 0.7f;
    all.anisotropy_texture = normals;
    all.diffuse_roughness = 0.8f;
    all.diffuse_roughness_texture = numbers;
    PrincipledMaterial leaf = matt({0.3f, 0.8f, 0.2f});
    leaf.base_color_texture = colors;
    leaf.alpha_mode = AlphaMode::mask;
    leaf.diffuse_transmission = 0.5f;
    leaf.diffuse_transmission_texture = leaf.diffuse_transmission_color_texture = colors;
    PrincipledMaterial bottle = glass({0.5f, 0.9f, 0.6f});
    bottle.roughness = 0.3f;
    bottle.transmission_texture = numbers;
    bottle.dispersion = 2.0f;
    PrincipledMaterial lamp = matt(vec3(0.5f));
    lamp.emissive = {3, 2, 1};
    const auto number_of = [&](const PrincipledMaterial& material) {
        return add_material(scene, material_of(material));
    };
    Mesh wall = textured_rectangle({0, 0, -3}, {2, 0, 0}, {0, 2, 0}, number_of(all));
    wall.texture_coordinates_1 = {{0.2f, 0.1f}, {3, 0}, {2, 2}, {0, 1}};
    wall.colors = {{1, 1, 1, 1}, {0.5f, 1, 1, 1}, {1, 0.5f, 1, 0.5f}, {1, 1, 0.5f, 1}};
    wall.tangents = {{1, 0, 0, 1}, {0, 1, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, 1}};
    Mesh moved = wall;
    moved.transform[3] = {0.5f, -1.0f, 0.8f};
    PrincipledMaterial pane = bottle;
    pane.thickness = pane.roughness = 0.0f;
    pane.base_color_texture = colors;
    const std::uint32_t of_leaf = number_of(leaf), of_bottle = number_of(bottle);
    scene.meshes = {wall, textured_rectangle({0.4f, 0.3f, -2}, {0.6f, 0, 0}, {0, 0.6f, 0}, of_leaf),
                    textured_rectangle({0, 1.8f, -2}, {1, 0, 0}, {0, 0, 1}, number_of(lamp)), moved,
                    textured_rectangle({0.3f, 0.5f, -1.5f}, {0.6f, 0, 0}, {0, 0, 0.6f}, number_of(pane))};
    scene.spheres = {{{-0.5f, -0.3f, -2}, 0.5f, of_bottle, 0}, {{0.7f, -0.7f, -2}, 0.3f, of_leaf, 0}};
    Transform turned(1.0f);
    turned[0] = {0, 0.4f, 0};
    turned[1] = {-0.4f, 0, 0};
    turned[3] = {-1.0f, 0.9f, 1.0f};
    scene.instances = {{1, turned, of_leaf, 0}};
    Light of_lamp;
    of_lamp.kind = Light::Kind::mesh;
    of_lamp.object.object = 2;
    scene.lights.push_back(of_lamp);
    scene.lights.push_back(point_light({0, 0, 0.5f}, vec3(100.0f)));
    Material classic = diffuse_material(vec3(0.5f));
    scene.spheres.push_back({{0, -1.2f, -2}, 0.3f, add_material(scene, classic), 0});
    scene.cameras = {square_camera({}, {0, 0, -1}, 0.7f, 40)};
    return scene;
}

/// A room whose lamp, a mesh with a picture of what it emits, stands there again as an instance, smaller and mirrored.
Scene room_of_textured_lamps() {
    Scene scene = busy_principled_scene();
    scene.images[0].floats.assign(scene.images[0].floats.size(), 0.0f);
    PrincipledMaterial& lamp = *scene.materials[scene.meshes[2].material].principled;
    lamp.emissive_texture = scene.materials[scene.meshes[0].material].principled->base_color_texture;
    const std::uint32_t of_lamp = scene.meshes[2].material, white = scene.spheres.back().material;
    scene.meshes = {textured_rectangle({0, 0, -3}, {3, 0, 0}, {0, 3, 0}, white),
                    textured_rectangle({-1, 1.2f, -2}, {0.5f, 0, 0}, {0, 0.2f, 0.5f}, of_lamp)};
    Transform mirrored(0.5f);
    mirrored[0] = {0, 0.5f, 0};
    mirrored[1] = {0.5f, 0, 0};
    mirrored[3] = {0.4f, 0.2f, -1.6f};
    scene.instances = {{1, mirrored, of_lamp, 0}};
    scene.spheres = {{{0.3f, -0.8f, -2.2f}, 0.5f, white, 0}};
    scene.lights.resize(1);
    add_mesh_lights(scene);
    scene.cameras[0].width = scene.cameras[0].height = 24;
    return scene;
}

/// How much the means of a picture and of its blocks may err, relative to them.
struct Errors {
    double whole = 0.0, blocks = 0.0;
    bool has_rare_light = false;  // points of lights alone rarely find it
};

/// Checks that a scene's picture has the same means, block by block, however lights are found.
void check_ways_agree(const Scene& scene, std::uint32_t bounces, const Errors& errors) {
    Renderer renderer(scene, {test_device()});
    const auto pictures = [&](auto&& change) {
        Camera camera = scene.cameras[0];
        camera.path_tracing.emplace().bounces = bounces;
        change(*camera.path_tracing);
        RenderOptions options;
        options.samples_per_pixel = 16;  // of all ways: by it the levels of textures are chosen
        return pictures_of(renderer, camera, options, 8);
    };
    const BlockTest test(pictures([](PathTracing&) {}), 4);
    const auto check = [&](const char* way, bool has_rare_light, auto&& change) {
        const std::optional<double> of_blocks = has_rare_light ? std::nullopt : std::optional(errors.blocks);
        const bool differs = test.check(way, pictures(change), errors.whole, of_blocks);
        // Of two bounces none ends by roulette; with one, all light is found in the same way.
        CHECK((differs || bounces <= 2));
    };
    check("any light", false, [](PathTracing& tracing) { tracing.light_choice = LightChoice::uniform; });
    check("lights alone", errors.has_rare_light, [](PathTracing& tracing) { tracing.weighs = false; });
    check("by chance", false, [](PathTracing& tracing) { tracing.samples_lights = tracing.weighs = false; });
    check("no roulette", false, [](PathTracing& tracing) { tracing.roulette_from.reset(); });
}

/// A floor and a wall behind two panes: one tinted, one with pictures, partly matt and partly rough. Light of the sky
/// and of a lamp comes through them alone, and the eye sees the floor through the tinted one.
Scene room_behind_panes() {
    Scene scene = scene_in(30.0f);
    RandomSource random(3);
    Image noise{"", 4, 4};
    for (int i = 0; i < 3 * 16; ++i) noise.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
    for (std::size_t i = 1; i < noise.bytes.size(); i += 6) noise.bytes[i] = 0;  // roughness of every other texel
    const std::uint32_t texture = add_texture(scene, noise, TextureFilter::bilinear);
    PrincipledMaterial tinted = glass(vec3(1.0f));
    tinted.thickness = 0.0f;
    tinted.base_color = {0.9f, 0.8f, 0.6f};
    PrincipledMaterial printed = tinted;
    printed.base_color_texture = printed.metallic_roughness_texture = texture;
    printed.metallic = 0.2f;
    printed.roughness = 1.0f;
    printed.transmission = 0.9f;
    printed.clearcoat = 0.5f;
    printed.sheen_color = vec3(0.2f);
    PrincipledMaterial lamp = matt(vec3(0.5f));
    lamp.emissive = {0.8f, 0.7f, 0.6f};
    const auto number_of = [&](const PrincipledMaterial& material) {
        return add_material(scene, material_of(material));
    };
    const std::uint32_t white = number_of(matt(vec3(0.6f)));
    scene.shadow_ray_epsilon = 1e-4f;
    scene.meshes = {rectangle({0, 0, -3}, {2, 0, 0}, {0, 2, 0}, white),
                    rectangle({0, -1, -2}, {2, 0, 0}, {0, 0, 1}, white),
                    rectangle({0, 0, -1.2f}, {2, 0, 0}, {0, 2, 0}, number_of(tinted)),
                    textured_rectangle({0, 2, -2.2f}, {2, 0, 0}, {0, 0, 1}, number_of(printed)),
                    rectangle({0.5f, 2.6f, -2}, {0.4f, 0, 0}, {0, 0, 0.4f}, number_of(lamp))};
    add_mesh_lights(scene);
    scene.cameras = {square_camera({}, {0, -0.1f, -1}, 0.5f, 24)};
    return scene;
}

}  // namespace

TEST_CASE("lamps with pictures, and instances of them, are found by all ways of sampling", "[principled]") {
    const Scene scene = room_of_textured_lamps();
    REQUIRE(scene.lights.size() == 3);
    CHECK(scene.lights[2].kind == Light::Kind::instance);
    check_ways_agree(scene, 3, {0.013, 0.3});
}

TEST_CASE("light behind panes is found by all ways of sampling", "[principled][panes]") {
    const std::uint32_t bounces = GENERATE(1u, 2u, 24u);
    CAPTURE(bounces);
    check_ways_agree(room_behind_panes(), bounces, {0.0025, 0.012});
}

TEST_CASE("paths and rays to lights agree where panes are smooth in part, seen from afar", "[principled][panes]") {
    // Every other row of the picture is smooth, and far levels of it are not.
    Scene scene = scene_in(0.0f);
    Image rows{"", 64, 64};
    for (int i = 0; i < 64 * 64; ++i) rows.bytes.insert(rows.bytes.end(), {0, std::uint8_t(i / 64 % 2 * 160), 0});
    PrincipledMaterial pane = glass(vec3(1.0f));
    pane.thickness = 0.0f;
    pane.roughness = 1.0f;
    pane.metallic_roughness_texture = add_texture(scene, rows, TextureFilter::trilinear);
    PrincipledMaterial lamp = matt(vec3(0.0f));
    lamp.emissive = vec3(1.0f);
    const std::uint32_t floor = add_material(scene, material_of(matt(vec3(0.5f))));
    Mesh wall = textured_rectangle({0, 0.9f, 0}, {2, 0, 0}, {0, 0, 2}, add_material(scene, material_of(pane)));
    for (glm::vec2& uv : wall.texture_coordinates) uv *= 32.0f;
    scene.meshes = {rectangle({0, 0, 0}, {0, 0, 2}, {2, 0, 0}, floor), wall,
                    rectangle({0, 1, 0}, {1.5f, 0, 0}, {0, 0, 1.5f}, add_material(scene, material_of(lamp)))};
    add_mesh_lights(scene);
    scene.shadow_ray_epsilon = 1e-4f;
    scene.cameras = {square_camera({0, 8, 30}, {0, -8, -30}, 0.01f, 16)};
    check_ways_agree(scene, 4, {0.3, 0.01, true});  // where the pane is rough
}

TEST_CASE("the background is seen through panes, and not in them", "[principled][panes]") {
    Scene scene = scene_in(0.0f);
    scene.lights.clear();
    scene.background = {40, 80, 120};
    PrincipledMaterial pane = glass(vec3(1.0f));
    pane.thickness = 0.0f;
    pane.base_color = {0.5f, 1.0f, 0.25f};
    const std::uint32_t number = add_material(scene, material_of(pane));
    for (const float z : {-1.0f, -1.5f}) scene.meshes.push_back(rectangle({0, 0, z}, {9, 0, 0}, {0, 9, 0}, number));
    // Head-on, each of two panes reflects 2 R / (1 + R) with R = 0.04, and rays that were reflected see nothing.
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.samples_per_pixel = 4096;
    dvec3 found(0.0);
    for (const vec3& pixel : renderer.render(square_camera({}, {0, 0, -1}, 0.01f, 4), options).pixels)
        found += dvec3(pixel) / 16.0;
    const double passed = 1.0 - 2.0 * 0.04 / 1.04;
    const dvec3 expected = dvec3(40, 80, 120) * glm::pow(passed * dvec3(0.5, 1.0, 0.25), dvec3(2.0));
    for (int i = 0; i < 3; ++i) CHECK(std::abs(found[i] - expected[i]) <= 0.01 * expected[i]);
}

TEST_CASE("rays along the edges of a pane's triangles pass it once", "[principled][panes]") {
    Scene scene = scene_in(1.0f);
    PrincipledMaterial pane = glass(vec3(1.0f));
    pane.thickness = 0.0f;
    pane.ior = 1.0f;
    pane.base_color = vec3(0.5f);
    const std::uint32_t number = add_material(scene, material_of(pane));
    const float tilt = GENERATE(0.0f, 0.13f, 0.4f);
    CAPTURE(tilt);
    scene.meshes = {rectangle({0, 0, -5}, {2, 0, 2 * tilt}, {0, 2, -tilt}, number)};
    SECTION("from the eye") {
        Renderer renderer(scene, {test_device()});
        RenderOptions options;
        options.samples_per_pixel = 1;
        for (const vec3& pixel : renderer.render(square_camera({}, {0, 0, -1}, 0.3f, 128), options).pixels)
            CHECK(std::abs(pixel.x - 0.5f) <= 1e-5f);
    }
    SECTION("to a light") {
        const std::uint32_t floor = add_material(scene, material_of(matt(vec3(1.0f))));
        scene.meshes.push_back(rectangle({0, 0, -6}, {9, 0, 0}, {0, 9, 0}, floor));
        scene.lights = {point_light({}, vec3(36.0f))};
        Renderer renderer(scene, {test_device()});
        RenderOptions options;
        options.samples_per_pixel = 1;
        options.bounces = 1;
        const Film film = renderer.render(square_camera({0, 0, -5.9f}, {0, 0, -1}, 12.0f, 128), options);
        int count = 0;
        for (std::uint32_t y = 0; y < 128; ++y)
            for (std::uint32_t x = 0; x < 128; ++x) {
                const float across = (x + 0.5f) / 64.0f - 1.0f, down = (y + 0.5f) / 64.0f - 1.0f;
                const float r2 = 36.0f + 1.44f * (across * across + down * down);  // within a pixel
                const float passed = film.pixels[y * 128 + x].x * r2 * std::sqrt(r2) * 3.14159265f / (36.0f * 6.0f);
                count += std::abs(passed - 0.5f) <= 0.01f ? 0 : 1;
            }
        CHECK(count == 0);
    }
}

TEST_CASE("lights that no ray meets shine through panes, and not through frosted ones", "[principled][panes]") {
    // A floor, and panes behind the eye. Of each, what is not reflected by its two sides is tinted and passes.
    Scene scene = scene_in(0.0f);
    PrincipledMaterial pane = glass(vec3(1.0f));
    pane.thickness = 0.0f;
    pane.base_color = {0.5f, 0.8f, 1.0f};
    pane.transmission = 0.75f;
    const std::uint32_t number = add_material(scene, material_of(pane));
    const std::uint32_t floor = add_material(scene, material_of(matt(vec3(0.5f))));
    scene.meshes = {rectangle({0, 0, -1}, {9, 0, 0}, {0, 9, 0}, floor)};
    const int count = GENERATE(1, 3);
    for (int i = 0; i < count; ++i)
        scene.meshes.push_back(rectangle({0, 0, 1.0f + 0.1f * i}, {90, 0, 0}, {0, 90, 0}, number));
    const double cosine = GENERATE(1.0, 0.5);
    const double sine = std::sqrt(1.0 - cosine * cosine);
    const vec3 from(sine, 0, cosine);
    const bool is_point = GENERATE(false, true);
    scene.lights = {is_point ? point_light(vec3(0, 0, -1) + 10.0f * from, vec3(500.0f))
                             : directional_light(-from, vec3(5.0f))};
    const auto shown = [&] {
        Renderer renderer(scene, {test_device()});
        RenderOptions options;
        options.samples_per_pixel = 16;
        options.bounces = 1;
        return renderer.render(square_camera({}, {0, 0, -1}, 0.001f, 2), options).pixels[0];
    };
    const double refracted = std::sqrt(1.0 - sine * sine / 2.25);
    const double s = (cosine - 1.5 * refracted) / (cosine + 1.5 * refracted);
    const double p = (1.5 * cosine - refracted) / (1.5 * cosine + refracted);
    const double once = 0.5 * (s * s + p * p), passed = 0.75 * (1.0 - 2.0 * once / (1.0 + once));
    const dvec3 expected =
        0.5 * 5.0 / std::numbers::pi * cosine * glm::pow(passed * dvec3(0.5, 0.8, 1.0), dvec3(count));
    const vec3 found = shown();
    CAPTURE(count, cosine, is_point);
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i, found[i], expected[i]);
        CHECK(std::abs(found[i] - expected[i]) <= 1e-3 * expected[i]);
    }
    scene.meshes.push_back(rectangle({0, 0, 2}, {90, 0, 0}, {0, 90, 0}, floor));  // behind the panes
    CHECK(shown() == vec3(0.0f));
    scene.meshes.pop_back();
    scene.materials[number].principled->roughness = 0.3f;
    CHECK(shown() == vec3(0.0f));
}

/// The mean of a picture that should be 1 everywhere: paths alone find the light, and end late.
Estimate seen_in_furnace(const Scene& scene, float half_width, std::uint32_t size) {
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({}, {0, 0, -1}, half_width, size);
    camera.path_tracing.emplace().samples_lights = false;
    camera.path_tracing->weighs = false;
    camera.path_tracing->bounces = 24;
    camera.path_tracing->roulette_from.reset();
    RenderOptions options;
    options.samples_per_pixel = 16;
    return estimate_of(renderer.render(camera, options));
}

TEST_CASE("white principled surfaces in white light send as much as they get", "[principled]") {
    struct Surface {
        const char* name;
        float metallic, roughness, transmission, clearcoat;
        double tolerance = 0.005;
    };
    constexpr Surface kSurfaces[] = {
        {"smooth metal", 1, 0, 0, 0},     {"rough metal", 1, 0.6f, 0, 0},         {"smooth dielectric", 0, 0, 0, 0},
        {"rough dielectric", 0, 1, 0, 0}, {"half metal", 0.5f, 0.3f, 0, 0},       {"smooth glass", 0, 0, 1, 0},
        {"coat", 0, 0.5f, 0, 1},          {"frosted glass", 0, 0.5f, 1, 0, 0.01}, {"rough glass", 0, 1, 1, 0, 0.02}};
    Scene scene = scene_in(1.0f);
    scene.materials.push_back({});
    scene.spheres = {{{0, 0, -3}, 1.0f, static_cast<std::uint32_t>(scene.materials.size() - 1), 0}};
    for (const Surface& surface : kSurfaces) {
        PrincipledMaterial material = glass(vec3(1.0f));
        material.metallic = surface.metallic;
        material.roughness = surface.roughness;
        material.transmission = surface.transmission;
        material.clearcoat = surface.clearcoat;
        scene.materials.back() = material_of(material);
        const Estimate found = seen_in_furnace(scene, 0.2f, 16);
        CAPTURE(surface.name, found.mean, found.standard_error);
        CHECK(std::abs(found.mean - 1.0) <= surface.tolerance + 4.0 * found.standard_error);
    }
}

TEST_CASE("smooth meshes have no dark rims", "[principled]") {
    // White plastic in white light; of few triangles, whose normals turn away long before they do.
    PrincipledMaterial material = glass(vec3(1.0f));
    material.transmission = material.roughness = 0.0f;
    const bool is_instance = GENERATE(false, true);
    Scene scene = scene_in(1.0f);
    Mesh ball = icosphere(2);
    ball.normals = ball.positions;
    ball.material = add_material(scene, material_of(material));
    for (vec3& p : ball.positions) p.z += is_instance ? 90.0f : -3.0f;  // where nobody looks
    scene.meshes = {ball};
    if (is_instance) {
        Transform mirrored(1.0f);
        mirrored[1].y = 0.5f;
        mirrored[2].z = -1.0f;
        mirrored[3].z = 87.0f;
        scene.instances = {{0, mirrored, ball.material, 0}};
    }
    const Estimate found = seen_in_furnace(scene, 0.4f, 64);
    CAPTURE(is_instance, found.mean, found.standard_error);
    CHECK(std::abs(found.mean - 1.0) <= 2e-4 + 2.0 * found.standard_error);
}

TEST_CASE("a principled surface without facets is Lambert's", "[principled]") {
    // Irradiance E of a directional light gives albedo E cos / pi.
    Scene scene = wall_of(matt({0.25f, 0.5f, 0.75f}));
    scene.lights.push_back(directional_light({0, -3, -4}, vec3(10.0f)));
    const Film film = seen(scene, 512);
    // Of two lights, one black, one is chosen: so the picture has noise.
    check_mean(estimate_of(film), 0.25 * 10.0 * 0.8 / std::numbers::pi);
    for (const vec3& pixel : film.pixels) {
        CHECK(std::abs(pixel.y - 2.0f * pixel.x) <= 1e-5f * pixel.y);
        CHECK(std::abs(pixel.z - 3.0f * pixel.x) <= 1e-5f * pixel.z);
    }
}

TEST_CASE("diffuse roughness sends more light back to where it is from, as its texture says", "[principled]") {
    // Light that grazes the wall from the right, seen from there.
    const auto shown = [](float roughness, std::optional<std::uint8_t> texel) {
        PrincipledMaterial material = matt(vec3(0.8f));
        material.diffuse_roughness = roughness;
        Scene scene = scene_in(0.0f);
        scene.lights.push_back(directional_light({-1, 0, -0.3f}, vec3(10.0f)));
        if (texel) {
            // The largest of red counts; green and blue would say otherwise.
            const auto red = *texel, other = static_cast<std::uint8_t>(255 - *texel);
            material.diffuse_roughness_texture =
                add_texture(scene, picture(1, 1, {red, other, other}), TextureFilter::nearest);
        }
        scene.meshes = {textured_rectangle({}, {9, 0, 0}, {0, 9, 0}, add_material(scene, material_of(material)))};
        Renderer renderer(scene, {test_device()});
        RenderOptions options;
        options.samples_per_pixel = 256;
        const Camera camera = square_camera({1, 0, 0.3f}, {-1, 0, -0.3f}, 0.01f, 4);
        return estimate_of(renderer.render(camera, options)).mean;
    };
    const double lambert = shown(0.0f, std::nullopt), rough = shown(1.0f, std::nullopt);
    CHECK(std::abs(lambert - 0.8 / std::numbers::pi * 10.0 * 0.3 / std::sqrt(1.09)) <= 0.02 * lambert);
    // EON with r = 1 and albedo 0.8, of cosines m = 0.2873 with wo = wi, as in the paper's listing 1.
    const double m = 0.3 / std::sqrt(1.09), af = 1 / (1 + (0.5 - 2 / (3 * std::numbers::pi)));
    const auto albedo = [&](double mu) {
        const double s = std::sqrt(1 - mu * mu);
        const double g = s * (std::acos(mu) - s * mu) + 2.0 / 3.0 * (s / mu * (1 - s * s * s) - s);
        return af * (1 + g / std::numbers::pi);
    };
    const double mean = af * (1 + (2.0 / 3.0 - 28 / (15 * std::numbers::pi)));
    const double single = 0.8 / std::numbers::pi * af * (1 + (1 - m * m) / m);
    const double color = 0.8 * 0.8 * mean / (1 - 0.8 * (1 - mean));
    const double several = color / std::numbers::pi * std::pow(1 - albedo(m), 2.0) / (1 - mean);
    CHECK(std::abs(rough - (single + several) * 10.0 * m) <= 0.03 * rough);
    CHECK(std::abs(shown(1.0f, 255) - rough) <= 0.02 * rough);
    CHECK(std::abs(shown(1.0f, 0) - lambert) <= 0.02 * lambert);
}

TEST_CASE("colours of pictures are encoded by sRGB's curve, and multiplied by those of vertices", "[principled]") {
    PrincipledMaterial material = unlit({0.5f, 1.0f, 1.0f});
    Scene scene = wall_of(material);
    material.base_color_texture = add_texture(scene, picture(1, 1, {10, 128, 250}), TextureFilter::nearest);
    scene.materials.back() = material_of(material);
    scene.meshes[0].colors.assign(4, {1.0f, 0.5f, 1.0f, 1.0f});
    const dvec3 expected = 255.0 * dvec3(0.5f * linear_of_srgb(10), 0.5f * linear_of_srgb(128), linear_of_srgb(250));
    for (const vec3& pixel : seen(scene, 1).pixels) CASTOR_CHECK_CLOSE(pixel, expected);

    material.is_unlit = false;  // what emits counts in planes of albedos
    scene.materials.back() = material_of(material);
    RenderOptions options;
    options.aovs = {"albedo", "mean-albedo"};
    const Film film = Renderer(scene, {test_device()}).render(square_camera({}, {0, 0, -1}, 0.5f, 4), options);
    for (const FilmPlane& plane : film.planes) {
        CAPTURE(plane.name);
        REQUIRE(plane.values.size() >= 3 * 16);
        for (int i = 0; i < 3; ++i) CHECK(std::abs(plane.values[i] - expected[i] / 255.0) <= 1e-6);
    }
}

TEST_CASE("a clear coat dims the emission below it, seen and found by rays to it", "[principled]") {
    PrincipledMaterial material;
    material.base_color = vec3(0.0f);
    material.specular = 0.0f;
    material.emissive = {1.0f, 0.5f, 0.0f};
    material.emissive_strength = 2.0f;
    const auto seen_of = [&] { return seen(wall_of(material), 1).pixels[0]; };
    CASTOR_CHECK_CLOSE(seen_of(), 255.0 * dvec3(2, 1, 0));
    material.clearcoat = 0.5f;
    CASTOR_CHECK_CLOSE(seen_of(), 0.98 * 255.0 * dvec3(2, 1, 0));
    CHECK(emission_of(material_of(material)).x == 255.0f * (1.0f - 0.04f * 0.5f) * 2.0f);
    material.is_unlit = true;
    CHECK(emission_of(material_of(material)) == vec3(0.0f));
}

TEST_CASE("one texel at random is the filtered picture in the mean", "[principled]") {
    // Black and white halves: u = 1/2 lies between the texels' middles, so that as many samples see each.
    PrincipledMaterial material = unlit(vec3(1.0f));
    Scene scene = wall_of(material);
    material.base_color_texture = add_texture(scene, picture(2, 1, {0, 0, 0, 255, 255, 255}), TextureFilter::bilinear);
    scene.textures.back().wrap = TextureWrap::clamp;
    scene.materials.back() = material_of(material);
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.samples_per_pixel = 256;
    for (const auto& [x, expected] : {std::pair(-0.75f, 0.0), {0.0f, 0.5}, {0.25f, 0.75}, {0.75f, 1.0}}) {
        CAPTURE(x);
        const Film film = renderer.render(square_camera({x, 0, 0}, {0, 0, -1}, 1e-3f, 4), options);
        CHECK(std::abs(estimate_of(film).mean - 255.0 * expected) <= 255.0 * 0.02);
    }
}

TEST_CASE("far pictures are seen by their smaller levels", "[principled]") {
    // A checkerboard of texels that are much smaller than a pixel: one sample a pixel gives its mean all the same.
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t i = 0; i < 256 * 256; ++i) bytes.insert(bytes.end(), 3, (i + i / 256) % 2 ? 255 : 0);
    PrincipledMaterial material = unlit(vec3(1.0f));
    Scene scene = wall_of(material);
    material.base_color_texture = add_texture(scene, picture(256, 256, bytes), TextureFilter::trilinear);
    scene.materials.back() = material_of(material);
    // 188 is the byte of the linear mean of black and white.
    for (const vec3& pixel : seen(scene, 1).pixels) CHECK(pixel.x == 255.0f * linear_of_srgb(188));
    // By each set of coordinates for itself: the same picture on the second, while the first hardly changes.
    Mesh& mesh = scene.meshes[0];
    mesh.texture_coordinates_1 = mesh.texture_coordinates;
    for (glm::vec2& uv : mesh.texture_coordinates) uv *= 1e-4f;
    scene.textures.back().coordinate_set = 1;
    for (const vec3& pixel : seen(scene, 1).pixels) CHECK(pixel.x == 255.0f * linear_of_srgb(188));
    // Of an instance 24 times as large a texel is larger than a pixel.
    scene.instances = {{0, Transform(24.0f), mesh.material}};
    scene.instances[0].transform[3].z = 23.1f;  // before the mesh itself
    const std::vector<vec3> near = seen(scene, 1).pixels;
    CHECK(
        std::all_of(near.begin(), near.end(), [](const vec3& pixel) { return pixel.x == 0.0f || pixel.x == 255.0f; }));
}

TEST_CASE("green of a normal map is up, red is to the right", "[principled]") {
    PrincipledMaterial material = matt(vec3(1.0f));
    Scene scene = wall_of(material);
    // Normals half-way to up and to the right.
    const std::uint32_t up = add_texture(scene, picture(1, 1, {128, 218, 218}), TextureFilter::nearest);
    const std::uint32_t right = add_texture(scene, picture(1, 1, {218, 128, 218}), TextureFilter::nearest);
    scene.lights = {directional_light({0, -1, -1}, vec3(1.0f))};
    const auto brightness = [&](std::optional<std::uint32_t> texture, const glm::vec4& tangent) {
        material.normal_texture = texture;
        scene.materials.back() = material_of(material);
        scene.meshes[0].tangents.assign(tangent == glm::vec4(0.0f) ? 0 : 4, tangent);
        return std::numbers::pi * seen(scene, 1, 2).pixels[0].x;
    };
    const double slope = std::sqrt(0.5);
    const glm::vec4 none(0.0f);
    CHECK(std::abs(brightness(std::nullopt, none) - slope) <= 1e-4);
    CHECK(std::abs(brightness(up, none) - 1.0) <= 0.005);
    CHECK(std::abs(brightness(right, none) - slope * slope) <= 0.01);
    // Given tangents: those above, the same turned, and the other hand.
    CHECK(std::abs(brightness(up, {1, 0, 0, 1}) - 1.0) <= 0.005);
    CHECK(std::abs(brightness(right, {0, 1, 0, 1}) - 1.0) <= 0.005);
    CHECK(std::abs(brightness(up, {1, 0, 0, -1})) <= 0.01);
    material.normal_scale = 0.0f;
    CHECK(std::abs(brightness(up, none) - slope) <= 1e-4);
}

TEST_CASE("a clear coat has a normal map of its own, or none", "[principled]") {
    // A black wall whose coat shows the ceiling, 255, where its normals are turned up by 30 degrees: there Schlick's
    // term for these is what it shows.
    PrincipledMaterial material = matt(vec3(0.0f));
    material.clearcoat = 1.0f;
    Scene scene = wall_of(material);
    const std::uint32_t wall = scene.meshes[0].material;
    const std::uint32_t up = add_texture(scene, picture(1, 1, {128, 191, 238}), TextureFilter::nearest);
    const std::uint32_t steeply_down = add_texture(scene, picture(1, 1, {128, 26, 204}), TextureFilter::nearest);
    scene.meshes.push_back(
        rectangle({0, 3, 0}, {9, 0, 0}, {0, 0, 9}, add_material(scene, material_of(unlit(vec3(1.0f))))));
    using Map = std::optional<std::uint32_t>;
    const auto shown = [&](const Map& base, const Map& coat, float scale) {
        material.normal_texture = base;
        material.clearcoat_normal_texture = coat;
        material.clearcoat_normal_scale = scale;
        scene.materials[wall] = material_of(material);
        RenderOptions options;
        options.samples_per_pixel = 16;
        return Renderer(scene, {test_device()}).render(square_camera({}, {0, 0, -1}, 1e-3f, 2), options).pixels[0].x /
               255.0;
    };
    const double ceiling = 0.04 + 0.96 * std::pow(1.0 - std::sqrt(0.75), 5.0);
    CHECK(std::abs(shown(std::nullopt, up, 1.0f) - ceiling) <= 1e-3);
    CHECK(std::abs(shown(up, up, 1.0f) - ceiling) <= 1e-3);
    CHECK(std::abs(shown(steeply_down, up, 1.0f) - ceiling) <= 1e-3);  // which is below the base's horizon
    CHECK(shown(up, std::nullopt, 1.0f) == 0.0);                       // the eye's own side, where there is nothing
    CHECK(shown(up, up, 0.0f) == 0.0);

    material.clearcoat_roughness = 0.1f;  // and by rays to a lamp above
    scene.meshes.pop_back();
    scene.lights.push_back(directional_light({0, -0.866f, -0.5f}, vec3(1.0f)));
    CHECK(shown(steeply_down, up, 1.0f) > 10 * shown(up, std::nullopt, 1.0f));
}

TEST_CASE("dispersive glass in white light is white, and each path has one channel behind it", "[principled]") {
    Scene scene = scene_in(1.0f);
    PrincipledMaterial material = glass(vec3(1.0f));
    material.dispersion = 2.0f;
    scene.spheres = {{{0, 0, -3}, 1.0f, add_material(scene, material_of(material)), 0}};
    Renderer renderer(scene, {test_device()});
    Camera camera = square_camera({}, {0, 0, -1}, 0.2f, 32);
    camera.path_tracing.emplace().samples_lights = false;
    camera.path_tracing->weighs = false;
    camera.path_tracing->bounces = 32;
    camera.path_tracing->roulette_from.reset();
    RenderOptions options;
    options.samples_per_pixel = 1;
    const Film film = renderer.render(camera, options);
    dvec3 sum(0.0);
    std::size_t pure = 0;
    for (const vec3& pixel : film.pixels) {
        sum += dvec3(pixel);
        const float largest = std::max({pixel.x, pixel.y, pixel.z}), whole = pixel.x + pixel.y + pixel.z;
        CAPTURE(pixel.x, pixel.y, pixel.z);
        if (largest < whole) {  // reflected: all channels, nearly alike
            CHECK(std::abs(whole - 3.0f) <= 0.2f);
        } else {
            CHECK(std::abs(whole - 3.0f) <= 1e-3f);
            ++pure;
        }
    }
    const double count = double(film.pixels.size());
    CHECK(pure > count / 2);
    // A channel is 3 with the probability 1/3, at most.
    for (int k = 0; k < 3; ++k) CHECK(std::abs(sum[k] / count - 1.0) <= 4.0 * std::sqrt(2.0 / count));
}

TEST_CASE("textures say where thin films are, and how thick", "[principled]") {
    PrincipledMaterial material;
    material.roughness = 0.0f;
    material.base_color = vec3(0.5f);
    material.iridescence = 1.0f;
    Scene scene = wall_of(material, 1.0f);
    const std::uint32_t wall = scene.meshes[0].material;
    const std::uint32_t green = add_texture(scene, picture(1, 1, {0, 255, 0}), TextureFilter::nearest),
                        red = add_texture(scene, picture(1, 1, {255, 0, 255}), TextureFilter::nearest);
    Camera camera = square_camera({}, {0, 0, -1}, 1e-3f, 1);
    const auto shown = [&](float least, float most, const std::optional<std::uint32_t>& share,
                           const std::optional<std::uint32_t>& thickness) {
        material.iridescence_thickness_minimum = least;
        material.iridescence_thickness_maximum = most;
        material.iridescence_texture = share;
        material.iridescence_thickness_texture = thickness;
        scene.materials[wall] = material_of(material);
        return Renderer(scene, {test_device()}).render(camera, {.samples_per_pixel = 1}).pixels[0];
    };
    const vec3 thin = shown(0, 250, std::nullopt, std::nullopt), thick = shown(0, 450, std::nullopt, std::nullopt);
    CHECK(glm::length(thin - thick) > 0.02f);
    CHECK(glm::length(thin - vec3(0.5f)) > 0.1f);
    CHECK(shown(250, 450, red, green) == thick);
    CHECK(glm::length(shown(250, 450, red, red) - thin) <= 1e-6f);
    CHECK(glm::length(shown(250, 450, green, green) - vec3(0.5f)) <= 1e-5f);
}

TEST_CASE("anisotropy lies along texture coordinates, also where there is no texture", "[principled]") {
    const auto shown = [](float rotation, bool has_texture) {
        PrincipledMaterial metal;
        metal.roughness = 0.3f;
        metal.anisotropy = 0.9f;
        metal.anisotropy_rotation_radians = rotation;
        Scene scene;
        scene.lights = {point_light({0, 0, 0}, vec3(10.0f))};
        scene.materials = {material_of(metal)};
        scene.meshes = {textured_rectangle({0, 0, -1}, {1, 0, 0}, {0, 1, 0}, 0)};
        if (has_texture) {
            PrincipledMaterial textured = matt(vec3(1.0f));
            textured.base_color_texture = add_texture(scene, picture(1, 1, {255, 255, 255}), TextureFilter::trilinear);
            scene.meshes.push_back(
                textured_rectangle({9, 0, -1}, {1, 0, 0}, {0, 1, 0}, add_material(scene, material_of(textured))));
        }
        return seen(scene, 16).pixels;
    };
    const float quarter = 1.57079633f;
    for (const float rotation : {0.0f, quarter}) CHECK(shown(rotation, false) == shown(rotation, true));
    // The highlight is wide across the scratches: rows of the picture there, columns here.
    const auto along = shown(0.0f, false), across = shown(quarter, false);
    const std::size_t left = 3 * 8 + 0, top = 0 * 8 + 3;
    CHECK(along[left].x / along[top].x > 2.0f);
    CHECK(across[top].x / across[left].x > 2.0f);
}

TEST_CASE("glass takes what its attenuation says", "[principled]") {
    // Through a slab 2 thick of index 1, (attenuation colour)^2 is left.
    Scene scene = scene_in(3.0f);
    PrincipledMaterial material = glass({0.5f, 1.0f, 0.1f});
    material.ior = 1.0f;
    const std::uint32_t number = add_material(scene, material_of(material));
    scene.shadow_ray_epsilon = 1e-6f;
    scene.meshes = {rectangle({0, 0, -1}, {9, 0, 0}, {0, 9, 0}, number),
                    rectangle({0, 0, -3}, {0, 9, 0}, {9, 0, 0}, number)};
    dvec3 expected(3.0 * 0.25, 3.0, 3.0 * 0.01);
    SECTION("alone") {}
    SECTION("with a pane within") {
        material.thickness = 0.0f;
        material.base_color = {0.5f, 0.25f, 1.0f};
        scene.meshes.push_back(
            rectangle({0, 0, -1.7f}, {9, 0, 0}, {0, 9, 0}, add_material(scene, material_of(material))));
        expected *= dvec3(0.5, 0.25, 1.0);
    }
    const vec3 found = seen(scene, 1, 1).pixels[0];
    for (int i = 0; i < 3; ++i) CHECK(std::abs(found[i] - expected[i]) <= 1e-4 * expected[i]);
}

TEST_CASE("an eye within solids sees all through what is left of the light", "[principled]") {
    // Something that shines, in a ball of glass in a ball of glass, and panes and other things on the way.
    Scene scene = scene_in(0.0f);
    PrincipledMaterial inner = glass({0.5f, 1.0f, 0.1f}), outer = glass({0.8f, 0.2f, 0.3f}), lamp = matt(vec3(0.0f));
    inner.ior = outer.ior = 1.0f;
    lamp.emissive = vec3(3.0f);
    const std::uint32_t of_inner = add_material(scene, material_of(inner)),
                        of_outer = add_material(scene, material_of(outer)),
                        of_lamp = add_material(scene, material_of(lamp));
    scene.shadow_ray_epsilon = 1e-6f;
    Camera camera = square_camera({0, 0, 0.5f}, {0, 0, -1}, 1e-3f, 8);
    camera.path_tracing.emplace().samples_lights = false;
    camera.path_tracing->weighs = false;
    scene.meshes = {rectangle({0, 0, -4}, {9, 0, 0}, {0, 9, 0}, of_lamp)};
    scene.spheres = {{{0, 0, 0}, 2.0f, of_inner, 0}, {{0, 0, 0}, 8.0f, of_outer, 0}};
    float in_inner = 2.5f, in_outer = 2.0f;
    SECTION("through a pinhole") {}
    SECTION("through a lens") {
        camera.aperture_size = 1e-3f;
        camera.focus_distance = 4.0f;
    }
    SECTION("with parallel rays") {
        camera.is_orthographic = true;
    }
    SECTION("with the lamp in the inner one") {
        scene.meshes[0] = rectangle({0, 0, -1}, {0.5f, 0, 0}, {0, 0.5f, 0}, of_lamp);
        in_inner = 1.5f;
        in_outer = 0.0f;
    }
    SECTION("beyond a hole in the inner one, alone") {  // a solid within it, of index 1 and clear
        PrincipledMaterial clear = glass(vec3(1.0f));
        clear.ior = 1.0f;
        scene.spheres[1] = {{0, 0, -0.5f}, 0.25f, add_material(scene, material_of(clear)), 0};
        in_inner = 2.0f;
        in_outer = 0.0f;
    }
    SECTION("in the inner one alone") {
        scene.spheres.pop_back();
        in_outer = 0.0f;
    }
    SECTION("in the outer one alone, before the inner one") {
        camera.position.z = 3.0f;
        in_inner = 4.0f;
        in_outer = 3.0f;
    }
    SECTION("moving") {
        for (Sphere& sphere : scene.spheres) sphere.motion = {1e-3f, 0, 0};
    }
    RenderOptions options;
    options.samples_per_pixel = 4;
    const Film found = Renderer(scene, {test_device()}).render(camera, options);
    for (int i = 0; i < 3; ++i) {
        const double expected = 255.0 * 3.0 * std::pow(double{inner.attenuation_color[i]}, double{in_inner}) *
                                std::pow(double{outer.attenuation_color[i]}, double{in_outer});
        CAPTURE(i, found.pixels[27][i], expected);
        CHECK(std::abs(found.pixels[27][i] - expected) <= 1e-3 * expected);
    }
}

TEST_CASE("lights that no ray meets shine through solids of index 1, by what these leave", "[principled]") {
    // A matt wall, and the share that arrives through balls of it, seen from within or from outside.
    const auto [name, light, from] = GENERATE(table<const char*, Light, vec3>(
        {{"sun", directional_light({1, 2, -5}, vec3(9.0f)), vec3(-1, -2, 5) * 1e6f},
         {"point", point_light({-1, -2, 5}, vec3(90.0f)), vec3(-1, -2, 5)},
         {"point within", point_light({-0.2f, 0.1f, 0.5f}, vec3(90.0f)), vec3(-0.2f, 0.1f, 0.5f)}}));
    Scene scene = scene_in(0.0f);
    const std::uint32_t wall = add_material(scene, material_of(matt(vec3(0.5f))));
    PrincipledMaterial inner = glass({0.5f, 1.0f, 0.1f}), outer = glass({0.8f, 0.2f, 0.3f});
    inner.ior = outer.ior = 1.0f;
    scene.meshes = {rectangle({0, 0, 0}, {9, 0, 0}, {0, 9, 0}, wall)};
    scene.lights.push_back(light);
    scene.shadow_ray_epsilon = 1e-6f;
    Camera camera = square_camera({0, 0, 0.3f}, {0, 0, -1}, 1e-4f, 8);
    RenderOptions options;
    options.samples_per_pixel = 2048;
    const auto shown = [&] {
        vec3 sum(0.0f);
        for (const vec3& pixel : Renderer(scene, {test_device()}).render(camera, options).pixels) sum += pixel;
        return sum;
    };
    const vec3 plain = shown();
    const auto through = [&](const PrincipledMaterial& material, double length) {
        dvec3 left;
        for (int i = 0; i < 3; ++i) left[i] = std::pow(double{material.attenuation_color[i]}, length);
        return left;
    };
    const double distance = glm::length(dvec3(from));
    const auto within = [&](double radius) { return std::min(distance, radius); };
    dvec3 expected(1.0);
    SECTION("one") {
        scene.spheres = {{{0, 0, 0}, 1.0f, add_material(scene, material_of(inner)), 0}};
        expected = through(inner, within(1.0) + 0.3);  // and on the way to the eye
    }
    SECTION("one in another, and the eye outside") {
        camera.position.z = 3.0f;
        scene.spheres = {{{0, 0, 0}, 1.0f, add_material(scene, material_of(inner)), 0},
                         {{0, 0, 0}, 2.0f, add_material(scene, material_of(outer)), 0}};
        expected = through(inner, within(1.0) + 1.0) * through(outer, within(2.0) - within(1.0) + 1.0);
    }
    SECTION("one behind a veil that is not there") {
        PrincipledMaterial veil = matt(vec3(1.0f));
        veil.alpha_mode = AlphaMode::blend;
        veil.alpha = 0.0f;
        scene.spheres = {{{0, 0, 0}, 1.0f, add_material(scene, material_of(inner)), 0},
                         {{0, 0, 0}, 0.4f, add_material(scene, material_of(veil)), 0},
                         {{0, 0, 0}, 1.4f, add_material(scene, material_of(veil)), 0}};
        expected = through(inner, within(1.0) + 0.3);
    }
    SECTION("none of another index") {
        inner.ior = 1.01f;
        scene.spheres = {{{0, 0, 0}, 1.0f, add_material(scene, material_of(inner)), 0}};
        expected = distance < 1.0 ? through(inner, within(1.0) + 0.3) : dvec3(0.0);
    }
    const vec3 found = shown();
    for (int i = 0; i < 3; ++i) {
        CAPTURE(name, i, found[i], plain[i], expected[i]);
        CHECK(std::abs(found[i] - plain[i] * expected[i]) <= 0.02 * plain[i] * expected[i]);
    }
}

TEST_CASE("what passes a surface without direction is absorbed within", "[principled]") {
    // A ball that lets all light through, and hardly any of the red and green on its way.
    Scene scene = scene_in(3.0f);
    PrincipledMaterial material = matt(vec3(0.0f));
    material.diffuse_transmission = 1.0f;
    material.diffuse_transmission_color = vec3(1.0f);
    const auto shown = [&](float thickness) {
        material.thickness = thickness;
        material.attenuation_color = {0.1f, 0.5f, 1.0f};
        material.attenuation_distance = 0.01f;
        scene.materials.resize(3);
        const std::uint32_t number = add_material(scene, material_of(material));
        scene.spheres = {{{0, 0, -3}, 2.8f, number, 0}};  // fills the view
        return seen(scene, 64, 1).pixels[0];
    };
    const vec3 of_wall = shown(0.0f), of_solid = shown(1.0f);
    for (int i = 0; i < 3; ++i) CHECK(std::abs(of_wall[i] - 3.0f) <= 0.01f);
    CHECK(of_solid.x <= 0.003f);
    CHECK(of_solid.y <= 0.03f);
    CHECK(std::abs(of_solid.z - 3.0f) <= 0.01f);
}

TEST_CASE("alpha is the share of a surface that is there, for shadow rays too", "[principled]") {
    PrincipledMaterial veil = unlit({0, 0, 0});
    veil.alpha = 0.25f;
    veil.alpha_mode = AlphaMode::blend;
    Scene scene = scene_in(4.0f);
    const std::uint32_t number = add_material(scene, material_of(veil));
    constexpr int kVeils = 3;
    for (int i = 0; i < kVeils; ++i)
        scene.meshes.push_back(textured_rectangle({0, 0, -1.0f - 0.1f * i}, {2, 0, 0}, {0, 2, 0}, number));
    check_mean(estimate_of(seen(scene, 512)), 4.0 * std::pow(0.75, kVeils));

    SECTION("sixteen samples of a pixel pass two veils as often as these say") {
        scene.meshes.resize(2);
        for (const vec3& pixel : seen(scene, 16).pixels) CHECK(std::abs(pixel.x - 4.0 * 9 / 16) <= 1e-5);
    }
    SECTION("a floor behind a veil, in the light of a lamp that no ray meets") {
        scene.lights = {directional_light({0, 0, -1}, vec3(5.0f))};
        scene.meshes.push_back(
            rectangle({0, 0, -3}, {9, 0, 0}, {0, 9, 0}, add_material(scene, material_of(matt(vec3(0.5f))))));
        check_mean(estimate_of(seen(scene, 2048)), 0.5 * 5.0 / std::numbers::pi * std::pow(0.75, 2 * kVeils));
    }
    SECTION("a mask") {
        veil.alpha_mode = AlphaMode::mask;
        for (const auto& [cutoff, expected] : {std::pair(0.3f, 4.0f), {0.25f, 0.0f}}) {
            CAPTURE(cutoff);
            veil.alpha_cutoff = cutoff;
            scene.materials[number] = material_of(veil);
            for (const vec3& pixel : seen(scene, 1).pixels) CHECK(pixel.x == expected);
        }
    }
    SECTION("of a picture and of vertices") {
        veil.alpha = 1.0f;
        veil.base_color_texture = add_texture(scene, picture(1, 1, {0, 0, 0}, {128}), TextureFilter::bilinear);
        scene.materials[number] = material_of(veil);
        scene.meshes.resize(1);
        scene.meshes[0].colors.assign(4, {1, 1, 1, 0.5f});
        check_mean(estimate_of(seen(scene, 256)), 4.0 * (1.0 - 0.5 * 128 / 255));
    }
    SECTION("no more than the surface says") {
        veil.alpha_mode = AlphaMode::opaque;
        scene.materials[number] = material_of(veil);
        for (const vec3& pixel : seen(scene, 1).pixels) CHECK(pixel.x == 0.0f);
    }
}

TEST_CASE("rays pass thousands of surfaces that are not there, and none beyond, which is told", "[principled]") {
    constexpr int kMost = 4096;
    PrincipledMaterial veil = unlit({0, 0, 0});
    veil.alpha_mode = AlphaMode::mask;
    veil.alpha = 0.25f;
    Scene scene = scene_in(0.0f);
    const std::uint32_t number = add_material(scene, material_of(veil));
    const std::uint32_t wall = add_material(scene, material_of(unlit(vec3(0.5f))));
    const std::uint32_t floor = add_material(scene, material_of(matt(vec3(0.5f))));
    const auto add_veils = [&](int count, float nearest) {
        Mesh veils;
        veils.material = number;
        for (int i = 0; i < count; ++i) {
            const Mesh one = rectangle({0, 0, nearest + float(i) / kMost}, {2, 0, 0}, {0, 2, 0}, number);
            for (const glm::uvec3& triangle : one.triangles)
                veils.triangles.push_back(triangle + glm::uvec3(static_cast<std::uint32_t>(veils.positions.size())));
            veils.positions.insert(veils.positions.end(), one.positions.begin(), one.positions.end());
        }
        scene.meshes.push_back(veils);
    };
    const auto check = [&](double expected, bool is_told) {
        Renderer renderer(scene, {test_device()});
        RenderOptions options;
        options.samples_per_pixel = 1;
        options.bounces = 1;
        const Film film = renderer.render(square_camera({}, {0, 0, -1}, 0.5f, 8), options);
        for (const vec3& pixel : film.pixels) CHECK(std::abs(pixel.x - expected) <= 1e-5 * expected);
        const std::vector<std::string> notices = renderer.statistics().notices;
        REQUIRE(notices.size() == (is_told ? 1 : 0));
        if (is_told) CHECK_THAT(notices[0], Catch::StartsWith("more than 4096 surfaces that rays pass"));
    };
    const int count = GENERATE(100, 4096, 4097);
    const bool is_stopped = count > kMost;
    CAPTURE(count);
    SECTION("between the eye and a wall") {
        add_veils(count, -2.0f);
        scene.meshes.push_back(rectangle({0, 0, -3}, {9, 0, 0}, {0, 9, 0}, wall));
        check(is_stopped ? 0.0 : 127.5, is_stopped);
    }
    SECTION("between a floor and a light") {
        add_veils(count, 1.0f);  // behind the eye
        scene.lights = {directional_light({0, 0, -1}, vec3(5.0f))};
        scene.meshes.push_back(rectangle({0, 0, -3}, {9, 0, 0}, {0, 9, 0}, floor));
        check(is_stopped ? 0.0 : 0.5 * 5.0 / std::numbers::pi, is_stopped);
        scene.meshes.push_back(rectangle({0, 0, 3}, {9, 0, 0}, {0, 9, 0}, floor));
        check(0.0, is_stopped);
    }
}

TEST_CASE("kernels know thin films, dispersion and normals of coats where a scene has them", "[principled]") {
    const auto has_optics = [](void (*change)(PrincipledMaterial&)) {
        Scene scene;
        scene.images = {picture(1, 1, {0, 0, 0})};
        for (int i = 0; i < 2; ++i) scene.textures.emplace_back().target = TextureTarget::principled;
        PrincipledMaterial material = matt(vec3(0.5f));
        material.clearcoat = 1.0f;
        change(material);
        scene.materials = {material_of(material)};
        return features_of(flatten(scene)).has_optics;
    };
    using M = PrincipledMaterial;
    CHECK_FALSE(has_optics([](M&) {}));
    CHECK_FALSE(has_optics([](M& m) { m.normal_scale = 2.0f; }));
    CHECK_FALSE(has_optics([](M& m) { m.normal_texture = m.clearcoat_normal_texture = 1; }));
    CHECK_FALSE(has_optics([](M& m) { m.normal_texture = 1, m.clearcoat = 0.0f; }));
    CHECK(has_optics([](M& m) { m.normal_texture = 1; }));
    CHECK(has_optics([](M& m) { m.clearcoat_normal_texture = 1; }));
    CHECK(has_optics([](M& m) { m.normal_texture = 0, m.clearcoat_normal_texture = 1; }));
    CHECK(has_optics([](M& m) { m.normal_texture = m.clearcoat_normal_texture = 1, m.clearcoat_normal_scale = 2.0f; }));
    CHECK(has_optics([](M& m) { m.iridescence = 0.5f; }));
    CHECK(has_optics([](M& m) { m.dispersion = 0.5f; }));
}

TEST_CASE("principled materials that are none are refused", "[principled]") {
    struct Fault {
        const char* message;
        void (*make)(PrincipledMaterial&);
    };
    constexpr Fault kFaults[] = {
        {"metallic is 1.5", [](PrincipledMaterial& m) { m.metallic = 1.5f; }},
        {"roughness is nan", [](PrincipledMaterial& m) { m.roughness = std::nanf(""); }},
        {"base colour is (0.5, -1, 0.5), expected numbers from 0 to 1",
         [](PrincipledMaterial& m) { m.base_color.y = -1.0f; }},
        {"base colour is (0.5, 1.5, 0.5)", [](PrincipledMaterial& m) { m.base_color.y = 1.5f; }},
        {"sheen colour is (0, 0, nan)", [](PrincipledMaterial& m) { m.sheen_color.z = std::nanf(""); }},
        {"sheen colour is (2, 0, 0)", [](PrincipledMaterial& m) { m.sheen_color.x = 2.0f; }},
        {"diffuse transmission colour", [](PrincipledMaterial& m) { m.diffuse_transmission_color.x = 1.5f; }},
        {"attenuation colour", [](PrincipledMaterial& m) { m.attenuation_color.z = 1.5f; }},
        {"the refraction index is 0.5", [](PrincipledMaterial& m) { m.ior = 0.5f; }},
        {"diffuse roughness is 2", [](PrincipledMaterial& m) { m.diffuse_roughness = 2.0f; }},
        {"the attenuation distance is 0", [](PrincipledMaterial& m) { m.attenuation_distance = 0.0f; }},
        {"iridescence is -1", [](PrincipledMaterial& m) { m.iridescence = -1.0f; }},
        {"the iridescence's refraction index is 0.5", [](PrincipledMaterial& m) { m.iridescence_ior = 0.5f; }},
        {"thickness maximum", [](PrincipledMaterial& m) { m.iridescence_thickness_maximum = std::nanf(""); }},
        {"emission times its strength", [](PrincipledMaterial& m) { m.emissive = vec3(m.emissive_strength = 1e30f); }},
        {"texture index 9", [](PrincipledMaterial& m) { m.normal_texture = 9; }},
        {"texture 1 has an image of floats", [](PrincipledMaterial& m) { m.normal_texture = 1; }},
        {"texture 2 is not for principled materials", [](PrincipledMaterial& m) { m.normal_texture = 2; }},
    };
    for (const Fault& fault : kFaults) {
        CAPTURE(fault.message);
        PrincipledMaterial material = matt(vec3(0.5f));
        fault.make(material);
        Scene scene = wall_of(material);
        Image floats{"", 1, 1};
        floats.floats = {1, 1, 1};
        add_texture(scene, floats, TextureFilter::nearest);
        scene.textures.push_back(scene.textures.front());
        scene.textures.back().target = TextureTarget::replace_diffuse;
        CHECK_THROWS_WITH(Renderer(scene, {test_device()}), Catch::Contains(fault.message));
    }
}

TEST_CASE("principled materials are not for the course's integrator", "[principled]") {
    const Scene scene = wall_of(matt(vec3(0.5f)));
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.integrator = Integrator::whitted;
    CHECK_THROWS_AS(renderer.render(square_camera({}, {0, 0, -1}, 1.0f, 2), options), UsageError);
}

TEST_CASE("pictures of principled materials have the same bytes however the work is done", "[principled]") {
    const Scene scene = busy_principled_scene();
    const Camera& camera = scene.cameras[0];
    const Device device = test_device();
    RenderOptions options;
    options.samples_per_pixel = 3;
    Renderer renderer(scene, {device});
    const Film expected = renderer.render(camera, options);
    REQUIRE(all_finite(expected));
    check_every_way(scene, options, expected);
    CHECK(same_bytes(Renderer(scene, {with_little_memory(10 << 10)}).render(camera, options), expected));
}

TEST_CASE("a picture of principled materials does not tell that ranks divide the scene",
          "[principled][remote][chunks]") {
    const Scene scene = busy_principled_scene();
    RenderOptions options;
    options.samples_per_pixel = 3;
    options.aovs = {"albedo"};
    options.tile_size = 16;
    const Film expected = Renderer(scene, {test_device()}).render(scene.cameras[0], options);
    check_divided(scene, Strategy::wide, 3, options, expected, 10 << 10);
}

}  // namespace castor::test
