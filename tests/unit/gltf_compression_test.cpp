// Files that Draco, meshoptimizer and libwebp compressed.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "scene/gltf_draco.h"
#include "scene/gltf_meshopt.h"
#include "scene/gltf_reader.h"
#include "support/catch.h"
#include "support/compressed_gltf.h"
#include "support/picture_bytes.h"
#include "support/temporary_directory.h"

namespace castor {
namespace {

using nlohmann::json;
using test::GltfBuilder;
using test::Surface;
using test::TemporaryDirectory;

const TemporaryDirectory& folder() {
    static const TemporaryDirectory kFolder;
    return kFolder;
}

Scene read(GltfBuilder builder) {
    return read_gltf(folder().write("scene.glb", builder.glb()));
}

/// The message with which a file is refused; empty where it is read.
std::string refusal(GltfBuilder builder) {
    try {
        read(std::move(builder));
    } catch (const SceneError& error) {
        return error.reason();
    }
    return "";
}

using Triangle = std::array<std::uint32_t, 3>;

/// The triangle, beginning with its smallest vertex, so that the order of its corners alone counts.
Triangle turned(Triangle triangle) {
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    return triangle;
}

/// Compares a mesh with the surface, whatever the order of its vertices and triangles.
void check_surface(const Mesh& mesh, float position_tolerance) {
    const Surface surface;
    REQUIRE(mesh.positions.size() == surface.vertex_count());
    REQUIRE(mesh.normals.size() == mesh.positions.size());
    REQUIRE(mesh.texture_coordinates.size() == mesh.positions.size());
    REQUIRE(mesh.colors.size() == mesh.positions.size());
    std::vector<std::uint32_t> numbers;  // in the surface
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::vec3 p = mesh.positions[i];
        const float x = std::round(p.x), y = std::round(p.y);
        CAPTURE(i, p.x, p.y, p.z);
        CHECK(std::abs(p.x - x) <= position_tolerance);
        CHECK(std::abs(p.y - y) <= position_tolerance);
        CHECK(std::abs(p.z - x * y / 4.0f) <= position_tolerance);
        CHECK(mesh.normals[i].z >= 0.9999f);
        CHECK(std::abs(mesh.texture_coordinates[i].x - x / 4.0f) <= 1e-4f);
        CHECK(std::abs(mesh.texture_coordinates[i].y - y / 4.0f) <= 1e-4f);
        CHECK(mesh.colors[i] == glm::vec4(x / 255.0f, y / 255.0f, 0.0f, 1.0f));
        numbers.push_back(static_cast<std::uint32_t>(x) + Surface::kEdge * static_cast<std::uint32_t>(y));
    }
    std::vector<Triangle> found, expected;
    for (const glm::uvec3& t : mesh.triangles) found.push_back(turned({numbers[t.x], numbers[t.y], numbers[t.z]}));
    for (std::size_t i = 0; i < surface.indices.size(); i += 3)
        expected.push_back(turned({surface.indices[i], surface.indices[i + 1], surface.indices[i + 2]}));
    std::sort(found.begin(), found.end());
    std::sort(expected.begin(), expected.end());
    CHECK(found == expected);
}

json& draco(GltfBuilder& builder) {
    return builder.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
}

json& meshopt(GltfBuilder& builder, std::size_t view) {
    return builder.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"];
}

struct Case {
    std::function<void(GltfBuilder&)> damage;
    const char* message;
};

void check_refusals(const GltfBuilder& builder, const std::vector<Case>& cases) {
    for (const Case& wrong : cases) {
        GltfBuilder damaged = builder;
        wrong.damage(damaged);
        CAPTURE(wrong.message);
        CHECK_THAT(refusal(damaged), Catch::Contains(wrong.message));
    }
}

/// Checks that damaged bytes end with a message, or are read.
void check_damaged_bytes(const std::vector<GltfBuilder>& builders, unsigned count) {
    std::mt19937 random(7);
    for (const GltfBuilder& builder : builders)
        for (unsigned i = 0; i < count; ++i) {
            GltfBuilder damaged = builder;
            for (unsigned change = 0; change <= i % 3; ++change)
                damaged.bytes[random() % damaged.bytes.size()] = static_cast<char>(random());
            if (i % 5 == 0) std::fill(damaged.bytes.end() - random() % damaged.bytes.size(), damaged.bytes.end(), '\0');
            CAPTURE(i);
            CHECK_NOTHROW(refusal(damaged));
        }
}

TEST_CASE("A glTF mesh that Draco compressed has its triangles and attributes", "[gltf][draco]") {
    if (!decodes_draco()) {
        WARN("skipped: this build has no Draco");
        return;
    }
    for (const bool is_sequential : {false, true}) {
        CAPTURE(is_sequential);
        const Scene scene = read(test::draco_gltf(is_sequential));
        CHECK(scene.warnings.empty());
        check_surface(scene.meshes.at(0), 1e-3f);
    }
    // A primitive that is a strip has a list all the same.
    GltfBuilder strip = test::draco_gltf(false);
    strip.json["meshes"][0]["primitives"][0]["mode"] = 5;
    strip.json["meshes"][0]["primitives"][0].erase("indices");
    check_surface(read(strip).meshes.at(0), 1e-3f);
    // Morph targets are not compressed.
    GltfBuilder morphed = test::draco_gltf(true);
    std::vector<float> up(3 * Surface().vertex_count());
    for (std::size_t i = 2; i < up.size(); i += 3) up[i] = 2.0f;
    morphed.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", morphed.vec3(up)}}};
    morphed.json["meshes"][0]["weights"] = {0.5};
    CHECK(read(morphed).meshes.at(0).positions[0].z == Approx(1.0f).margin(1e-3));
}

TEST_CASE("Draco data that are not what a glTF file says are refused", "[gltf][draco]") {
    if (!decodes_draco()) {
        WARN("skipped: this build has no Draco");
        return;
    }
    const auto first_byte = [](const GltfBuilder& b) {
        return b.json["bufferViews"].back()["byteOffset"].get<std::size_t>();
    };
    for (const bool is_sequential : {false, true}) {
        CAPTURE(is_sequential);
        const GltfBuilder builder = test::draco_gltf(is_sequential);
        check_refusals(
            builder,
            {{[](GltfBuilder& b) { draco(b)["bufferView"] = 9; }, "bufferView: 9 is no index of bufferViews"},
             {[](GltfBuilder& b) { draco(b).erase("attributes"); }, "has no member \"attributes\""},
             {[](GltfBuilder& b) { draco(b)["attributes"]["NORMAL"] = 77; },
              "attributes.NORMAL: the Draco data have no attribute 77"},
             {[](GltfBuilder& b) { draco(b)["attributes"]["NORMAL"] = -1; }, "attributes.NORMAL: -1 where"},
             {[](GltfBuilder& b) { draco(b)["attributes"]["NORMAL"] = draco(b)["attributes"]["TEXCOORD_0"]; },
              "attributes.NORMAL: its accessor has 3 components, expected 2"},
             {[](GltfBuilder& b) { b.json["accessors"][1]["count"] = 24; }, "POSITION has 24 elements"},
             {[](GltfBuilder& b) { b.json["accessors"][1]["count"] = 26; },
              "its Draco data have 25 vertices, but POSITION has 26 elements"},
             {[](GltfBuilder& b) { b.json["accessors"][2]["count"] = 26; },
              "attributes.NORMAL: its accessor has 26 elements, but the compressed mesh has 25 vertices"},
             {[](GltfBuilder& b) { b.json["accessors"][4]["componentType"] = 5126; },
              "attributes.COLOR_0: its accessor has componentType 5126, but the compressed mesh has integers"},
             {[](GltfBuilder& b) { b.json["accessors"][4]["componentType"] = 5120; },
              "of the compressed mesh is 255, which componentType 5120 does not hold"},
             {[](GltfBuilder& b) { b.json["accessors"][5]["count"] = 93; },
              "its Draco data have 32 triangles, but the accessor of indices has 93 elements"},
             {[](GltfBuilder& b) { b.json["meshes"][0]["primitives"][0]["mode"] = 6; }, "a triangle fan"},
             {[&](GltfBuilder& b) { b.bytes[first_byte(b)] = 'd'; }, "do not begin as Draco's do"},
             {[&](GltfBuilder& b) { b.bytes[first_byte(b) + 6] = 1; }, "of Draco's version 2.1, expected 2.2"},
             {[&](GltfBuilder& b) { b.bytes[first_byte(b) + 7] = 0; }, "no mesh of Draco's"},
             {[&](GltfBuilder& b) { b.bytes[first_byte(b) + 10] = '\x80'; },
              "KHR_draco_mesh_compression: its Draco data"},
             {[](GltfBuilder& b) { b.json["bufferViews"].back()["byteLength"] = 5; }, "do not begin as Draco's do"},
             {[](GltfBuilder& b) { b.json["bufferViews"].back()["byteLength"] = 12; }, "end within their header"},
             {[](GltfBuilder& b) { b.json["bufferViews"].back()["byteLength"] = 60; }, "its Draco data are broken"}});
    }
    check_damaged_bytes({test::draco_gltf(false), test::draco_gltf(true)}, 150);
}

TEST_CASE("Few bytes of Draco's cannot ask for very many triangles or attributes", "[gltf][draco]") {
    if (!decodes_draco()) {
        WARN("skipped: this build has no Draco");
        return;
    }
    GltfBuilder builder = test::draco_gltf(true);
    const std::size_t first = builder.json["bufferViews"].back()["byteOffset"];
    // The number of triangles, 32, in Draco's variable length: 2^31 - 1 instead.
    REQUIRE(builder.bytes[first + 11] == 32);
    builder.bytes.replace(first + 11, 5, "\xff\xff\xff\xff\x07");
    builder.json["accessors"][5]["count"] = 6442450941u;
    CHECK_THAT(refusal(builder), Catch::Contains("data are used too often"));
    builder.json["meshes"][0]["primitives"][0].erase("indices");
    CHECK_THAT(refusal(builder), Catch::Contains("data are used too often"));
    CHECK(refusal(test::draco_gltf(false, 12)).empty());
    CHECK_THAT(refusal(test::draco_gltf(false, 13)), Catch::Contains("have 17 attributes, expected at most 16"));
}

TEST_CASE("glTF buffer views that meshoptimizer compressed have their elements", "[gltf][meshopt]") {
    if (!decodes_meshopt()) {
        WARN("skipped: this build has no meshoptimizer");
        return;
    }
    for (const bool has_index_sequence : {false, true}) {
        CAPTURE(has_index_sequence);
        const Scene scene = read(test::meshopt_gltf(has_index_sequence));
        CHECK(scene.warnings.empty());
        Mesh mesh = scene.meshes.at(0);
        for (glm::vec3& position : mesh.positions) position /= 4.0f;
        check_surface(mesh, 0.0f);
        REQUIRE(scene.instances.size() == 1);
        const Transform& turned = scene.instances[0].transform;  // by the quaternion (0, 0, 0.6, 0.8), then scaled
        CHECK(4.0f * turned[0].x == Approx(0.28f).margin(1e-3));
        CHECK(4.0f * turned[0].y == Approx(0.96f).margin(1e-3));
    }
}

TEST_CASE("Compressed glTF buffer views that are not what they say are refused", "[gltf][meshopt]") {
    if (!decodes_meshopt()) {
        WARN("skipped: this build has no meshoptimizer");
        return;
    }
    const GltfBuilder builder = test::meshopt_gltf(false);
    constexpr std::size_t kPositions = 1, kNormals = 2, kIndices = 5;
    check_refusals(
        builder,
        {{[](GltfBuilder& b) { meshopt(b, kPositions)["byteLength"] = 20; }, "in mode ATTRIBUTES: code -"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["byteLength"] = 100000; }, "EXT_meshopt_compression: bytes "},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["byteOffset"] = 1; }, "in mode ATTRIBUTES: code -"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["buffer"] = 1; }, "buffers[1]: has no URI"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["count"] = 4000000000u; }, "cannot be in"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["count"] = 24; },
          "byteLength is 200, but the compressed data make 192 bytes"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["byteStride"] = 6; },
          "byteStride: 6 bytes where a multiple of 4 up to 256"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["byteStride"] = 0; }, "byteStride: 0 bytes"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["byteStride"] = 260; }, "byteStride: 260 where at most 256"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["mode"] = "POINTS"; }, "mode: \"POINTS\" is none of"},
         {[](GltfBuilder& b) { meshopt(b, kPositions)["filter"] = "X"; }, "filter: \"X\" is none of"},
         {[](GltfBuilder& b) { b.json["bufferViews"][kPositions]["byteLength"] = 201; },
          "byteLength is 201, but the compressed data make 200 bytes"},
         {[](GltfBuilder& b) { meshopt(b, kNormals)["filter"] = "QUATERNION"; }, "byteStride: 4 bytes where 8"},
         {[](GltfBuilder& b) { meshopt(b, kIndices)["count"] = 95; }, "count: 95 where a multiple of 3"},
         {[](GltfBuilder& b) { meshopt(b, kIndices)["byteStride"] = 3; }, "byteStride: 3 bytes where 2 or 4"},
         {[](GltfBuilder& b) { meshopt(b, kIndices)["mode"] = "INDICES"; }, "in mode INDICES: code -"}});
    check_damaged_bytes({builder, test::meshopt_gltf(true)}, 150);
}

TEST_CASE("A WebP picture takes the place of the other in a glTF texture", "[gltf][webp]") {
    if (!test::has_webp()) {
        WARN("skipped: this build has no libwebp");
        return;
    }
    const Scene scene = read(test::webp_gltf());
    REQUIRE(scene.images.size() == 1);
    CHECK(scene.images[0].bytes == std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60});
    CHECK(scene.images[0].alpha == std::vector<std::uint8_t>{255, 128});
    CHECK(scene.warnings.empty());
    check_refusals(test::webp_gltf(), {{[](GltfBuilder& b) { b.json["bufferViews"].back()["byteLength"] = 20; },
                                        "images[1]: the header of the WebP file is broken"},
                                       {[](GltfBuilder& b) {
                                            const std::size_t length = b.json["bufferViews"].back()["byteLength"];
                                            b.json["bufferViews"].back()["byteLength"] = length - 8;
                                        },
                                        "images[1]: the WebP file is broken, or ends before its picture does"}});
    check_damaged_bytes({test::webp_gltf()}, 150);
}

TEST_CASE("Many WebP pictures of few bytes cannot ask for very many texels", "[gltf][webp]") {
    if (!test::has_webp()) {
        WARN("skipped: this build has no libwebp");
        return;
    }
    constexpr std::uint32_t kEdge = 2048;
    const std::string picture = test::webp_bytes(kEdge, kEdge, std::vector<std::uint8_t>(4 * kEdge * kEdge, 128));
    GltfBuilder builder = test::webp_gltf();
    const std::size_t view = builder.view(std::vector<char>(picture.begin(), picture.end()));
    builder.json["images"][1]["bufferView"] = view;
    CHECK(refusal(builder).empty());
    json material = builder.json["materials"][0];
    for (int i = 0; i < 40; ++i) {
        builder.json["images"].push_back(builder.json["images"][1]);
        json texture;
        texture["extensions"]["EXT_texture_webp"]["source"] = 2 + i;
        builder.json["textures"].push_back(texture);
        material["emissiveTexture"]["index"] = 1 + i;
        builder.json["materials"].push_back(material);
    }
    CHECK_THAT(refusal(builder), Catch::Contains("with it, the pictures of"));
}

}  // namespace
}  // namespace castor
