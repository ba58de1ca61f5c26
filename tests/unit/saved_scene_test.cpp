#include "trace/saved_scene.h"

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "base/section_file.h"
#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "castor/tracer.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/child_process.h"
#include "support/kernel_fixture.h"
#include "support/scene_twins.h"
#include "support/temporary_directory.h"
#include "trace/scene_contents.h"

namespace castor::test {
namespace {

namespace fs = std::filesystem;

const std::vector<StrategyChoice> kAllTrees{StrategyChoice::all(Strategy::wide), StrategyChoice::all(Strategy::simt)};

Scene scene_of_everything() {
    RandomSource random(51);
    Mesh smooth = bumpy_sphere(2);
    compute_smooth_normals(smooth);
    Scene scene = scene_of({random_triangles(random, 3000, 0.2f), smooth});
    scene.file = "a scene";
    for (int i = 0; i < 20; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.05f, 0.3f), 0, 7});
    scene.planes.push_back({{0, -1, 0}, {0, 1, 0}, 0, 0});
    scene.instances.push_back(
        {1, Transform(glm::vec3(0, 0.5f, 0), glm::vec3(-0.5f, 0, 0), glm::vec3(0, 0, 0.25f), glm::vec3(1, 0, 0)), 0});
    scene.spheres.back().transform[1] *= 2.0f;
    scene.lights.resize(3);
    scene.lights[1].kind = Light::Kind::directional;
    scene.lights[2].kind = Light::Kind::spot;
    scene.lights[2].spot.falloff = SpotFalloff::square;
    scene.lights[2].names = {"Spot.001", "näme"};
    scene.materials[0].kind = MaterialKind::mirror;
    scene.materials[0].mirror = scene.materials[0].diffuse = {0.25f, 0.5f, 0.75f};
    scene.ambient_light = {1, 2, 3};
    scene.background = {4, 5, 6};
    scene.shadow_ray_epsilon = 0.125f;
    scene.max_recursion_depth = 3;
    scene.cameras.resize(2);
    scene.cameras[0].image_name = "näme.png";
    scene.cameras[0].position = {0, 0, 4};
    scene.cameras[0].width = 40;
    scene.cameras[0].height = 30;
    scene.cameras[0].line = 12;
    scene.cameras[1].t_max = 3;
    scene.cameras[1].left_handed = true;
    scene.cameras[1].aperture_size = 0.25f;
    scene.cameras[1].focus_distance = 7;
    scene.cameras[1].tone_maps = {{ToneOperator::aces, 0.25f, 2, 0.5f, true, 2, "_a.png"}, {}};
    scene.lights.emplace_back().kind = Light::Kind::area;
    scene.lights.back().area.size = 3;
    scene.materials[0].absorption = {1, 2, 3};
    scene.materials[0].roughness = 0.5f;
    scene.materials[0].brdf = BrdfModel::modified_phong;
    scene.materials[0].brdf_normalized = true;
    scene.warnings.push_back({"file", 3, "text"});
    return scene;
}

std::vector<Ray> some_rays() {
    RandomSource random(52);
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; ++i) rays.push_back(make_ray(random.in_box(-2, 2), random.in_box(-1, 1)));
    return rays;
}

/// All columns' bytes, and all else.
std::vector<std::string> contents_of(const SceneContents& prepared) {
    std::vector<std::string> contents;
    for_each_column_of_chunks(prepared, [&](const std::string& name, const auto& column) {
        contents.push_back(name);
        contents.push_back({reinterpret_cast<const char*>(column.data()), column.size() * sizeof column[0]});
    });
    return contents;
}

std::string reason_of(const fs::path& file) {
    try {
        map_saved_scene(file);
    } catch (const SceneError& error) {
        CHECK(error.file() == file.string());
        return error.reason();
    }
    return "";
}

/// Where each section begins, as the file says.
struct SectionPlace {
    std::string name;
    std::uint64_t begin, bytes;
};
std::vector<SectionPlace> sections_of(const std::string& file) {
    const auto number = [&](std::size_t at) {
        std::uint64_t value = 0;
        std::memcpy(&value, file.data() + at, sizeof value);
        return value;
    };
    std::vector<SectionPlace> places;
    for (std::uint64_t i = 0; i < number(24); ++i) {
        const std::size_t entry = 72 + i * 96;
        places.push_back({file.c_str() + entry, number(entry + 72), number(entry + 64) * number(entry + 80)});
    }
    return places;
}

}  // namespace

TEST_CASE("a saved scene is the scene that was built", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    const SceneContents built = build_scene(scene_of_everything(), kAllTrees);
    save_scene(file, built);
    const SceneContents mapped = map_saved_scene(file);
    CHECK(contents_of(mapped) == contents_of(built));
    for_each_column_of_chunks(mapped, [&](const std::string& name, const auto& column) {
        CAPTURE(name);
        const auto* begin = reinterpret_cast<const char*>(column.data());
        const std::string_view bytes = mapped.file->bytes();
        if (column.empty()) return;
        CHECK((begin >= bytes.data() && begin + column.size() * sizeof column[0] <= bytes.data() + bytes.size()));
        CHECK(reinterpret_cast<std::uintptr_t>(begin) % kSectionPageBytes == 0);
    });
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(mapped.bounds().lower[axis] == built.bounds().lower[axis]);
        CHECK(mapped.bounds().upper[axis] == built.bounds().upper[axis]);
    }
    CHECK(mapped.arrays().largest_coordinate() == built.arrays().largest_coordinate());
    for (std::size_t i = 0; i < built.chunks.size(); ++i) {
        CHECK(mapped.chunks[i].compressed_levels == built.chunks[i].compressed_levels);
        CHECK(mapped.chunks[i].wide_root == built.chunks[i].wide_root);
    }
    CHECK((mapped.has_wide() && mapped.has_compressed()));
    CHECK(mapped.counts.triangles == built.counts.triangles);
    CHECK(mapped.description.file == file.string());
    CHECK(describe(mapped.description) == describe(built.description));
    REQUIRE(mapped.description.cameras.size() == 2);
    CHECK(mapped.description.cameras[0].image_name == "näme.png");
    CHECK(mapped.description.cameras[0].line == 12);
    CHECK(mapped.description.cameras[0].t_max == std::numeric_limits<float>::infinity());
    CHECK(mapped.description.cameras[1].left_handed);
    CHECK(mapped.description.cameras[1].t_max == 3.0f);
    CHECK(mapped.description.lights.at(2).kind == Light::Kind::spot);
    CHECK(mapped.description.lights.at(2).spot.falloff == SpotFalloff::square);
    CHECK(mapped.description.lights.at(2).names == built.description.lights.at(2).names);
    CHECK(mapped.description.materials.at(0).kind == MaterialKind::mirror);
    CHECK(mapped.description.warnings.at(0).text == "text");

    // What is mapped is saved again as the same bytes.
    const fs::path again = directory.path() / "again.castor";
    save_scene(again, mapped);
    CHECK(file_contents(again) == file_contents(file));
    // A copy has memory of its own, and a moved column stays where it is.
    Column<glm::vec3> copy = mapped.arrays().vertex_position;
    copy[0] = {9, 9, 9};
    CHECK(mapped.arrays().vertex_position[0] != copy[0]);
    SceneContents moved = map_saved_scene(file);
    const void* const place = moved.arrays().vertex_position.data();
    SceneContents target;
    target = std::move(moved);
    CHECK(target.arrays().vertex_position.data() == place);
}

TEST_CASE("a saved scene says of images and textures what the scene says", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    Scene scene = scene_of_everything();
    scene.images = {{"a.png", 2, 1, {1, 2, 3, 4, 5, 6}, {}}};
    Texture picture, noise;
    picture.target = TextureTarget::background;
    picture.wrap = TextureWrap::clamp;
    noise.kind = TextureKind::perlin;
    noise.noise_octaves = 3;
    noise.line = 7;
    scene.textures = {picture, noise};
    scene.background_texture = 0;
    scene.materials.at(0).textures = {1, 1};
    save_scene(file, build_scene(scene, kAllTrees));
    const Scene saved = map_saved_scene(file).description;
    REQUIRE(saved.images.size() == 1);
    CHECK(saved.images[0].file == "a.png");
    CHECK(saved.images[0].width == 2);
    CHECK(saved.images[0].height == 1);
    CHECK(saved.images[0].bytes.empty());
    REQUIRE(saved.textures.size() == 2);
    CHECK(saved.textures[0].wrap == TextureWrap::clamp);
    CHECK(saved.textures[1].kind == TextureKind::perlin);
    CHECK(saved.textures[1].noise_octaves == 3);
    CHECK(saved.textures[1].line == 7);
    CHECK(saved.background_texture == 0u);
    CHECK(saved.materials.at(0).textures == std::vector<std::uint32_t>{1, 1});

    scene.textures.clear();
    scene.materials[0].textures.clear();
    scene.background_texture.reset();
    SceneContents forged = build_scene(scene, kAllTrees);
    forged.description.images.clear();
    save_scene(file, forged);
    CHECK(reason_of(file).find("there are 0 images, expected 1, as many as its section texture_images has") !=
          std::string::npos);
}

TEST_CASE("a scene of nothing is saved too", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    save_scene(file, build_scene(Scene{}, kAllTrees));
    SceneContents mapped = map_saved_scene(file);
    CHECK(mapped.has_wide());
    CHECK(mapped.chunks.front().wide_nodes.empty());
    CHECK_FALSE(add_trees(mapped, needs_of(kAllTrees)));
}

TEST_CASE("pictures and hits of a saved scene are those of the scene", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    const Device device = test_device();
    const Scene scene = scene_of_everything();
    const std::vector<Ray> rays = some_rays();
    std::vector<Hit> expected(rays.size()), found(rays.size());
    Tracer(scene, {device}).closest_hit(rays, expected);
    Renderer renderer(scene, {device});
    const Film expected_film = renderer.render(scene.cameras[0], {.samples_per_pixel = 2});

    for (const Strategy built_for : {Strategy::automatic, Strategy::brute}) {
        BuiltScene(scene, {device}, {.strategy = built_for}).save(file);
        const BuiltScene saved = load_built_scene(file);
        for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
            CAPTURE(to_string(built_for), to_string(strategy));
            Tracer tracer(saved, {device}, {.strategy = strategy});
            std::fill(found.begin(), found.end(), Hit{});
            tracer.closest_hit(rays, found);
            CHECK(std::memcmp(found.data(), expected.data(), rays.size() * sizeof(Hit)) == 0);
        }
        Renderer of_saved(saved, {device});
        CHECK(of_saved.warnings().size() == renderer.warnings().size());
        const Film film = of_saved.render(saved.description().cameras.at(0), {.samples_per_pixel = 2});
        CHECK(film.pixels == expected_film.pixels);
    }
}

TEST_CASE("a tree that a saved scene has not is built, and that is told", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    const Device device = test_device();
    const Scene scene = scene_of_everything();
    BuiltScene(scene, {device}, {.strategy = Strategy::wide}).save(file);
    const BuiltScene saved = load_built_scene(file);
    const std::size_t others = Tracer(saved, {device}, {.strategy = Strategy::packet}).warnings().size();
    const Tracer tracer(saved, {device}, {.strategy = Strategy::simt});
    REQUIRE(tracer.warnings().size() == others + 1);
    CHECK(tracer.warnings().back().file == file.string());
    CHECK(tracer.warnings().back().text.find("without a compressed tree") != std::string::npos);
}

TEST_CASE("the sections of version 24", "[saved]") {
    // A change here is a change of kSectionFileVersion.
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    save_scene(file, build_scene(scene_of_everything(), kAllTrees));
    const std::string bytes = file_contents(file);
    std::string list;
    for (const SectionPlace& place : sections_of(bytes)) list += place.name + " ";
    CHECK(kSectionFileVersion == 24);
    CHECK(list ==
          "settings vertex_position triangle_vertices vertex_normal vertex_uv vertex_attributes sphere_center_radius "
          "sphere_material primitive_numbers compressed_nodes compressed_primitives wide_nodes triangle_blocks "
          "sphere_blocks mesh_ranges plane_point plane_normal plane_material geometries instances materials "
          "principled_materials lights textures "
          "texture_uses texture_images texels emitters environment_parts light_nodes compressed_roots wide_roots "
          "instance_nodes wide_instance_nodes ");
}

TEST_CASE("any damaged byte of a saved scene is found, and its section named", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    save_scene(file, build_scene(scene_of_everything(), kAllTrees));
    const std::string whole = file_contents(file);
    REQUIRE(reason_of(file).empty());
    RandomSource random(53);
    const auto flipped = [&](std::size_t at) {
        std::string bad = whole;
        bad[at] = static_cast<char>(bad[at] ^ (1 << random.below(8)));
        directory.write("s.castor", bad);
        return reason_of(file);
    };
    for (const SectionPlace& place : sections_of(whole)) {
        CAPTURE(place.name, place.begin, place.bytes);
        if (place.bytes == 0) continue;
        for (const std::uint64_t at : {std::uint64_t{0}, place.bytes / 2, place.bytes - 1}) {
            CAPTURE(at);
            const std::string reason = flipped(place.begin + at);
            CHECK(reason.find("the checksum of its section " + place.name + " (bytes " + std::to_string(place.begin) +
                              " to ") != std::string::npos);
            CHECK(reason.find(", expected ") != std::string::npos);
        }
    }
    for (int i = 0; i < 300; ++i) {  // between the sections, too
        const std::size_t at = random.below(static_cast<std::uint32_t>(whole.size()));
        CAPTURE(at);
        CHECK_FALSE(flipped(at).empty());
    }
    for (std::size_t at = 0; at < 1800; ++at) {
        CAPTURE(at);
        REQUIRE_FALSE(flipped(at).empty());
    }
}

TEST_CASE("a saved scene that is cut short or too long is refused", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    save_scene(file, build_scene(scene_of_everything(), kAllTrees));
    const std::string whole = file_contents(file);
    std::vector<std::size_t> sizes{
        0, 1, 7, 8, 71, 72, 73, 4095, 4096, whole.size() - 4096, whole.size() - 1, whole.size() + 1};
    for (const SectionPlace& place : sections_of(whole)) sizes.push_back(place.begin);
    for (const std::size_t size : sizes) {
        CAPTURE(size);
        directory.write("s.castor", size <= whole.size() ? whole.substr(0, size) : whole + "x");
        const std::string reason = reason_of(file);
        CHECK_FALSE(reason.empty());
        if (size >= 72) CHECK(reason.find("it has " + std::to_string(whole.size()) + " bytes") != std::string::npos);
        if (size >= 8 && size < whole.size()) CHECK(reason.find("cut short") != std::string::npos);
    }
    CHECK(reason_of(directory.path() / "missing").find("cannot be read") != std::string::npos);
    CHECK(reason_of(directory.path()).find("not a regular file") != std::string::npos);
}

TEST_CASE("a saved scene of another version or byte order is refused as such", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s.castor";
    save_scene(file, build_scene(scene_of_everything(), kAllTrees));
    std::string bad = file_contents(file);
    bad[12] = 0;
    directory.write("s.castor", bad);
    CHECK(reason_of(file) ==
          "is of version 0 of the format (at byte 12), this Castor reads version 24; build it again from its scene");
    std::swap(bad[8], bad[11]);
    std::swap(bad[9], bad[10]);
    directory.write("s.castor", bad);
    CHECK(reason_of(file) ==
          "was saved on a machine of the other byte order (at byte 8: found 0x04030201, expected 0x01020304); build it "
          "again from "
          "its scene");
    directory.write("s.castor", "ply\nformat ascii 1.0\n");
    CHECK(reason_of(file).find("is no built scene") != std::string::npos);
    CHECK_FALSE(is_built_scene(file));
    CHECK_FALSE(is_built_scene(directory.path()));
    CHECK_FALSE(is_built_scene(directory.path() / "missing"));
}

TEST_CASE("sections that are missing, unknown or of another type are refused", "[saved]") {
    const TemporaryDirectory directory;
    const fs::path file = directory.path() / "s";
    const std::vector<std::uint32_t> numbers{1, 2, 3};
    const ElementType type{"uint", 4};
    write_section_file(file, kBuiltSceneFile,
                       {{"a", type, std::as_bytes(std::span(numbers))}, {"empty", {"pair", 8}, {}}});
    SectionFile sections(file, kBuiltSceneFile);
    CHECK(sections.section("a", type).size() == 12);
    CHECK_THROWS_WITH(sections.expect_no_more(),
                      Catch::Matchers::Contains("has a section empty that this Castor does not know"));
    CHECK(sections.section("empty", {"pair", 8}).empty());
    sections.expect_no_more();
    CHECK_THROWS_WITH(sections.section("b", type), Catch::Matchers::Contains("has no section b"));
    CHECK_THROWS_WITH(sections.section("a", {"uint", 8}),
                      Catch::Matchers::Contains("uint of 4 bytes in its section a, expected uint of 8"));
    CHECK_THROWS_AS(sections.section("a", {"float", 4}), SceneError);
    CHECK_THROWS_WITH(SectionFile(file, kCheckpointFile),
                      Catch::Matchers::Contains("is a built scene; a checkpoint was expected"));
    CHECK(is_section_file_of_another_kind(file, kCheckpointFile));
    CHECK_FALSE(is_section_file_of_another_kind(file, kBuiltSceneFile));
}

TEST_CASE("a saved scene that cannot be written leaves the old one", "[saved]") {
    const TemporaryDirectory directory;
    const SceneContents prepared = build_scene(scene_of_everything(), kAllTrees);
    CHECK_THROWS_AS(save_scene(directory.path() / "no" / "s", prepared), FileError);
    CHECK_THROWS_AS(save_scene("/dev/full", prepared), FileError);
    CHECK_THROWS_WITH(load_scene(directory.path() / "none"), Catch::Matchers::Contains("does not exist"));
    save_scene(directory.path() / "s.castor", prepared);
    CHECK_THROWS_WITH(load_scene(directory.path() / "s.castor"), Catch::Matchers::Contains("is a built scene"));
}

}  // namespace castor::test
