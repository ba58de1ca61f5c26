#include "scene/gltf_reader.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "scene/gltf_uri.h"
#include "scene/principled.h"
#include "scene/scene_arrays.h"
#include "support/catch.h"
#include "support/gltf_builder.h"
#include "support/picture_bytes.h"
#include "support/temporary_directory.h"

namespace castor {
namespace {

using nlohmann::json;
using test::GltfBuilder;
using test::one_triangle;
using test::TemporaryDirectory;

Scene read_text(const std::string& text, std::optional<double> time = std::nullopt,
                std::optional<std::string> animation = std::nullopt) {
    const TemporaryDirectory directory;
    LoadOptions options;
    options.time_seconds = time;
    options.animation = std::move(animation);
    return read_gltf(directory.write("scene.gltf", text), {}, options);
}

Scene read(GltfBuilder builder, std::optional<double> time = std::nullopt) {
    return read_text(builder.gltf(), time);
}

/// The message with which the file is refused, without the file's name; empty where it is read.
std::string refusal_of_text(const std::string& text, std::optional<double> time = std::nullopt) {
    try {
        read_text(text, time);
    } catch (const SceneError& error) {
        return error.reason();
    }
    return "";
}

std::string refusal(GltfBuilder builder, std::optional<double> time = std::nullopt) {
    return refusal_of_text(builder.gltf(), time);
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

json& primitive(GltfBuilder& builder) {
    return builder.json["meshes"][0]["primitives"][0];
}

bool is_near(const glm::vec3& a, const glm::vec3& b, float tolerance = 1e-5f) {
    return std::abs(a.x - b.x) <= tolerance && std::abs(a.y - b.y) <= tolerance && std::abs(a.z - b.z) <= tolerance;
}

/// A file of one textured triangle whose material says what is given.
GltfBuilder with_material(const json& material, const char* extension = nullptr) {
    GltfBuilder builder = one_triangle();
    primitive(builder)["attributes"]["TEXCOORD_0"] = builder.vec2({0, 0, 1, 0, 0, 1});
    primitive(builder)["material"] = 0;
    builder.json["materials"] = {material};
    builder.texture(test::png_bytes(2, 1, 4, {10, 20, 30, 255, 40, 50, 60, 128}));
    if (extension) builder.json["extensionsRequired"] = {extension};
    return builder;
}

PrincipledMaterial material_of(GltfBuilder builder) {
    return read(std::move(builder)).materials.at(0).principled.value();
}

TEST_CASE("A glTF triangle is a flat mesh with a principled material, in .gltf and in .glb", "[gltf]") {
    const TemporaryDirectory directory;
    GltfBuilder builder = one_triangle();
    for (const auto& [name, text] : {std::pair{"a.gltf", builder.gltf()}, std::pair{"a.glb", builder.glb()},
                                     std::pair{"no_name", builder.glb()}}) {
        CAPTURE(name);
        const Scene scene = read_gltf(directory.write(name, text));
        REQUIRE(scene.meshes.size() == 1);
        const Mesh& mesh = scene.meshes[0];
        CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        CHECK(mesh.triangles == std::vector<glm::uvec3>{{0, 1, 2}});
        CHECK(mesh.normals.empty());
        CHECK(mesh.transform == Transform(1.0f));
        REQUIRE(scene.materials.size() == 1);
        CHECK(scene.materials[0].principled->base_color == glm::vec3(1.0f));
        CHECK(scene.materials[0].principled->metallic == 1.0f);
        CHECK(scene.cameras.empty());
        CHECK(scene.lights.empty());
        CHECK(scene.warnings.empty());
    }
    CHECK(load_scene(directory.write("named.dat", builder.glb())).meshes.size() == 1);
}

TEST_CASE("Strips, fans and indexed triangles of glTF keep their winding, and only used vertices", "[gltf]") {
    for (const int mode : {4, 5, 6}) {
        for (const bool is_indexed : {false, true}) {
            CAPTURE(mode, is_indexed);
            GltfBuilder builder = one_triangle();
            const std::size_t positions =
                builder.vec3({9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 2, 0, 3, 3, 3, 8, 8, 8});
            primitive(builder) = {{"attributes", {{"POSITION", positions}}}, {"mode", mode}};
            if (is_indexed) primitive(builder)["indices"] = builder.indices({1, 2, 3, 4, 5, 6});
            const Scene scene = read(builder);
            const Mesh& mesh = scene.meshes.at(0);
            std::vector<glm::uvec3> expected;
            if (mode == 4) expected = {{0, 1, 2}, {3, 4, 5}};
            if (mode == 5) expected = {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}};
            if (mode == 6) expected = {{1, 2, 0}, {2, 3, 0}, {3, 4, 0}, {4, 5, 0}};
            if (!is_indexed && mode == 5) expected.insert(expected.end(), {{4, 5, 6}, {5, 7, 6}});
            if (!is_indexed && mode == 6) expected.insert(expected.end(), {{5, 6, 0}, {6, 7, 0}});
            CHECK(mesh.triangles == expected);
            CHECK(mesh.positions.front() == (is_indexed ? glm::vec3(0) : glm::vec3(9)));
            CHECK(mesh.positions.size() == (is_indexed || mode == 4 ? 6 : 8));
        }
    }
}

TEST_CASE("Points and lines of glTF are told and left out", "[gltf]") {
    GltfBuilder builder = one_triangle();
    builder.json["meshes"][0]["primitives"].push_back(primitive(builder));
    builder.json["meshes"][0]["primitives"][1]["mode"] = 1;
    const Scene scene = read(builder);
    CHECK(scene.meshes.size() == 1);
    REQUIRE(scene.warnings.size() == 1);
    CHECK(contains(scene.warnings[0].text, "meshes[0].primitives[1]: points and lines"));
}

TEST_CASE("glTF attributes may be quantised, normalised, strided and sparse", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json& attributes = primitive(builder)["attributes"];
    attributes["NORMAL"] =
        builder.accessor(std::vector<std::int8_t>{0, 0, 127, 0, 0, 0, -127, 0, 0, 127, 0, 0}, "VEC3", 4, 5120);
    builder.json["bufferViews"].back()["byteStride"] = 4;
    builder.json["accessors"].back()["normalized"] = true;
    attributes["TEXCOORD_0"] =
        builder.accessor(std::vector<std::uint16_t>{0, 65535, 65535, 0, 13107, 0}, "VEC2", 2, 5123);
    builder.json["accessors"].back()["normalized"] = true;
    attributes["TEXCOORD_1"] = builder.vec2({1, 2, 3, 4, 5, 6});
    attributes["COLOR_0"] =
        builder.accessor(std::vector<std::uint8_t>{255, 0, 51, 102, 0, 0, 0, 0, 0, 0, 0, 255}, "VEC4", 4, 5121);
    builder.json["accessors"].back()["normalized"] = true;
    // Integers that are not normalised are coordinates themselves; of the third vertex, a sparse part has others.
    attributes["POSITION"] =
        builder.accessor(std::vector<std::int16_t>{0, 0, 0, 0, 100, 0, -5, 0, 0, 1, 0, 0}, "VEC3", 4, 5122);
    builder.json["bufferViews"].back()["byteStride"] = 8;
    const std::size_t numbers = builder.view(std::vector<std::uint8_t>{2});
    const std::size_t values = builder.view(std::vector<std::int16_t>{7, 8, 9});
    builder.json["accessors"].back()["sparse"] = {{"count", 1},
                                                  {"indices", {{"bufferView", numbers}, {"componentType", 5121}}},
                                                  {"values", {{"bufferView", values}}}};
    const Scene scene = read(builder);
    const Mesh& mesh = scene.meshes.at(0);
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {100, 0, -5}, {7, 8, 9}});
    CHECK(mesh.normals == std::vector<glm::vec3>{{0, 0, 1}, {0, 0, -1}, {0, 1, 0}});
    CHECK(mesh.texture_coordinates == std::vector<glm::vec2>{{0, 1}, {1, 0}, {0.2f, 0}});
    CHECK(mesh.texture_coordinates_1 == std::vector<glm::vec2>{{1, 2}, {3, 4}, {5, 6}});
    CHECK(mesh.colors == std::vector<glm::vec4>{{1, 0, 0.2f, 0.4f}, {0, 0, 0, 0}, {0, 0, 0, 1}});
}

TEST_CASE("glTF nodes multiply their transforms, and meshes that they share are instances", "[gltf]") {
    GltfBuilder builder = one_triangle();
    const double h = std::sqrt(0.5);
    builder.json["nodes"] = {{{"children", {1, 2}}, {"translation", {1, 2, 3}}, {"rotation", {0, 0, h, h}}},
                             {{"mesh", 0}, {"scale", {2, 1, 1}}},
                             {{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1}}},
                             {{"mesh", 0}}};  // which the scene does not show
    const Scene scene = read(builder);
    REQUIRE(scene.meshes.size() == 1);
    REQUIRE(scene.instances.size() == 1);
    CHECK(scene.instances[0].mesh == 0);
    // A quarter turn about z takes x to y.
    const Transform& first = scene.meshes[0].transform;
    CHECK(is_near(first[0], {0, 2, 0}));
    CHECK(is_near(first[1], {-1, 0, 0}));
    CHECK(is_near(first[3], {1, 2, 3}));
    CHECK(is_near(scene.instances[0].transform[3], {1, 7, 3}));
    CHECK(is_near(scene.instances[0].transform[0], {0, 1, 0}));
}

TEST_CASE("EXT_mesh_gpu_instancing places a glTF mesh many times", "[gltf]") {
    GltfBuilder builder = one_triangle();
    const std::size_t places = builder.vec3({1, 0, 0, 2, 0, 0, 3, 0, 0});
    builder.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    builder.json["nodes"][0]["translation"] = {0, 10, 0};
    builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = places;
    const Scene scene = read(builder);
    CHECK(scene.meshes.at(0).transform[3] == glm::vec3(1, 10, 0));
    REQUIRE(scene.instances.size() == 2);
    CHECK(scene.instances[1].transform[3] == glm::vec3(3, 10, 0));
}

TEST_CASE("glTF morph targets and skins bend meshes, at rest and at a time", "[gltf]") {
    GltfBuilder builder = one_triangle();
    primitive(builder)["targets"] = {{{"POSITION", builder.vec3({0, 0, 1, 0, 0, 2, 0, 0, 3})}}};
    builder.json["meshes"][0]["weights"] = {0.5};
    CHECK(read(builder).meshes.at(0).positions[2] == glm::vec3(0, 1, 1.5f));
    builder.json["nodes"][0]["weights"] = {-1};
    CHECK(read(builder).meshes.at(0).positions[2] == glm::vec3(0, 1, -3));
    const std::size_t times = builder.scalars({1, 2}), weights = builder.scalars({0, 1});
    const auto animate = [&](const char* path, std::size_t input, std::size_t output, const char* interpolation) {
        builder.json["animations"] = {
            {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}}},
             {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}}}};
    };
    animate("weights", times, weights, "LINEAR");
    CHECK(read(builder, 1.25).meshes.at(0).positions[2] == glm::vec3(0, 1, 0.75f));
    CHECK(read(builder, 9.0).meshes.at(0).positions[2] == glm::vec3(0, 1, 3));
    animate("weights", times, weights, "STEP");
    CHECK(read(builder, 1.75).meshes.at(0).positions[2] == glm::vec3(0, 1, 0));
    // Of the spline, tangents of zero make 3 t^2 - 2 t^3.
    animate("weights", times, builder.scalars({0, 0, 0, 0, 1, 0}), "CUBICSPLINE");
    CHECK(is_near(read(builder, 1.25).meshes.at(0).positions[2], {0, 1, 3 * 0.15625f}));
    CHECK(read(builder, 1.25).warnings.empty());
    animate("weights", builder.scalars({2, 1}), weights, "LINEAR");
    const Scene backwards = read(builder, 1.25);
    REQUIRE(backwards.warnings.size() == 1);
    CHECK(backwards.warnings[0].text == "animations[0].samplers[0]: the times of its keyframes do not increase");
    // A turn is followed on the sphere.
    const double h = std::sqrt(0.5);
    animate("rotation", times, builder.vec4({0, 0, 0, 1, 0, 0, static_cast<float>(h), static_cast<float>(h)}),
            "LINEAR");
    const Scene turned = read(builder, 1.5);
    CHECK(is_near(turned.meshes.at(0).transform[0], {static_cast<float>(h), static_cast<float>(h), 0}));
}

TEST_CASE("Animations of glTF are chosen by number or name, or apply all together", "[gltf]") {
    GltfBuilder builder = one_triangle();
    builder.json["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, -4}}});
    builder.json["scenes"][0]["nodes"] = {0, 1};
    const std::size_t times = builder.scalars({0, 2});
    const auto add = [&](const char* name, std::size_t node, float x) {
        json animation = {{"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", "translation"}}}}}},
                          {"samplers", {{{"input", times}, {"output", builder.vec3({0, 0, 0, x, 0, 0})}}}}};
        if (name) animation["name"] = name;
        builder.json["animations"].push_back(animation);
    };
    add("First", 0, 8);
    add("Second", 1, 16);
    add(nullptr, 0, 24);
    add("Second", 0, 32);
    add("4", 1, 40);
    add("9", 1, 48);
    using Places = std::array<float, 2>;
    const auto places = [&](std::optional<std::string> which, std::size_t warnings = 0) {
        const Scene scene = read_text(builder.gltf(), 0.5, std::move(which));
        CHECK(scene.warnings.size() == warnings);
        REQUIRE(scene.instances.size() == 1);
        return Places{scene.meshes.at(0).transform[3].x, scene.instances[0].transform[3].x};
    };
    CHECK(places(std::nullopt, 1) == Places{2, 0});  // with a word on the others
    CHECK(places("1") == Places{2, 0});
    CHECK(places("First") == Places{2, 0});
    CHECK(places("3") == Places{6, 0});
    CHECK(places("Second") == Places{8, 4});
    CHECK(places("4") == Places{8, 0});  // a number that there is, and no name
    CHECK(places("9") == Places{0, 12});
    CHECK(places("all") == Places{8, 12});

    const auto refusal_of = [&](const std::string& which) -> std::string {
        try {
            read_text(builder.gltf(), 0.5, which);
        } catch (const UsageError& error) {
            return error.what();
        }
        return "";
    };
    for (const char* which : {"0", "7", "-1", "1 ", "first", "", "18446744073709551617"})
        CHECK(contains(refusal_of(which), "there is no animation \"" + std::string(which) +
                                              "\": expected \"all\", a number from 1 to 6, or one of \"First\", "
                                              "\"Second\", \"4\", \"9\""));
    for (int i = 0; i < 8; ++i) add(("Name " + std::to_string(i)).c_str(), 0, 8);
    CHECK(contains(refusal_of("first"), "a number from 1 to 14, or one of \"First\", "));
    CHECK(contains(refusal_of("first"), "\"Name 5\" and 2 more"));
    builder.json["animations"] = {builder.json["animations"][2]};
    CHECK(contains(refusal_of("First"), "expected \"all\", a number from 1 to 1; none has a name"));
    builder.json.erase("animations");
    CHECK(contains(refusal_of("1"), "there is no animation \"1\": the file has none"));
    CHECK(places("all", 1) == Places{0, 0});
}

TEST_CASE("KHR_animation_pointer moves what it names in a glTF file", "[gltf]") {
    GltfBuilder builder = with_material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    builder.json["extensionsRequired"] = {"KHR_animation_pointer"};
    builder.json["nodes"].push_back({{"mesh", 0}, {"rotation", {0, 0, 0, 1}}});
    builder.json["nodes"].push_back({{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    builder.json["scenes"] = {{{"nodes", {0, 1, 2}}}};
    builder.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    const std::size_t times = builder.scalars({0, 2});
    const auto add = [&](const std::string& pointer, std::size_t values, const char* interpolation = "LINEAR") {
        json& animation = builder.json["animations"][0];
        animation["channels"].push_back(
            {{"sampler", animation["samplers"].size()},
             {"target", {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}}}});
        animation["samplers"].push_back({{"input", times}, {"output", values}, {"interpolation", interpolation}});
    };
    const std::string base = "/materials/0/pbrMetallicRoughness/";
    add(base + "baseColorFactor", builder.vec4({0, 0, 0, 1, 1, 0.5, 0, 0}));
    add(base + "roughnessFactor", builder.scalars({0, 1}));
    add("/materials/0/emissiveFactor", builder.vec3({0, 0, 0, 1, 1, 0}), "STEP");
    add("/materials/0/doubleSided", builder.scalars({0, 1}), "STEP");
    add(base + "baseColorTexture/extensions/KHR_texture_transform/offset", builder.vec2({0, 0, 1, 2}));
    add("/cameras/0/perspective/yfov", builder.scalars({1, 2}));
    add("/extensions/KHR_lights_punctual/lights/0/intensity", builder.scalars({0, 10}));
    add("/nodes/0/extensions/KHR_node_visibility/visible", builder.scalars({0, 1}), "STEP");
    add("/nodes/1/rotation", builder.vec4({0, 0, 0, 1, 0, 0, 1, 0}));  // half a turn
    const Scene rest = read(builder);
    CHECK(rest.instances.size() == 1);
    CHECK(rest.materials.at(0).principled->roughness == 1.0f);

    const Scene scene = read(builder, 0.5);
    CHECK(scene.warnings.empty());
    const PrincipledMaterial& m = scene.materials.at(0).principled.value();
    CHECK(m.base_color == glm::vec3(0.25f, 0.125f, 0.0f));
    CHECK(m.alpha == 0.75f);
    CHECK(m.roughness == 0.25f);
    CHECK(m.emissive == glm::vec3(0.0f));
    CHECK(!m.is_double_sided);
    CHECK(scene.textures.at(m.base_color_texture.value()).transform[2] == glm::vec2(0.25f, 0.5f));
    REQUIRE(scene.meshes.size() == 1);  // the first node is hidden
    CHECK(scene.instances.empty());
    const float h = std::sqrt(0.5f);  // an eighth of a turn
    CHECK(is_near(scene.meshes[0].transform[0], {h, h, 0}));
    CHECK(std::abs(scene.cameras.at(0).top / scene.cameras[0].distance - std::tan(0.625)) < 1e-6);
    const Scene dim = read(builder, 0.25);
    CHECK(std::abs(scene.lights.at(0).point.intensity.x / dim.lights.at(0).point.intensity.x - 2.0f) < 1e-5f);
    const Scene end = read(builder, 2.0);
    CHECK(end.meshes.size() + end.instances.size() == 2);
    CHECK(end.materials.at(0).principled->is_double_sided);
    CHECK(end.materials.at(0).principled->emissive == glm::vec3(1, 1, 0));

    const GltfBuilder without = builder;
    for (const char* pointer :
         {"/materials/1/emissiveFactor", "/materials/-/emissiveFactor", "/materials/99999999999999999999/x",
          "/materials/00", "/cameras/0/type/x", "/materials/", "/materials/0/~2"}) {
        CAPTURE(pointer);
        builder = without;
        add(pointer, builder.vec3({0, 0, 0, 1, 1, 0}));
        const Scene same = read(builder, 0.5);
        REQUIRE(same.warnings.size() == 1);
        CHECK(contains(same.warnings[0].text, "animations[0].channels[9]: moves what the file does not have"));
    }
    builder = without;
    add("/accessors/0/count", builder.scalars({0, 1}));
    const Scene same = read(builder, 0.5);
    REQUIRE(same.warnings.size() == 1);
    CHECK(contains(same.warnings[0].text, "pointer: \"/accessors/0/count\" is not animated"));
    builder = without;
    add("/nodes/1/rotation", builder.vec3({0, 0, 0, 1, 1, 0}));
    CHECK(contains(refusal(builder, 0.5), "3 components"));
    builder = without;
    add("/nodes/0/scale", builder.vec2({0, 0, 1, 1}));
    CHECK(contains(refusal(builder, 0.5), "nodes[0].scale"));
}

TEST_CASE("What a spline overshoots is the nearest that a property may be", "[gltf]") {
    GltfBuilder builder = with_material({{"pbrMetallicRoughness", {{"roughnessFactor", 0.5}}}});
    const std::size_t times = builder.scalars({0, 1});
    const auto animate = [&](const std::string& pointer, std::size_t values, const char* interpolation) {
        builder.json["animations"] = {
            {{"channels",
              {{{"sampler", 0},
                {"target",
                 {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}}}}}},
             {"samplers", {{{"input", times}, {"output", values}, {"interpolation", interpolation}}}}}};
    };
    const std::string base = "/materials/0/pbrMetallicRoughness/";
    // A tangent, a value and a tangent for each time. In the middle: the mean of both values, and an eighth of the
    // difference of the inner tangents.
    animate(base + "roughnessFactor", builder.scalars({0, 1, 8, -8, 1, 0}), "CUBICSPLINE");
    CHECK(read(builder, 0.5).materials.at(0).principled->roughness == 1.0f);
    animate(base + "roughnessFactor", builder.scalars({0, 1, -2, 2, 1, 0}), "CUBICSPLINE");
    CHECK(read(builder, 0.5).materials.at(0).principled->roughness == 0.5f);
    animate(base + "baseColorFactor", builder.vec4({0,  0, 0, 0,  1, 0, .5, 1, 8, -8, 0, 8,  //
                                                    -8, 8, 0, -8, 1, 0, .5, 1, 0, 0,  0, 0}),
            "CUBICSPLINE");
    CHECK(read(builder, 0.5).materials.at(0).principled->base_color == glm::vec3(1.0f, 0.0f, 0.5f));
    animate("/materials/0/emissiveFactor", builder.vec3({0, 0, 0, 0, 0, .5, -8, 0, 0, 8, 0, 0, 0, 0, .5, 0, 0, 0}),
            "CUBICSPLINE");
    CHECK(read(builder, 0.5).materials.at(0).principled->emissive == glm::vec3(0.0f, 0.0f, 0.5f));

    animate(base + "roughnessFactor", builder.scalars({0, 4}), "LINEAR");
    CHECK(contains(refusal(builder, 0.5), "roughnessFactor: 2 where 0 to 1 was expected"));
    animate("/materials/0/emissiveFactor", builder.vec3({0, 0, 0, 0, -1, 0}), "LINEAR");
    CHECK(contains(refusal(builder, 0.5), "materials[0].emissiveFactor[1]: -0.5 where at least 0 was expected"));
}

TEST_CASE("Morph targets and matrices give way to what KHR_animation_pointer says", "[gltf]") {
    GltfBuilder builder = one_triangle();
    primitive(builder)["targets"] = {{{"POSITION", builder.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1})}}};
    builder.json["nodes"][0]["matrix"] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 0, 0, 1};
    const std::size_t times = builder.scalars({0, 2});
    const auto channel = [](std::size_t sampler, const char* pointer) -> json {
        return {{"sampler", sampler},
                {"target", {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}}}};
    };
    builder.json["animations"] = {{{"channels", {channel(0, "/meshes/0/weights"), channel(1, "/nodes/0/translation")}},
                                   {"samplers",
                                    {{{"input", times}, {"output", builder.scalars({0, 4})}},
                                     {{"input", times}, {"output", builder.vec3({0, 0, 0, 8, 0, 0})}}}}}};
    const Scene scene = read(builder, 0.5);
    CHECK(scene.meshes.at(0).positions.at(0) == glm::vec3(0, 0, 1));
    CHECK(is_near(scene.meshes[0].transform[0], {1, 0, 0}));
    CHECK(is_near(scene.meshes[0].transform[3], {2, 0, 0}));

    // No weights that are only asked for.
    builder.json["accessors"][builder.json["animations"][0]["samplers"][0]["output"].get<std::size_t>()] = {
        {"componentType", 5126}, {"count", 4000000000u}, {"type", "SCALAR"}};
    CHECK(contains(refusal(builder, 0.5), "4000000000 elements"));
}

TEST_CASE("A glTF skin moves vertices by its joints, not by its node", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json& attributes = primitive(builder)["attributes"];
    attributes["NORMAL"] = builder.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1});
    attributes["JOINTS_0"] =
        builder.accessor(std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, "VEC4", 4, 5121);
    attributes["WEIGHTS_0"] = builder.vec4({1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0});
    std::vector<float> binds;
    for (const float x : {0.0f, -1.0f})
        for (const float value :
             {1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, x, 0.0f, 0.0f, 1.0f})
            binds.push_back(value);
    builder.json["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", builder.mat4(binds)}}};
    builder.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}},
                             {{"translation", {0, 0, 4}}},
                             {{"translation", {1, 6, 0}}, {"scale", {1, 1, 2}}}};
    builder.json["scenes"][0]["nodes"] = {0, 1, 2};
    const Scene scene = read(builder);
    const Mesh& mesh = scene.meshes.at(0);
    CHECK(mesh.transform == Transform(1.0f));
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 4}, {1, 6, 0}, {0, 4, 2}});
    CHECK(mesh.normals[1] == glm::vec3(0, 0, 1));
}

TEST_CASE("A glTF mesh that two nodes have with the same skin is kept once", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json& attributes = primitive(builder)["attributes"];
    attributes["JOINTS_0"] = builder.accessor(std::vector<std::uint8_t>(12, 0), "VEC4", 4, 5121);
    attributes["WEIGHTS_0"] =
        builder.accessor(std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, "VEC4", 4, 5121);
    builder.json["accessors"].back()["normalized"] = true;
    builder.json["skins"] = {{{"joints", {2}}}, {{"joints", {3}}}};
    builder.json["nodes"] = {{{"mesh", 0}, {"skin", 0}},
                             {{"mesh", 0}, {"skin", 0}},
                             {{"translation", {0, 0, 4}}},
                             {{"translation", {0, 0, 5}}},
                             {{"mesh", 0}, {"skin", 1}}};
    builder.json["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};
    const Scene scene = read(builder);
    REQUIRE(scene.meshes.size() == 2);
    CHECK(scene.meshes[0].positions[0] == glm::vec3(0, 0, 4));
    CHECK(scene.meshes[1].positions[0] == glm::vec3(0, 0, 5));
    REQUIRE(scene.instances.size() == 1);
    CHECK(scene.instances[0].mesh == 0);
}

TEST_CASE("glTF tangents have length one and a sign, and morph targets move all attributes", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json& attributes = primitive(builder)["attributes"];
    attributes["NORMAL"] = builder.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1});
    attributes["TANGENT"] = builder.vec4({2, 0, 0, 1, 0, 0, 0, -0.5f, 3, 0, 4, -1});
    attributes["TEXCOORD_0"] = builder.vec2({0, 0, 1, 0, 0, 1});
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"];
    attributes["COLOR_0"] = builder.vec3({0.5f, 0.5f, 0.5f, 1, 1, 1, -1, 0, 0});
    Mesh mesh = read(builder).meshes.at(0);
    CHECK(mesh.tangents == std::vector<glm::vec4>{{1, 0, 0, 1}, {0, 0, 0, -1}, {0.6f, 0, 0.8f, -1}});
    CHECK(mesh.colors == std::vector<glm::vec4>{{0.5f, 0.5f, 0.5f, 1}, {1, 1, 1, 1}, {0, 0, 0, 1}});
    const std::size_t twos = builder.vec2({2, 0, 2, 0, 2, 0}), threes = builder.vec3(std::vector<float>(9, 3));
    primitive(builder)["targets"] = {
        {{"TANGENT", builder.vec3({-2, 2, 0, 0, 0, 0, 0, 0, 0})}, {"TEXCOORD_1", twos}, {"COLOR_0", threes}}};
    builder.json["meshes"][0]["weights"] = {1};
    mesh = read(builder).meshes.at(0);
    CHECK(mesh.tangents[0] == glm::vec4(0, 1, 0, 1));
    CHECK(mesh.texture_coordinates[1] == glm::vec2(1, 0));
    CHECK(mesh.texture_coordinates_1[1] == glm::vec2(3, 0));
    CHECK(mesh.colors[0] == glm::vec4(1));
    // Without normals, tangents are ignored.
    attributes.erase("NORMAL");
    primitive(builder)["targets"][0]["NORMAL"] = threes;
    mesh = read(builder).meshes.at(0);
    CHECK(mesh.normals.empty());
    CHECK(mesh.tangents.empty());
}

TEST_CASE("A sparse glTF accessor needs no buffer view, and indices have any unsigned type", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json sparse = {{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}};
    sparse["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", builder.view(std::vector<std::uint16_t>{0, 2})}, {"componentType", 5123}}},
        {"values", {{"bufferView", builder.view(std::vector<float>{1, 2, 3, 4, 5, 6})}}}};
    builder.json["accessors"].push_back(sparse);
    primitive(builder)["attributes"]["POSITION"] = builder.json["accessors"].size() - 1;
    for (const int type : {5121, 5123, 5125}) {
        CAPTURE(type);
        const std::size_t indices =
            type == 5121   ? builder.accessor(std::vector<std::uint8_t>{2, 1, 0}, "SCALAR", 1, type)
            : type == 5123 ? builder.accessor(std::vector<std::uint16_t>{2, 1, 0}, "SCALAR", 1, type)
                           : builder.accessor(std::vector<std::uint32_t>{2, 1, 0}, "SCALAR", 1, type);
        primitive(builder)["indices"] = indices;
        const Mesh mesh = read(builder).meshes.at(0);
        CHECK(mesh.positions == std::vector<glm::vec3>{{1, 2, 3}, {0, 0, 0}, {4, 5, 6}});
        CHECK(mesh.triangles == std::vector<glm::uvec3>{{2, 1, 0}});
    }
    json& last = builder.json["accessors"][primitive(builder)["attributes"]["POSITION"].get<std::size_t>()];
    last["sparse"]["count"] = 4;
    CHECK(contains(refusal(builder), ".sparse.count: 4 where at most 3"));
    last["sparse"]["count"] = 2;
    last["sparse"]["values"]["byteOffset"] = 1;
    CHECK(contains(refusal(builder), ".sparse.values: 2 elements of 12 bytes"));
    last["sparse"]["values"]["byteOffset"] = 0;
    last["count"] = 2;
    CHECK(contains(refusal(builder), "index 1 is 2, expected one below 2"));
}

/// Appends an accessor of floats without a buffer view, and returns its number.
std::size_t zeros(GltfBuilder& builder, const char* type, std::size_t count) {
    builder.json["accessors"].push_back({{"componentType", 5126}, {"count", count}, {"type", type}});
    return builder.json["accessors"].size() - 1;
}

/// Gives the last accessor a sparse part of one element.
template <class Index>
void make_sparse(GltfBuilder& builder, Index index, int index_type, const std::vector<float>& value) {
    const std::size_t indices = builder.view(std::vector<Index>{index}), values = builder.view(value);
    builder.json["accessors"].back()["sparse"] = {{"count", 1},
                                                  {"indices", {{"bufferView", indices}, {"componentType", index_type}}},
                                                  {"values", {{"bufferView", values}}}};
}

TEST_CASE("glTF accessors have as many zeros as the data beside them require, and few elsewhere", "[gltf]") {
    constexpr std::size_t kMany = 70000;
    SECTION("attributes of vertices and morph targets") {
        GltfBuilder builder = one_triangle();
        std::vector<float> places(3 * kMany);
        places[3] = places[3 * kMany - 2] = 1.0f;
        json& attributes = primitive(builder)["attributes"];
        attributes["POSITION"] = builder.vec3(places);
        attributes["TEXCOORD_0"] = zeros(builder, "VEC2", kMany);
        primitive(builder)["indices"] =
            builder.accessor(std::vector<std::uint32_t>{0, 1, kMany - 1}, "SCALAR", 1, 5125);
        primitive(builder)["targets"] = {{{"POSITION", zeros(builder, "VEC3", kMany)}}};
        builder.json["meshes"][0]["weights"] = {1};
        CHECK(read(builder).meshes.at(0).positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        make_sparse(builder, std::uint32_t{kMany - 1}, 5125, {0, 0, 5});
        const Mesh mesh = read(builder).meshes.at(0);
        CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 5}});
        CHECK(mesh.texture_coordinates == std::vector<glm::vec2>(3, glm::vec2(0)));
        const std::string place = "meshes[0].primitives[0].targets[0].POSITION: its accessor has ";
        for (const std::size_t wrong : {std::size_t{3}, kMany + 1, std::size_t{4000000000}}) {
            builder.json["accessors"].back()["count"] = wrong;
            CHECK(refusal(builder) == place + fmt::format("{} elements, expected 70000, one a vertex", wrong));
        }
    }
    SECTION("positions and indices, which nothing else requires") {
        const std::string reason = " elements without a bufferView, expected at most 65536";
        GltfBuilder builder = one_triangle();
        primitive(builder)["attributes"]["POSITION"] = zeros(builder, "VEC3", 65536);
        CHECK(read(builder).meshes.at(0).positions.size() == 65535);
        builder.json["accessors"].back()["count"] = kMany;
        primitive(builder)["attributes"]["NORMAL"] = builder.vec3(std::vector<float>(3 * kMany));
        CHECK(refusal(builder) == "accessors[1]: 70000" + reason);
        builder = one_triangle();
        primitive(builder)["indices"] = zeros(builder, "SCALAR", 4000000000);
        builder.json["accessors"].back()["componentType"] = 5125;
        CHECK(refusal(builder) == "accessors[1]: 4000000000" + reason);
        make_sparse(builder, std::uint32_t{1}, 5125, {0});
        CHECK(refusal(builder) == "accessors[1]: 4000000000" + reason);
    }
    SECTION("keyframes") {
        GltfBuilder builder = one_triangle();
        std::vector<float> times(kMany);
        for (std::size_t i = 0; i < kMany; ++i) times[i] = static_cast<float>(i);
        builder.json["nodes"][0]["translation"] = {1, 2, 3};
        const std::size_t input = builder.scalars(times), output = zeros(builder, "VEC3", kMany);
        builder.json["animations"] = {{{"channels", {{{"sampler", 0}, {"target", {{"node", 0}}}}}},
                                       {"samplers", {{{"input", input}, {"output", output}}}}}};
        builder.json["animations"][0]["channels"][0]["target"]["path"] = "translation";
        CHECK(read(builder, 69000.5).meshes.at(0).transform[3] == glm::vec3(0));
        builder.json["accessors"].back()["count"] = kMany + 1;
        CHECK(refusal(builder, 0.0) ==
              "animations[0].samplers[0].output: its accessor has 70001 elements, expected "
              "70000, for the times of the sampler's input");
        builder.json["accessors"][input].erase("bufferView");
        CHECK(contains(refusal(builder, 0.0), "70000 elements without a bufferView, expected at most 65536"));
    }
    SECTION("instances") {
        GltfBuilder builder = one_triangle();
        json attributes;
        attributes["TRANSLATION"] = zeros(builder, "VEC3", kMany);
        attributes["SCALE"] = builder.vec3(std::vector<float>(3 * kMany, 2.0f));
        builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
        const Scene scene = read(builder);
        REQUIRE(scene.instances.size() == kMany - 1);
        CHECK(scene.instances.back().transform[0] == glm::vec3(2, 0, 0));
        builder.json["accessors"][2].erase("bufferView");
        CHECK(contains(refusal(builder), "70000 elements without a bufferView, expected at most 65536"));
    }
}

TEST_CASE("Instances of glTF meshes turn and are scaled, and are charged for", "[gltf]") {
    GltfBuilder builder = one_triangle();
    builder.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    json& attributes = builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    attributes["SCALE"] = builder.vec3({2, 2, 2, 3, 3, 3});
    attributes["ROTATION"] = builder.accessor(std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 127, 0}, "VEC4", 4, 5120);
    builder.json["accessors"].back()["normalized"] = true;
    attributes["_COLOR"] = builder.vec3({1, 0, 0, 0, 1, 0});
    const Scene scene = read(builder);
    CHECK(scene.meshes.at(0).transform[0] == glm::vec3(2, 0, 0));
    REQUIRE(scene.instances.size() == 1);
    CHECK(is_near(scene.instances[0].transform[0], {-3, 0, 0}));  // by half a turn about z
    REQUIRE(scene.warnings.size() == 1);
    CHECK(contains(scene.warnings[0].text, "attributes._COLOR: attributes of instances, other than their places"));
    attributes.erase("_COLOR");
    attributes["SCALE"] = builder.vec3({1, 1, 1});
    CHECK(contains(refusal(builder), "as the other attributes"));
    // Very many, of an accessor that has no bytes.
    attributes = json::object();
    builder.json["accessors"].push_back({{"componentType", 5126}, {"count", 65536}, {"type", "VEC3"}});
    attributes["TRANSLATION"] = builder.json["accessors"].size() - 1;
    for (int i = 0; i < 40; ++i) {
        json node = builder.json["nodes"][0];
        builder.json["nodes"].push_back(node);
        builder.json["scenes"][0]["nodes"].push_back(i + 1);
    }
    CHECK(contains(refusal(builder), "data are used too often"));
}

TEST_CASE("What a glTF file has and is not drawn is told once, with how often", "[gltf]") {
    GltfBuilder builder = one_triangle();
    for (int i = 0; i < 3; ++i) {
        builder.json["meshes"][0]["primitives"].push_back(primitive(builder));
        builder.json["meshes"][0]["primitives"].back()["mode"] = i;
    }
    builder.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_no_such", "KHR_no_such"};
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"range", 5}}};
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    const Scene scene = read(builder);
    CHECK(scene.lights.at(0).point.range == 5.0f);
    std::vector<std::string> texts;
    for (const Warning& warning : scene.warnings) texts.push_back(warning.text);
    CHECK(texts ==
          std::vector<std::string>{"the extension \"KHR_no_such\" is not read",
                                   "meshes[0].primitives[1]: points and lines are not drawn (and so for 2 more)"});
    builder.json["extensions"]["KHR_lights_punctual"]["lights"][0]["range"] = 0;
    CHECK(contains(refusal(builder), "lights[0].range: is 0, expected a number above 0"));
}

TEST_CASE("A glTF matrix may be rounded in its last row", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json& matrix = builder.json["nodes"][0]["matrix"];
    matrix = {2, 0, 0, 1e-7, 0, 2, 0, 0, 0, 0, 2, 0, 1, 2, 3, 0.9999999};
    CHECK(read(builder).meshes.at(0).transform[3] == glm::vec3(1, 2, 3));
    matrix[15] = 0.5;
    CHECK(contains(refusal(builder), "nodes[0].matrix: its last row"));
}

TEST_CASE("glTF cameras and lights stand where their nodes are", "[gltf]") {
    GltfBuilder builder = one_triangle();
    builder.json["extensionsUsed"] = {"KHR_lights_punctual"};
    builder.json["cameras"] = {
        {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"aspectRatio", 2.0}, {"znear", 0.1}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 3}, {"ymag", 2}, {"znear", 0.1}, {"zfar", 10}}}}};
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"color", {1, 0.5, 0}}, {"intensity", 10}, {"name", "Bulb"}},
        {{"type", "directional"}, {"name", "Sun"}},
        {{"type", "spot"}, {"intensity", 4}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}}};
    const double h = std::sqrt(0.5);
    builder.json["nodes"] = {
        {{"mesh", 0}}, {{"camera", 0}, {"translation", {1, 2, 3}}, {"rotation", {0, h, 0, h}}}, {{"camera", 1}}};
    for (int i = 0; i < 3; ++i) {
        json node = {{"translation", {0, i, 0}}};
        if (i < 2) node["name"] = i == 0 ? json("Key") : json(17);
        node["extensions"]["KHR_lights_punctual"]["light"] = i;
        builder.json["nodes"].push_back(node);
    }
    builder.json["scenes"][0]["nodes"] = {0, 1, 2, 3, 4, 5};
    const Scene scene = read(builder);
    REQUIRE(scene.cameras.size() == 2);
    const Camera& camera = scene.cameras[0];
    CHECK(camera.position == glm::vec3(1, 2, 3));
    CHECK(is_near(camera.gaze, {-1, 0, 0}));  // -z, turned by a quarter about y
    CHECK(is_near(camera.up, {0, 1, 0}));
    CHECK(camera.top == Approx(std::tan(0.5)));
    CHECK(camera.right == Approx(2 * std::tan(0.5)));
    CHECK(camera.width == 2 * camera.height);
    CHECK(scene.cameras[1].is_orthographic);
    CHECK(scene.cameras[1].right == 3.0f);
    CHECK(scene.cameras[1].top == 2.0f);
    REQUIRE(scene.lights.size() == 3);
    CHECK(scene.lights[0].kind == Light::Kind::point);
    CHECK(scene.lights[0].point.intensity == glm::vec3(2550, 1275, 0));
    CHECK(scene.lights[1].directional.direction == glm::vec3(0, 0, -1));
    CHECK(scene.lights[1].directional.radiance == glm::vec3(255));
    CHECK(scene.lights[2].spot.position == glm::vec3(0, 2, 0));
    CHECK(scene.lights[2].spot.coverage_radians == 1.0f);
    CHECK(scene.lights[2].spot.falloff_radians == 0.5f);
    CHECK(scene.lights[2].spot.falloff == SpotFalloff::square);
    CHECK(scene.lights[0].names == std::vector<std::string>{"Key", "Bulb"});
    CHECK(scene.lights[1].names == std::vector<std::string>{"Sun"});  // what is no text is passed over
    CHECK(scene.lights[2].names.empty());
}

TEST_CASE("glTF cameras look along the rotations of their nodes, whatever scales them", "[gltf]") {
    const double h = std::sqrt(0.5), sine = std::sin(0.3926990816987241), cosine = std::cos(0.3926990816987241);
    const json eighth = {0, sine, 0, cosine}, quarter = {0, h, 0, h};
    const auto camera_of = [](json nodes) {
        GltfBuilder builder = one_triangle();
        builder.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}}}}};
        nodes.back()["camera"] = 0;
        for (std::size_t i = 0; i + 1 < nodes.size(); ++i) nodes[i]["children"] = {i + 1};
        nodes.push_back({{"mesh", 0}});
        builder.json["scenes"][0]["nodes"] = {0, nodes.size() - 1};
        builder.json["nodes"] = nodes;
        return read(builder).cameras.at(0);
    };
    const auto f = static_cast<float>(h);
    // A scaled parent moves the camera, and does not shear its view.
    Camera camera = camera_of({{{"scale", {1, 1, 5}}}, {{"rotation", eighth}, {"translation", {1, 2, 3}}}});
    CHECK(is_near(camera.position, {1, 2, 15}));
    CHECK(is_near(camera.gaze, {-f, 0, -f}));
    CHECK(is_near(camera.up, {0, 1, 0}));
    camera = camera_of({{{"rotation", quarter}, {"scale", {3, 1, 1}}}, {{"rotation", eighth}}});
    CHECK(is_near(camera.gaze, {-f, 0, f}));
    // Neither the sign of a scale nor a scale of zero turns the camera.
    for (const json& scale : {json{1, -1, 1}, json{1, 1, -1}, json{-2, -3, -4}, json{0, 0, 0}}) {
        CAPTURE(scale.dump());
        camera = camera_of({{{"rotation", eighth}, {"scale", scale}}});
        CHECK(is_near(camera.gaze, {-f, 0, -f}));
        CHECK(is_near(camera.up, {0, 1, 0}));
    }
    // A matrix is a rotation times a scale: a quarter turn about x, which a mirrored x does not change.
    for (const int x : {2, -2, 0}) {
        CAPTURE(x);
        const json matrix = {x, 0, 0, 0, 0, 0, 3, 0, 0, -5, 0, 0, 7, 8, 9, 1};
        camera = camera_of({{{"matrix", matrix}}, {{"rotation", eighth}}});
        CHECK(camera.position == glm::vec3(7, 8, 9));
        CHECK(is_near(camera.gaze, {-f, f, 0}));
        CHECK(is_near(camera.up, {0, 0, 1}));
    }
    camera = camera_of({{{"matrix", std::vector<int>{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 1}}}});
    CHECK(is_near(camera.gaze, {0, 0, -1}));
}

TEST_CASE("glTF spots with equal cones have a hard edge, and an inner cone is not outside", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json& light = builder.json["extensions"]["KHR_lights_punctual"]["lights"][0];
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    light = {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.4}, {"outerConeAngle", 0.4}}}};
    const Scene scene = read(builder);
    CHECK(scene.lights.at(0).spot.coverage_radians == 0.8f);
    CHECK(scene.lights.at(0).spot.falloff_radians == 0.8f);
    const SceneArrays arrays = flatten(scene);
    CHECK(arrays.lights.at(0).cos_coverage == arrays.lights.at(0).cos_falloff);
    const std::string place = "extensions.KHR_lights_punctual.lights[0]: ";
    light["spot"]["innerConeAngle"] = 0.5;
    CHECK(refusal(builder) == place + "innerConeAngle 0.5 is above outerConeAngle 0.4");
    light["spot"] = {{"innerConeAngle", 0}, {"outerConeAngle", 0}};
    CHECK(refusal(builder) == place + "outerConeAngle is 0, expected an angle above 0");
}

TEST_CASE("Lamps of glTF are known by the names of their materials", "[gltf]") {
    GltfBuilder builder = one_triangle();
    builder.json["materials"] = {{{"name", "Neon"}, {"emissiveFactor", {1, 1, 1}}}, {{"emissiveFactor", {1, 0, 0}}}};
    builder.json["meshes"].push_back(builder.json["meshes"][0]);
    primitive(builder)["material"] = 0;
    builder.json["meshes"][1]["primitives"][0]["material"] = 1;
    builder.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 1}}, {{"mesh", 0}, {"translation", {5, 0, 0}}}};
    builder.json["scenes"][0]["nodes"] = {0, 1, 2};
    Scene scene = read(builder);
    add_mesh_lights(scene);
    std::vector<std::vector<std::string>> names;
    for (const Light& light : scene.lights) names.push_back(light.names);
    CHECK(scene.materials.at(0).name == "Neon");
    CHECK(names == std::vector<std::vector<std::string>>{{"Neon"}, {}, {"Neon"}});
}

TEST_CASE("glTF meshes get tangents along the coordinates of the normal map, where there are none", "[gltf]") {
    const auto tangents_of = [](const json& material, bool has_own, bool has_normals = true) {
        GltfBuilder builder = with_material(material);
        json& attributes = primitive(builder)["attributes"];
        if (has_normals) attributes["NORMAL"] = builder.vec3({0, 0, 1, 0, 0, 1, 0, 0, 1});
        attributes["TEXCOORD_0"] = builder.vec2({0, 1, 1, 1, 0, 0});
        attributes["TEXCOORD_1"] = builder.vec2({1, 1, 1, 0, 0, 1});  // turned: u is down
        if (has_own) attributes["TANGENT"] = builder.vec4({0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1});
        return read(builder).meshes.at(0).tangents;
    };
    using Tangents = std::vector<glm::vec4>;
    const json first = {{"index", 0}}, second = {{"index", 0}, {"texCoord", 1}};
    CHECK(tangents_of(json::object(), false).empty());
    CHECK(tangents_of({{"normalTexture", first}}, false) == Tangents(3, {1, 0, 0, 1}));
    CHECK(tangents_of({{"normalTexture", second}}, false) == Tangents(3, {0, -1, 0, 1}));
    CHECK(tangents_of({{"normalTexture", second}}, true) == Tangents(3, {0, 1, 0, 1}));
    CHECK(tangents_of({{"normalTexture", first}}, true, false) == Tangents(3, {1, 0, 0, 1}));
}

TEST_CASE("glTF materials, their textures and samplers are read", "[gltf]") {
    GltfBuilder builder = with_material({{"pbrMetallicRoughness",
                                          {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}},
                                           {"baseColorTexture", {{"index", 0}}},
                                           {"metallicFactor", 0.25},
                                           {"roughnessFactor", 0.5},
                                           {"metallicRoughnessTexture", {{"index", 0}, {"texCoord", 1}}}}},
                                         {"normalTexture", {{"index", 0}, {"scale", 2}}},
                                         {"emissiveFactor", {1, 0, 0}},
                                         {"alphaMode", "MASK"},
                                         {"alphaCutoff", 0.75},
                                         {"doubleSided", true}});
    builder.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9729}, {"minFilter", 9729}}};
    builder.json["textures"][0]["sampler"] = 0;
    const Scene scene = read(builder);
    const PrincipledMaterial& m = scene.materials.at(0).principled.value();
    CHECK(m.base_color == glm::vec3(0.1f, 0.2f, 0.3f));
    CHECK(m.alpha == 0.4f);
    CHECK(m.metallic == 0.25f);
    CHECK(m.roughness == 0.5f);
    CHECK(m.normal_scale == 2.0f);
    CHECK(m.emissive == glm::vec3(1, 0, 0));
    CHECK(m.alpha_mode == AlphaMode::mask);
    CHECK(m.alpha_cutoff == 0.75f);
    CHECK(m.is_double_sided);
    REQUIRE(scene.textures.size() == 2);  // of both sets of coordinates
    CHECK(m.base_color_texture == m.normal_texture);
    const Texture& texture = scene.textures[*m.base_color_texture];
    CHECK(texture.target == TextureTarget::principled);
    CHECK(texture.wrap == TextureWrap::clamp);
    CHECK(texture.wrap_v == TextureWrap::mirror);
    CHECK(texture.filter == TextureFilter::bilinear);
    CHECK(scene.textures[*m.metallic_roughness_texture].coordinate_set == 1);
    REQUIRE(scene.images.size() == 1);
    CHECK(scene.images[0].bytes == std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60});
    CHECK(scene.images[0].alpha == std::vector<std::uint8_t>{255, 128});
}

TEST_CASE("A glTF texture without a source is left out with a warning", "[gltf]") {
    const json without = {{"index", 1}};
    GltfBuilder builder = with_material({{"pbrMetallicRoughness", {{"baseColorTexture", without}}},
                                         {"normalTexture", without},
                                         {"emissiveTexture", {{"index", 0}}},
                                         {"emissiveFactor", {1, 1, 1}}});
    builder.json["textures"].push_back(json::object());
    builder.json["textures"].push_back({{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}});
    builder.json["materials"].push_back({{"emissiveTexture", {{"index", 2}}}});
    const Scene scene = read(builder);
    const PrincipledMaterial& m = scene.materials.at(0).principled.value();
    CHECK_FALSE(m.base_color_texture);
    CHECK_FALSE(m.normal_texture);
    CHECK(m.emissive_texture == 0u);
    CHECK_FALSE(scene.materials.at(1).principled->emissive_texture);
    CHECK(scene.textures.size() == 1);
    REQUIRE(scene.warnings.size() == 1);
    CHECK(scene.warnings[0].text == "textures[1]: has no source that is read, and is left out (and so for 1 more)");
}

TEST_CASE("All wraps and filters of glTF samplers are read", "[gltf]") {
    const std::pair<int, TextureWrap> wraps[] = {
        {33071, TextureWrap::clamp}, {33648, TextureWrap::mirror}, {10497, TextureWrap::repeat}};
    struct Filters {
        int larger, smaller;
        TextureFilter filter;
    };
    const Filters filters[] = {{9728, 9728, TextureFilter::nearest},   {9728, 9987, TextureFilter::nearest},
                               {9729, 9728, TextureFilter::bilinear},  {9729, 9729, TextureFilter::bilinear},
                               {9729, 9984, TextureFilter::trilinear}, {9729, 9985, TextureFilter::trilinear},
                               {9729, 9986, TextureFilter::trilinear}, {9729, 9987, TextureFilter::trilinear}};
    GltfBuilder builder = with_material({{"emissiveTexture", {{"index", 0}}}});
    builder.json["textures"][0]["sampler"] = 0;
    json& sampler = builder.json["samplers"][0];
    for (const auto& [s, wrap_u] : wraps)
        for (const auto& [t, wrap_v] : wraps) {
            CAPTURE(s, t);
            sampler = {{"wrapS", s}, {"wrapT", t}};
            const Texture texture = read(builder).textures.at(0);
            CHECK(texture.wrap == wrap_u);
            CHECK(texture.wrap_v.value_or(texture.wrap) == wrap_v);
            CHECK(texture.filter == TextureFilter::trilinear);
        }
    for (const Filters& f : filters) {
        CAPTURE(f.larger, f.smaller);
        sampler = {{"magFilter", f.larger}, {"minFilter", f.smaller}};
        CHECK(read(builder).textures.at(0).filter == f.filter);
    }
    sampler = json::object();
    CHECK(read(builder).textures.at(0).wrap == TextureWrap::repeat);
    for (const char* key : {"wrapS", "wrapT", "magFilter", "minFilter"}) {
        CAPTURE(key);
        sampler = {{key, 1}};
        CHECK(contains(refusal(builder), std::string("samplers[0].") + key + ": is none of"));
    }
}

TEST_CASE("KHR_texture_transform scales, turns and moves glTF texture coordinates", "[gltf]") {
    // The extension's own example: the lower left quarter of the picture, turned clockwise by 90 degrees.
    GltfBuilder builder = with_material({{"emissiveTexture", {{"index", 0}}}}, "KHR_texture_transform");
    builder.json["materials"][0]["emissiveTexture"]["extensions"]["KHR_texture_transform"] = {
        {"offset", {0, 1}}, {"rotation", 1.57079632679}, {"scale", {0.5, 0.5}}};
    const Scene scene = read(builder);
    const glm::mat3x2& m = scene.textures.at(0).transform;
    const auto at = [&](float u, float v) { return m * glm::vec3(u, v, 1); };
    CHECK(is_near({at(0, 0), 0}, {0, 1, 0}));
    CHECK(is_near({at(1, 0), 0}, {0, 0.5f, 0}));
    CHECK(is_near({at(0, 1), 0}, {0.5f, 1, 0}));
}

TEST_CASE("Each extension of glTF materials is read", "[gltf]") {
    const auto with = [](const std::string& name, const json& values) {
        json material;
        material["extensions"]["KHR_materials_" + name] = values;
        return material_of(with_material(material, ("KHR_materials_" + name).c_str()));
    };
    const json picture = {{"index", 0}};
    CHECK(with("emissive_strength", {{"emissiveStrength", 5}}).emissive_strength == 5.0f);
    CHECK(with("ior", {{"ior", 1.25}}).ior == 1.25f);
    CHECK(with("unlit", json::object()).is_unlit);
    CHECK(with("dispersion", {{"dispersion", 0.5}}).dispersion == 0.5f);
    PrincipledMaterial m =
        with("specular", {{"specularFactor", 0.5}, {"specularColorFactor", {2, 1, 0}}, {"specularTexture", picture}});
    CHECK((m.specular == 0.5f && m.specular_color == glm::vec3(2, 1, 0) && m.specular_texture == 0u));
    m = with("transmission", {{"transmissionFactor", 0.5}, {"transmissionTexture", picture}});
    CHECK((m.transmission == 0.5f && m.transmission_texture == 0u));
    m = with("volume", {{"thicknessFactor", 2},
                        {"attenuationDistance", 3},
                        {"attenuationColor", {0.5, 1, 1}},
                        {"thicknessTexture", picture}});
    CHECK((m.thickness == 2.0f && m.attenuation_distance == 3.0f && m.attenuation_color.x == 0.5f &&
           m.thickness_texture == 0u));
    m = with("clearcoat", {{"clearcoatFactor", 1},
                           {"clearcoatRoughnessFactor", 0.5},
                           {"clearcoatTexture", picture},
                           {"clearcoatNormalTexture", {{"index", 0}, {"scale", 3}}}});
    CHECK((m.clearcoat == 1.0f && m.clearcoat_roughness == 0.5f && m.clearcoat_texture == 0u &&
           m.clearcoat_normal_scale == 3.0f));
    m = with("sheen", {{"sheenColorFactor", {1, 0, 1}}, {"sheenRoughnessFactor", 0.5}, {"sheenColorTexture", picture}});
    CHECK((m.sheen_color == glm::vec3(1, 0, 1) && m.sheen_roughness == 0.5f && m.sheen_color_texture == 0u));
    m = with("anisotropy", {{"anisotropyStrength", 0.5}, {"anisotropyRotation", 1}, {"anisotropyTexture", picture}});
    CHECK((m.anisotropy == 0.5f && m.anisotropy_rotation_radians == 1.0f && m.anisotropy_texture == 0u));
    m = with("iridescence", {{"iridescenceFactor", 1},
                             {"iridescenceIor", 1.5},
                             {"iridescenceThicknessMaximum", 500},
                             {"iridescenceTexture", picture}});
    CHECK((m.iridescence == 1.0f && m.iridescence_ior == 1.5f && m.iridescence_thickness_maximum == 500.0f &&
           m.iridescence_texture == 0u));
    m = with("diffuse_transmission", {{"diffuseTransmissionFactor", 0.5},
                                      {"diffuseTransmissionColorFactor", {0, 1, 0}},
                                      {"diffuseTransmissionTexture", picture}});
    CHECK((m.diffuse_transmission == 0.5f && m.diffuse_transmission_color == glm::vec3(0, 1, 0) &&
           m.diffuse_transmission_texture == 0u));
    m = with("diffuse_roughness", {{"diffuseRoughnessFactor", 0.5}, {"diffuseRoughnessTexture", picture}});
    CHECK((m.diffuse_roughness == 0.5f && m.diffuse_roughness_texture == 0u));
}

TEST_CASE("What scatters within solids of glTF is read under both names of its extension", "[gltf]") {
    const auto with = [&](const char* name, const json& values, float thickness = 1.0f) {
        json material = {{"extensions", {{name, values}}}};
        material["extensions"]["KHR_materials_volume"] = {{"thicknessFactor", thickness}};
        GltfBuilder builder = with_material(material, name);
        builder.json["extensionsUsed"].push_back("KHR_materials_volume");
        return builder;
    };
    constexpr const char* kOlder = "KHR_materials_volume_scatter";
    constexpr const char* kNewer = "KHR_materials_scatter";
    const json given = {{"multiscatterColorFactor", {0.5, 0.25, 1}}, {"scatterAnisotropy", -0.5}};
    PrincipledMaterial m = material_of(with(kOlder, given));
    CHECK((m.multiscatter_color == glm::vec3(0.5f, 0.25f, 1.0f) && m.scattering_anisotropy == -0.5f));
    m = material_of(with(kOlder, {{"multiscatterColor", {0.25, 0.5, 1}}}));
    CHECK(m.multiscatter_color == glm::vec3(0.25f, 0.5f, 1.0f));
    CHECK(material_of(with(kOlder, json::object())).multiscatter_color == glm::vec3(0.0f));
    CHECK(material_of(with(kNewer, given)).multiscatter_color == glm::vec3(0.0f));  // its strength is 0
    CHECK(material_of(with(kNewer, {{"scatterStrengthFactor", 0.5}})).multiscatter_color == glm::vec3(0.5f));

    CHECK(contains(refusal(with(kOlder, {{"scatterAnisotropy", 1}})), "scatterAnisotropy: 1 where"));
    CHECK(contains(refusal(with(kOlder, {{"scatterAnisotropy", -2}})), "scatterAnisotropy: -2 where"));
    CHECK(contains(refusal(with(kOlder, {{"multiscatterColorFactor", {0, 2, 0}}})), "multiscatterColorFactor[1]: 2"));
    CHECK(contains(refusal(with(kOlder, {{"multiscatterColor", {0, 0, -1}}})), "multiscatterColor[2]: -1"));
    const auto only_warning = [&](const GltfBuilder& builder) {
        const Scene scene = read(builder);
        REQUIRE(scene.warnings.size() == 1);
        return scene.warnings[0].text;
    };
    CHECK(contains(only_warning(with(kOlder, given, 0.0f)), "KHR_materials_volume_scatter: scatters nothing"));
    GltfBuilder textured = with(kOlder, {{"multiscatterColorTexture", {{"index", 0}}}});
    CHECK(contains(only_warning(textured), "multiscatterColorTexture: is not read"));
}

TEST_CASE("Members of materials and lights of glTF that are not read are told", "[gltf]") {
    GltfBuilder builder =
        with_material({{"name", "glass"},
                       {"extras", {{"a", 1}}},
                       {"occlusionTexture", {{"index", 0}}},
                       {"roughnessFactor", 0.5},
                       {"pbrMetallicRoughness",
                        {{"roughness", 0.5}, {"metallicFactor", 0}, {"extras", 1}, {"extensions", json::object()}}},
                       {"extensions",
                        {{"KHR_materials_ior", {{"ior", 1.4}, {"iro", 2}}},
                         {"KHR_materials_specular",
                          {{std::string(100, 'a'), 1}, {"b", 2}, {"c", 3}, {"d", 4}, {"specularFactor", 1}}}}}},
                      "KHR_materials_ior");
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"name", "lamp"}, {"spot", json::object()}},
        {{"type", "spot"}, {"range", 2}, {"spot", {{"outerAngle", 1}}}}};
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"] = {{"light", 0}};
    builder.json["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
    builder.json["scenes"][0]["nodes"].push_back(builder.json["nodes"].size() - 1);
    std::vector<std::string> texts;
    for (const Warning& warning : read(builder).warnings) texts.push_back(warning.text);
    CHECK(texts == std::vector<std::string>{
                       "materials[0].pbrMetallicRoughness: has members that are not read: \"roughness\"",
                       "materials[0].extensions.KHR_materials_ior: has members that are not read: \"iro\"",
                       "materials[0].extensions.KHR_materials_specular: has members that are not read: \"" +
                           std::string(40, 'a') + "\", \"b\", \"c\" and 1 more",
                       "materials[0]: has members that are not read: \"roughnessFactor\"",
                       "extensions.KHR_lights_punctual.lights[0]: has members that are not read: \"spot\"",
                       "extensions.KHR_lights_punctual.lights[1].spot: has members that are not read: \"outerAngle\"",
                   });
}

TEST_CASE("Unread members of nodes, cameras and textures of glTF are told, and extensions that no list names",
          "[gltf]") {
    GltfBuilder builder = with_material(
        {{"pbrMetallicRoughness",
          {{"baseColorTexture",
            {{"index", 0},
             {"texCord", 1},
             {"extensions", {{"KHR_texture_transform", {{"scale", {2, 2}}, {"turn", 1}}}, {"EXT_mine", 1}}}}}}},
         {"normalTexture", {{"index", 0}, {"scale", 0.5}, {"strength", 1}}},
         {"extensions", {{"KHR_no_such", json::object()}, {"EXT_mine", json::object()}}}},
        "KHR_texture_transform");
    builder.json["extensionsUsed"] = {"KHR_no_such"};
    builder.json["images"] = {{{"uri", "data:image/png;base64,"}}};
    builder.json["textures"] = {{{"extensions", json::object()}}};
    builder.json["cameras"] = {
        {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}, {"zfar", 9}, {"aspect", 2}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}}}, {"perspective", json::object()}}};
    for (int i = 0; i < 2; ++i) {
        builder.json["nodes"].push_back({{"camera", i}, {"translate", {1, 2, 3}}, {"extensions", {{"EXT_mine", 1}}}});
        builder.json["scenes"][0]["nodes"].push_back(builder.json["nodes"].size() - 1);
    }
    std::vector<std::string> texts;
    for (const Warning& warning : read(builder).warnings) texts.push_back(warning.text);
    const std::string info = "materials[0].pbrMetallicRoughness.baseColorTexture";
    CHECK(texts == std::vector<std::string>{
                       "the extension \"KHR_no_such\" is not read",
                       "nodes[1]: has the extension \"EXT_mine\", which is not read (and so for 3 more)",
                       "nodes[1]: has members that are not read: \"translate\" (and so for 1 more)",
                       info + ".extensions.KHR_texture_transform: has members that are not read: \"turn\"",
                       "textures[0]: has no source that is read, and is left out",
                       info + ": has members that are not read: \"texCord\"",
                       "materials[0].normalTexture: has members that are not read: \"strength\"",
                       "cameras[0].perspective: has members that are not read: \"aspect\"",
                       "cameras[1]: has members that are not read: \"perspective\"",
                   });
}

TEST_CASE("Specular colour and glossiness of glTF make a surface without metal that has this F0", "[gltf]") {
    constexpr const char* kExtension = "KHR_materials_pbrSpecularGlossiness";
    const json picture = {{"index", 0}};
    const auto with = [&](const json& values) {
        json material = {{"pbrMetallicRoughness", {{"metallicFactor", 1}, {"baseColorFactor", {1, 0, 0, 1}}}}};
        material["extensions"] = {{kExtension, values}, {"KHR_materials_ior", {{"ior", 2}}}};
        return with_material(material, kExtension);
    };
    const PrincipledMaterial plain = material_of(with(
        {{"diffuseFactor", {0.1, 0.2, 0.3, 0.4}}, {"specularFactor", {0.5, 0.25, 0}}, {"glossinessFactor", 0.75}}));
    CHECK(plain.base_color == glm::vec3(0.1f, 0.2f, 0.3f));
    CHECK(plain.alpha == 0.4f);
    CHECK(plain.specular_color == glm::vec3(0.5f, 0.25f, 0.0f));
    CHECK((plain.metallic == 0.0f && plain.ior == 0.0f && plain.specular == 1.0f && plain.roughness == 0.25f));
    CHECK((!plain.base_color_texture && !plain.specular_color_texture && !plain.metallic_roughness_texture));

    const PrincipledMaterial otherwise = material_of(with(json::object()));
    CHECK((otherwise.base_color == glm::vec3(1.0f) && otherwise.specular_color == glm::vec3(1.0f)));
    CHECK((otherwise.alpha == 1.0f && otherwise.roughness == 0.0f));

    const Scene scene = read(with({{"diffuseTexture", picture},
                                   {"specularGlossinessTexture", picture},
                                   {"specularFactor", {1, 1, 0.5}},
                                   {"glossinessFactor", 0.5}}));
    const PrincipledMaterial& m = scene.materials.at(0).principled.value();
    CHECK(m.roughness == 1.0f);
    CHECK(m.specular_color == glm::vec3(1.0f, 1.0f, 0.5f));
    REQUIRE(m.metallic_roughness_texture.has_value());
    CHECK(m.specular_color_texture == m.base_color_texture);
    CHECK(m.metallic_roughness_texture != m.base_color_texture);
    const Image& colors = scene.images.at(scene.textures.at(m.specular_color_texture.value()).image);
    const Image& roughness = scene.images.at(scene.textures.at(*m.metallic_roughness_texture).image);
    CHECK(colors.bytes == std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60});
    CHECK(colors.alpha == std::vector<std::uint8_t>{255, 128});
    CHECK(roughness.bytes == std::vector<std::uint8_t>{128, 128, 128, 191, 191, 191});  // 255 - A / 2, 127.5 rounded up
    CHECK(roughness.alpha.empty());

    GltfBuilder two = with({{"specularGlossinessTexture", picture}, {"glossinessFactor", 0.5}});
    for (const double glossiness : {0.5, 1.0}) {
        two.json["materials"].push_back(two.json["materials"][0]);
        two.json["materials"].back()["extensions"][kExtension]["glossinessFactor"] = glossiness;
    }
    CHECK(read(two).images.size() == 3);  // as it is, and for each of the factors
    GltfBuilder many = with({{"specularGlossinessTexture", picture}});
    many.json["textures"][0]["source"] = many.json["images"].size();
    many.texture(test::png_bytes(600, 600, 4, std::vector<std::uint8_t>(4 * 600 * 600, 128)));
    for (int i = 1; i < 200; ++i) {
        many.json["materials"].push_back(many.json["materials"][0]);
        many.json["materials"].back()["extensions"][kExtension]["glossinessFactor"] = 0.005 * i;
    }
    CHECK(contains(refusal(many), "images[1]: its factors of glossiness are so many that roughness has more than"));
    CHECK(contains(refusal(with({{"specularFactor", {2, 0, 0}}})), "pbrSpecularGlossiness.specularFactor[0]: 2"));
    CHECK(contains(refusal(with({{"diffuseFactor", {0, 0, 2, 1}}})), "pbrSpecularGlossiness.diffuseFactor[2]: 2"));
    CHECK(contains(refusal(with({{"glossinessFactor", -1}})), "pbrSpecularGlossiness.glossinessFactor: -1"));
}

TEST_CASE("A variant of a glTF file's materials is chosen by number or name", "[gltf]") {
    constexpr const char* kExtension = "KHR_materials_variants";
    const TemporaryDirectory folder;
    const auto material_of = [&](const json& mappings, const std::optional<std::string>& variant,
                                 const json& names = {{{"name", "Red"}}, {{"name", "Blue"}}, {{"name", "3"}}}) {
        GltfBuilder builder = one_triangle();
        builder.json["materials"] = json::array({json::object(), json::object(), json::object()});
        builder.json["extensionsUsed"] = {kExtension};
        if (!names.empty()) builder.json["extensions"][kExtension]["variants"] = names;
        primitive(builder)["material"] = 0;
        if (!mappings.empty()) primitive(builder)["extensions"][kExtension]["mappings"] = mappings;
        LoadOptions options;
        options.material_variant = variant;
        const Scene scene = load_scene(folder.write("v.gltf", builder.gltf()), options);
        CHECK(scene.warnings.empty());
        CHECK(scene.material_variants.size() == names.size());
        if (!names.empty()) CHECK(scene.material_variants.at(1) == "Blue");
        return scene.meshes.at(0).material;
    };
    const auto refusal_of = [&](const std::string& variant, const json& names) {
        try {
            material_of(json::array(), variant, names);
        } catch (const UsageError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const json mappings = {{{"material", 1}, {"variants", {0, 2}}}, {{"material", 2}, {"variants", {1}}}};
    CHECK(material_of(mappings, std::nullopt) == 0);
    CHECK(material_of(mappings, "Red") == 1);
    CHECK(material_of(mappings, "Blue") == 2);
    CHECK(material_of(mappings, "2") == 2);
    CHECK(material_of(mappings, "3") == 1);
    CHECK(material_of(json::array({mappings[0]}), "Blue") == 0);  // a variant without a mapping
    CHECK(material_of(json::array(), "Blue") == 0);
    const json names = {{{"name", "Red"}}, {{"name", "Blue"}}};
    CHECK(contains(refusal_of("Green", names),
                   "there is no material variant \"Green\": expected a number from 1 to 2, or "
                   "one of \"Red\", \"Blue\""));
    CHECK(contains(refusal_of("3", names), "there is no material variant \"3\""));
    CHECK(contains(refusal_of("1", json::array()), "there is no material variant \"1\": the file has none"));
    GltfBuilder broken = one_triangle();
    broken.json["extensions"][kExtension]["variants"] = names;
    primitive(broken)["extensions"][kExtension]["mappings"] = {{{"material", 7}, {"variants", {0}}}};
    LoadOptions first;
    first.material_variant = "1";
    const auto file = folder.write("broken.gltf", broken.gltf());
    CHECK_THROWS_WITH(load_scene(file, first), Catch::Matchers::Contains("mappings[0].material: 7 is no index"));
    const auto mesh = folder.write("m.stl", "solid x\nendsolid x\n");
    CHECK_THROWS_WITH(load_scene(mesh, first), Catch::Matchers::Contains("only a glTF file has material variants"));
}

TEST_CASE("Nodes of glTF that are hidden are not shown, nor those below them", "[gltf]") {
    GltfBuilder builder = one_triangle();
    const json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
    builder.json["extensionsRequired"] = {"KHR_node_visibility"};
    builder.json["nodes"] = {{{"children", {1, 2}}, {"translation", {1, 0, 0}}},
                             {{"mesh", 0}, {"children", {3}}, {"extensions", hidden}},
                             {{"mesh", 0}, {"extensions", {{"KHR_node_visibility", json::object()}}}},
                             {{"mesh", 0}},
                             {{"mesh", 0}, {"extensions", hidden}}};
    builder.json["scenes"][0]["nodes"] = {0, 4};
    const Scene scene = read(builder);
    CHECK(scene.meshes.size() == 1);
    CHECK(scene.instances.empty());
    builder.json["nodes"][0]["extensions"] = hidden;
    CHECK(contains(refusal(builder), "the file's scene has no triangle"));
    builder.json["nodes"][0]["extensions"]["KHR_node_visibility"]["visible"] = 0;
    CHECK(contains(refusal(builder), "nodes[0].extensions.KHR_node_visibility.visible: 0 where"));
}

TEST_CASE("Colours of glTF above 1 are refused where surfaces would make light, rounded ones are 1", "[gltf]") {
    struct Case {
        const char *extension, *key;
        int count;
        glm::vec3 PrincipledMaterial::*color;
    };
    const Case cases[] = {
        {"", "baseColorFactor", 4, &PrincipledMaterial::base_color},
        {"KHR_materials_sheen", "sheenColorFactor", 3, &PrincipledMaterial::sheen_color},
        {"KHR_materials_diffuse_transmission", "diffuseTransmissionColorFactor", 3,
         &PrincipledMaterial::diffuse_transmission_color},
        {"KHR_materials_volume", "attenuationColor", 3, &PrincipledMaterial::attenuation_color},
    };
    for (const Case& c : cases) {
        const std::string owner =
            *c.extension ? fmt::format("extensions.{}", c.extension) : std::string("pbrMetallicRoughness");
        for (int component = 0; component < c.count; ++component) {
            const auto with = [&](double value) {
                json numbers = json::array();
                for (int i = 0; i < c.count; ++i) numbers.push_back(i == component ? value : 0.5);
                json material;
                if (*c.extension)
                    material["extensions"][c.extension][c.key] = numbers;
                else
                    material["pbrMetallicRoughness"][c.key] = numbers;
                return with_material(material);
            };
            const std::string place = fmt::format("materials[0].{}.{}[{}]", owner, c.key, component);
            CAPTURE(place);
            CHECK(refusal(with(1.5)) == place + ": 1.5 where 0 to 1 was expected");
            CHECK(refusal(with(-0.5)) == place + ": -0.5 where 0 to 1 was expected");
            const Scene scene = read(with(1.0005));
            CHECK(scene.warnings.empty());
            const PrincipledMaterial& m = scene.materials.at(0).principled.value();
            CHECK((component == 3 ? m.alpha : (m.*c.color)[component]) == 1.0f);
        }
    }
}

TEST_CASE("glTF's emission and lights above 1 are kept, colours of vertices limited, and both are told", "[gltf]") {
    GltfBuilder builder = with_material({{"emissiveFactor", {1, 4, 1}}});
    builder.json["materials"].push_back({{"emissiveFactor", {1.0005, 1, 1}}});
    builder.json["extensionsUsed"] = {"KHR_lights_punctual"};
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"color", {2, 1, 0}}}};
    builder.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    primitive(builder)["attributes"]["COLOR_0"] = builder.vec4({2, 1, 1, 1, 0.5f, -1, 0, 1.5f, 1.0005f, 0, 0, 1});
    const Scene scene = read(builder);
    CHECK(scene.materials.at(0).principled->emissive == glm::vec3(1, 4, 1));
    CHECK(scene.lights.at(0).point.intensity == glm::vec3(510, 255, 0));
    CHECK(scene.meshes.at(0).colors == std::vector<glm::vec4>{{1, 1, 1, 1}, {0.5f, 0, 0, 1}, {1, 0, 0, 1}});
    std::vector<std::string> texts;
    for (const Warning& warning : scene.warnings) texts.push_back(warning.text);
    CHECK(texts == std::vector<std::string>{
                       "materials[0].emissiveFactor: has numbers above 1, which glTF does not allow, and is used as it "
                       "is (and so for 1 more)",
                       "meshes[0].primitives[0].attributes.COLOR_0: has colours below 0 or above 1, which are limited "
                       "to these"});
    const float nan = std::numeric_limits<float>::quiet_NaN();
    primitive(builder)["attributes"]["COLOR_0"] = builder.vec4({1, nan, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1});
    CHECK(contains(refusal(builder), "attributes.COLOR_0: component 1 of element 0 of its accessor is nan"));
}

TEST_CASE("Coats, thin films and dispersion of a glTF file arrive in the columns, without a warning", "[gltf]") {
    const json picture = {{"index", 0}};
    json material = {{"normalTexture", picture}};
    json& extensions = material["extensions"];
    extensions["KHR_materials_clearcoat"] = {{"clearcoatFactor", 1},
                                             {"clearcoatNormalTexture", {{"index", 0}, {"scale", 0.5}}}};
    extensions["KHR_materials_iridescence"] = {
        {"iridescenceFactor", 0.5},          {"iridescenceIor", 1.75},
        {"iridescenceThicknessMinimum", 50}, {"iridescenceThicknessMaximum", 600},
        {"iridescenceTexture", picture},     {"iridescenceThicknessTexture", picture}};
    extensions["KHR_materials_transmission"] = {{"transmissionFactor", 1}};
    extensions["KHR_materials_volume"] = {{"thicknessFactor", 1}};
    extensions["KHR_materials_dispersion"] = {{"dispersion", 0.4}};
    GltfBuilder builder = with_material(material);
    for (const auto& [name, values] : extensions.items()) builder.json["extensionsUsed"].push_back(name);
    const TemporaryDirectory directory;
    const Scene scene = load_scene(directory.write("a.gltf", builder.gltf()));
    CHECK(scene.warnings.empty());
    const SceneArrays arrays = flatten(scene);
    REQUIRE(arrays.principled_materials.size() == 1);
    const shared::PrincipledMaterial& m = arrays.principled_materials[0];
    CHECK(m.clearcoat_normal_scale == 0.5f);
    CHECK(m.dispersion == 0.4f);
    CHECK((m.iridescence == 0.5f && m.iridescence_index == 1.75f && m.iridescence_thickness_minimum == 50.0f &&
           m.iridescence_thickness_maximum == 600.0f));
    for (const std::uint32_t slot :
         {CASTOR_SLOT_NORMAL, CASTOR_SLOT_CLEARCOAT_NORMAL, CASTOR_SLOT_IRIDESCENCE, CASTOR_SLOT_IRIDESCENCE_THICKNESS})
        CHECK(m.texture[slot] == 0);
    CHECK(m.texture[CASTOR_SLOT_CLEARCOAT] == CASTOR_INVALID_INDEX);
}

TEST_CASE("glTF files name buffers and pictures in their own folder alone", "[gltf]") {
    const TemporaryDirectory directory;
    GltfBuilder builder = one_triangle();
    directory.write("my data.bin", builder.bytes);
    builder.json["buffers"] = {{{"byteLength", builder.bytes.size()}, {"uri", "my%20data.bin"}}};
    const auto file = directory.write("a.gltf", builder.json.dump());
    CHECK(read_gltf(file).meshes.at(0).positions[1] == glm::vec3(1, 0, 0));
    const auto refused = [&](const std::string& uri) {
        builder.json["buffers"][0]["uri"] = uri;
        builder.bytes.clear();
        try {
            read_gltf(directory.write("a.gltf", builder.json.dump()));
        } catch (const SceneError& error) {
            return error.reason();
        }
        return std::string();
    };
    CHECK(refused("x/../my%20data.bin").empty());  // inside in the end
    std::filesystem::create_symlink("my data.bin", directory.path() / "link.bin");
    CHECK(refused("link.bin").empty());
    const TemporaryDirectory elsewhere;
    std::filesystem::create_symlink(elsewhere.write("b.bin", std::string(36, '\0')), directory.path() / "out.bin");
    std::filesystem::create_directory_symlink(elsewhere.path(), directory.path() / "out");
    for (const char* uri : {"../a.bin", "/etc/passwd", "x/../../a.bin", "%2e%2e/a.bin", "out.bin", "out/b.bin"}) {
        CAPTURE(uri);
        CHECK(contains(refused(uri), "buffers[0].uri: the URI"));
    }
    CHECK(refused("a%00.bin") == "buffers[0].uri: the URI \"a%00.bin\" has a byte 0");
    CHECK(contains(refused(""), "buffers[0].uri: an empty URI"));
    CHECK(contains(refused("..\\a.bin"), "buffers[0].uri: the URI \"..\\a.bin\" has a backslash where / was expected"));
    CHECK(contains(refused("http://a.b/c.bin"), "nothing is fetched"));
    CHECK(contains(refused("missing.bin"), "buffers[0].uri: "));
    CHECK(contains(refused("data:application/octet-stream;base64,AA=A"), "data URI are broken"));
    CHECK(contains(refused("data:application/octet-stream;base64,AAAA"), "byteLength is 36, but there are 3 bytes"));
}

TEST_CASE("Base64 and percent codes are decoded, and broken ones refused", "[gltf]") {
    for (const std::string text : {"", "a", "ab", "abc", "abcd", "\xff\x00\xfe"})
        CHECK(base64_decoded(test::base64(text)) == text);
    CHECK(base64_decoded("YWI") == "ab");
    for (const char* text : {"Y", "YW=I", "Y===", "Y W=", "YWI*"}) CHECK_FALSE(base64_decoded(text));
    CHECK(percent_decoded("a%20b%C3%a4") == "a b\xc3\xa4");
    CHECK(percent_decoded("%00a") == std::string("\0a", 2));
    for (const char* text : {"%", "%2", "%zz", "a%0"}) CHECK_FALSE(percent_decoded(text));
}

/// A text in which each byte is a percent code.
std::string percent_codes(const std::string& bytes) {
    std::string text;
    for (const unsigned char byte : bytes) text += fmt::format("%{:02X}", byte);
    return text;
}

TEST_CASE("Data URIs of glTF have bytes as base64, as percent codes or both, and names in any case", "[gltf]") {
    GltfBuilder builder = one_triangle();
    primitive(builder)["material"] = 0;
    builder.json["materials"] = {{{"emissiveTexture", {{"index", 0}}}}};
    builder.json["textures"] = {{{"source", 0}}};
    const std::string buffer = std::exchange(builder.bytes, ""),
                      picture = test::png_bytes(2, 1, 4, {10, 20, 30, 255, 40, 50, 60, 128});
    const auto with = [&](const std::string& buffer_uri, const std::string& picture_uri) {
        builder.json["buffers"] = {{{"byteLength", buffer.size()}, {"uri", buffer_uri}}};
        builder.json["images"] = {{{"uri", picture_uri}}};
        return builder;
    };
    struct Case {
        const char* head;
        bool is_base64, is_coded;
    };
    for (const Case& one :
         {Case{"data:,", false, true}, Case{"Data:a/b,", false, true}, Case{"data:a/b;base64,", true, false},
          Case{"data:;base64,", true, true}, Case{"DATA:a/b;BASE64,", true, false}}) {
        CAPTURE(one.head, one.is_coded);
        const auto uri = [&](const std::string& bytes) {
            const std::string text = one.is_base64 ? test::base64(bytes) : bytes;
            return one.head + (one.is_coded ? percent_codes(text) : text);
        };
        const Scene scene = read(with(uri(buffer), uri(picture)));
        CHECK(scene.meshes.at(0).positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        CHECK(scene.images.at(0).bytes == std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60});
    }
    for (const std::string wrong : {"data:;base64,%4", "data:;base64,%41*%41A", "data:,%0g"})
        CHECK(refusal(with(wrong, "data:,")) == "buffers[0].uri: the data of its data URI are broken");
    CHECK(refusal(with("data:;base64", "data:,")) == "buffers[0].uri: a data URI without a comma");
}

TEST_CASE("What is wrong in a glTF file is refused by its JSON path", "[gltf]") {
    struct Case {
        void (*damage)(GltfBuilder&);
        const char* message;
    };
    const Case cases[] = {
        {[](GltfBuilder& b) { b.json["asset"]["version"] = "1.0"; }, "asset.version: \"1.0\""},
        {[](GltfBuilder& b) { b.json.erase("asset"); }, "has no member \"asset\""},
        {[](GltfBuilder& b) { b.json["extensionsRequired"] = {"KHR_no_such"}; },
         "extensionsRequired[0]: the file requires \"KHR_no_such\""},
        {[](GltfBuilder& b) { b.json["accessors"][0]["byteOffset"] = 4; }, "accessors[0]: 3 elements of 12 bytes"},
        {[](GltfBuilder& b) { b.json["accessors"][0]["byteOffset"] = 18446744073709551615u; },
         "accessors[0]: 3 elements"},
        {[](GltfBuilder& b) { b.json["accessors"][0]["byteOffset"] = -1; },
         "accessors[0].byteOffset: -1 where a whole number"},
        {[](GltfBuilder& b) { b.json["accessors"][0]["count"] = 4000000000u; }, "accessors[0]: 4000000000 elements"},
        {[](GltfBuilder& b) { b.json["accessors"][0]["count"] = 1.5; }, "accessors[0].count: 1.5 where"},
        {[](GltfBuilder& b) { b.json["accessors"][0]["componentType"] = 5124; }, "accessors[0].componentType: 5124"},
        {[](GltfBuilder& b) { b.json["accessors"][0]["type"] = "VEC5"; }, "accessors[0].type: \"VEC5\""},
        {[](GltfBuilder& b) { b.json["accessors"][0]["type"] = "VEC2"; },
         "attributes.POSITION: its accessor has 2 components, expected 3"},
        {[](GltfBuilder& b) {
             b.json["accessors"][0].erase("bufferView");
             b.json["accessors"][0]["count"] = 100000000;
         },
         "without a bufferView"},
        {[](GltfBuilder& b) { b.json["bufferViews"][0]["byteStride"] = 8; }, "bufferViews[0].byteStride: 8 bytes"},
        {[](GltfBuilder& b) { b.json["bufferViews"][0]["byteStride"] = 253; }, "at most 252"},
        {[](GltfBuilder& b) { b.json["bufferViews"][0]["byteLength"] = 37; },
         "bufferViews[0]: bytes 0 to 37 of a buffer of 36"},
        {[](GltfBuilder& b) { b.json["bufferViews"][0]["byteOffset"] = 18446744073709551615u; },
         "bufferViews[0]: bytes"},
        {[](GltfBuilder& b) { b.json["bufferViews"][0]["buffer"] = 1; },
         "bufferViews[0].buffer: 1 is no index of buffers, of which there are 1"},
        {[](GltfBuilder& b) { b.json["nodes"][0]["mesh"] = 1; }, "nodes[0].mesh: 1 is no index of meshes"},
        {[](GltfBuilder& b) { b.json["nodes"][0]["children"] = {0}; }, "circle"},
        {[](GltfBuilder& b) {
             b.json["nodes"][0]["rotation"] = {0, 0, 0, 0};
         },
         "nodes[0].rotation"},
        {[](GltfBuilder& b) {
             b.json["nodes"][0]["translation"] = {0, 0};
         },
         "nodes[0].translation: 2 numbers where 3"},
        {[](GltfBuilder& b) {
             b.json["nodes"][0]["translation"] = {0, 0, "x"};
         },
         "nodes[0].translation[2]: \"x\" where a number"},
        {[](GltfBuilder& b) {
             b.json["nodes"][0]["translation"] = {1e300, 0, 0};
         },
         "nodes[0].translation[0]"},
        {[](GltfBuilder& b) {
             b.json["nodes"].push_back({{"children", {0}}});
             b.json["nodes"].push_back({{"children", {0}}});
         },
         "node 0 is a child of node 1 already"},
        {[](GltfBuilder& b) { b.json["scenes"][0]["nodes"] = {7}; }, "scenes[0].nodes[0]: 7 is no index"},
        {[](GltfBuilder& b) { b.json["scenes"][0]["nodes"] = json::array(); }, "no triangle"},
        {[](GltfBuilder& b) { primitive(b)["mode"] = 1; }, "no triangle; meshes[0].primitives[0]"},
        {[](GltfBuilder& b) {
             primitive(b)["indices"] = b.indices({0, 1, 3});
         },
         "indices: element 2 is vertex 3, but there are 3 vertices"},
        {[](GltfBuilder& b) {
             primitive(b)["indices"] = b.scalars({0, 1, 2});
         },
         "expected unsigned integers"},
        {[](GltfBuilder& b) { primitive(b)["mode"] = 7; }, "primitives[0].mode: 7"},
        {[](GltfBuilder& b) { primitive(b)["material"] = 0; }, "primitives[0].material: 0 is no index of materials"},
        {[](GltfBuilder& b) {
             primitive(b)["attributes"]["NORMAL"] = b.vec3({0, 0, 1});
         },
         "attributes.NORMAL: its accessor has 1 elements, expected 3"},
        {[](GltfBuilder& b) {
             const float nan = std::numeric_limits<float>::quiet_NaN();
             std::memcpy(b.bytes.data() + 16, &nan, 4);
         },
         "attributes.POSITION: component 1 of element 1 of its accessor is nan"},
        {[](GltfBuilder& b) { b.json["meshes"] = 5; }, "meshes: 5 where an array"},
    };
    for (const Case& wrong : cases) {
        GltfBuilder builder = one_triangle();
        wrong.damage(builder);
        CAPTURE(wrong.message);
        CHECK_THAT(refusal(builder), Catch::Contains(wrong.message));
    }
}

TEST_CASE("Broken JSON and broken chunks of glb files are refused by their bytes", "[gltf]") {
    CHECK(contains(refusal_of_text("{\"asset\": "), "byte "));
    CHECK(contains(refusal_of_text("[]"), "no object"));
    CHECK(contains(refusal_of_text("{\"asset\": 1e999}"), "its JSON: number overflow"));
    CHECK(contains(refusal_of_text("{\"asset\":{\"version\":\"2.0\"},\"a\":" + std::string(200000, '[')), "deep"));
    const std::string glb = one_triangle().glb();
    for (std::size_t size = 0; size < glb.size(); size += 7) {
        CAPTURE(size);
        CHECK_FALSE(refusal_of_text(glb.substr(0, size)).empty());
    }
    std::string wrong = glb;
    wrong[4] = 3;
    CHECK(contains(refusal_of_text(wrong), "byte 4: is glTF 3"));
    wrong = glb;
    wrong[8] = wrong[9] = 0;
    CHECK(contains(refusal_of_text(wrong), "byte 8: the file should have 0 bytes, where at least 20 were expected"));
    wrong = glb;
    wrong[13] = '\x7f';
    CHECK(contains(refusal_of_text(wrong), "byte 12: a chunk"));
    wrong = glb;
    wrong[16] = 'X';
    CHECK(contains(refusal_of_text(wrong), "byte 12: the first chunk"));
}

TEST_CASE("A glTF file of few bytes cannot ask for very many triangles", "[gltf]") {
    GltfBuilder builder = one_triangle();
    const std::size_t positions = builder.vec3(std::vector<float>(30000));
    json& primitives = builder.json["meshes"][0]["primitives"];
    for (int i = 0; i < 20000; ++i) {
        // Strides that differ keep the meshes apart.
        builder.json["accessors"].push_back(builder.json["accessors"][positions]);
        primitives.push_back({{"attributes", {{"POSITION", builder.json["accessors"].size() - 1}}}, {"mode", 5}});
    }
    CHECK(contains(refusal(builder), "data are used too often"));
}

TEST_CASE("A glTF file cannot ask for the same joints or weights again and again", "[gltf]") {
    constexpr int kMany = 1500;
    GltfBuilder builder = one_triangle();
    json& nodes = builder.json["nodes"];
    json joints = json::array(), shown = json::array(), weights = json::array();
    for (int i = 0; i < kMany; ++i) {
        nodes.push_back({{"mesh", 0}});
        joints.push_back(i);
        shown.push_back(i);
        weights.push_back(0);
    }
    builder.json["scenes"][0]["nodes"] = shown;
    builder.json["meshes"][0]["weights"] = weights;
    CHECK(contains(refusal(builder), "meshes[0]: with it, the file's"));
    builder.json["meshes"][0].erase("weights");
    CHECK(refusal(builder).empty());
    builder.json["skins"] = {{{"joints", joints}}};
    primitive(builder)["attributes"]["JOINTS_0"] = builder.accessor(std::vector<std::uint8_t>(12, 0), "VEC4", 4, 5121);
    primitive(builder)["attributes"]["WEIGHTS_0"] = builder.vec4({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
    for (json& node : nodes) node["skin"] = 0;
    CHECK(contains(refusal(builder), "skins[0].joints: with it, the file's"));
}

TEST_CASE("Thousands of nested glTF nodes are read without recursion", "[gltf]") {
    GltfBuilder builder = one_triangle();
    json nodes = json::array();
    for (int i = 0; i < 20000; ++i) nodes.push_back({{"children", {i + 1}}, {"translation", {0.5, 0, 0}}});
    nodes.push_back({{"mesh", 0}});
    builder.json["nodes"] = nodes;
    CHECK(read(builder).meshes.at(0).transform[3] == glm::vec3(10000, 0, 0));
}

TEST_CASE("A glTF scene without camera and light gets a view of the whole, and a studio's environment", "[gltf]") {
    const TemporaryDirectory directory;
    GltfBuilder builder = with_material(
        {{"pbrMetallicRoughness",
          {{"baseColorTexture", {{"index", 0}}}, {"baseColorFactor", {0.5, 1, 1, 1}}, {"metallicFactor", 0.5}}}});
    const auto file = directory.write("a.glb", builder.glb());
    const Scene scene = load_scene(file);
    REQUIRE(scene.cameras.size() == 1);
    REQUIRE(scene.cameras[0].tone_maps.size() == 1);
    CHECK(scene.cameras[0].tone_maps[0].is_srgb);
    CHECK(scene.cameras[0].tone_maps[0].tone_operator == ToneOperator::linear);
    REQUIRE(scene.lights.size() == 1);
    CHECK(scene.lights[0].kind == Light::Kind::environment);
    CHECK(scene.background == glm::vec3(0.0f));
    CHECK(flatten(scene).triangle_count() == 1);
    // A white surface that faces up sends 0.7 of white: the mean of radiance times cosine over the upper half.
    const Image& studio = scene.images[scene.lights[0].environment.image];
    double sum = 0.0;
    for (std::uint32_t y = 0; y < studio.height / 2; ++y) {
        const double down = 3.14159265358979 * (y + 0.5) / studio.height;
        for (std::uint32_t x = 0; x < studio.width; ++x)
            sum += double{studio.floats[3 * (std::size_t{y} * studio.width + x)]} * std::cos(down) * std::sin(down);
    }
    const double texel = 2 * 3.14159265358979 / studio.width * 3.14159265358979 / studio.height;
    CHECK(sum * texel / 3.14159265358979 / 255.0 == Approx(0.7).margin(0.03));
    CHECK(scene.cameras[0].path_tracing.has_value());

    // Colours without shading, and pictures of emissions of at most 1, do not light a scene.
    json& material = builder.json["materials"][0];
    const auto studios = [&] {
        const Scene read = load_scene(directory.write("b.glb", builder.glb()));
        return std::count_if(read.lights.begin(), read.lights.end(),
                             [](const Light& light) { return light.kind == Light::Kind::environment; });
    };
    material["emissiveFactor"] = {1, 1, 1};
    CHECK(studios() == 0);
    material["emissiveTexture"] = {{"index", 0}};
    CHECK(studios() == 1);
    material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 2;
    CHECK(studios() == 0);
    material["extensions"]["KHR_materials_unlit"] = json::object();
    CHECK(studios() == 1);

    LoadOptions options;
    options.environment = directory.write("sky.hdr", test::hdr_bytes(2, 1, {1, 1, 1, 0.5f, 0.5f, 0.5f}));
    const Scene lit = load_scene(file, options);
    REQUIRE(lit.lights.size() == 1);
    CHECK(lit.images[lit.lights[0].environment.image].floats[3] == Approx(127.5).margin(1));
    options.time_seconds = 1.0;
    CHECK(load_scene(file, options).warnings.size() == 1);  // there is no animation
    LoadOptions timeless;
    timeless.animation = "all";
    CHECK_THROWS_AS(load_scene(file, timeless), UsageError);
    CHECK_THROWS_AS(load_scene(directory.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), options), UsageError);
}

}  // namespace
}  // namespace castor
