// Pictures of scenes with textures: the same bytes wherever they are made, and what the textures say.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/image_io.h"
#include "castor/memory_plan.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "render/aov.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/shared_folder.h"
#include "support/temporary_directory.h"
#include "support/textured_scene.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec2;
using glm::vec3;

constexpr Strategy kStrategies[] = {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet};

Image constant_image(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
    return {"", 1, 1, {red, green, blue}, {}};
}

/// A square around `centre` in the plane z = centre.z, with texture coordinates from (0, 0) at its upper left to (1, 1)
/// at its lower right.
Mesh square(const vec3& centre, float half_width, std::uint32_t material) {
    Mesh mesh = rectangle(centre, {half_width, 0, 0}, {0, half_width, 0}, material);
    mesh.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    return mesh;
}

RenderOptions with_normals(std::uint32_t samples = 2) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.aovs = eye_planes();
    options.tile_size = 16;
    return options;
}

Film render(const Scene& scene, const RenderOptions& options = {}) {
    return Renderer(scene, {test_device()}).render(scene.cameras.at(0), options);
}

/// A scene with a square of the material before a camera that sees nothing else.
Scene square_scene(const Material& material, std::uint32_t size) {
    Scene scene;
    scene.ambient_light = vec3(100);
    add_material(scene, material);
    scene.meshes = {square({0, 0, -1}, 1.0f, 0)};
    scene.lights = {directional_light({-0.3f, -0.2f, -1}, vec3(200))};
    scene.cameras = {square_camera({0, 0, 0}, {0, 0, -1}, 1.0f, size)};
    return scene;
}

/// The peak signal-to-noise ratio of two pictures of bytes, in decibels.
double psnr(const Image& a, const Image& b) {
    REQUIRE(a.width == b.width);
    REQUIRE(a.height == b.height);
    REQUIRE(a.bytes.size() == b.bytes.size());
    double squares = 0;
    for (std::size_t i = 0; i < a.bytes.size(); ++i) {
        const double apart = static_cast<double>(a.bytes[i]) - b.bytes[i];
        squares += apart * apart;
    }
    return 10 * std::log10(255 * 255 * static_cast<double>(a.bytes.size()) / squares);
}

vec3 normal_at(const Film& film, std::size_t pixel) {
    for (const FilmPlane& plane : film.planes)
        if (plane.name == "normal")
            return {plane.values[3 * pixel], plane.values[3 * pixel + 1], plane.values[3 * pixel + 2]};
    FAIL("no plane of normals");
    return {};
}

}  // namespace

TEST_CASE("a textured picture is the same with every strategy, in any number of chunks, and from a file",
          "[textures]") {
    const Scene scene = textured_scene();
    Renderer whole(scene, {test_device()});
    const Film expected = whole.render(scene.cameras[0], with_normals());
    REQUIRE(all_finite(expected));
    for (const Strategy strategy : kStrategies) {
        CAPTURE(to_string(strategy));
        Renderer renderer(scene, {test_device()}, {.strategy = strategy});
        CHECK(same_bytes(renderer.render(scene.cameras[0], with_normals()), expected));
        Renderer cut(scene, {with_little_memory(200 << 10)}, {.strategy = strategy});
        CHECK(same_bytes(cut.render(scene.cameras[0], with_normals()), expected));
    }
    const TemporaryDirectory folder;
    const auto file = folder.path() / "scene.castor";
    BuiltScene(scene, {test_device()}).save(file);
    Renderer saved(load_built_scene(file), {test_device()});
    CHECK(same_bytes(saved.render(scene.cameras[0], with_normals()), expected));
    Scene without = scene;
    for (Material& material : without.materials) material.textures.clear();
    CHECK_FALSE(same_bytes(render(without, with_normals()), expected));
}

TEST_CASE("a texture of one colour is a material of this colour, bit by bit", "[textures]") {
    Scene plain = busy_scene();
    Material material = diffuse_material({0.5f, 0.25f, 0.75f});
    material.specular = {0.125f, 0.5f, 0.25f};
    material.phong_exponent = 11.0f;
    const std::uint32_t number = add_material(plain, material);
    for (Mesh& mesh : plain.meshes) mesh.material = number;
    for (Sphere& sphere : plain.spheres) sphere.material = number;
    Scene textured = plain;
    textured.images = {constant_image(128, 64, 192), constant_image(32, 128, 64), constant_image(255, 255, 255)};
    for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear, TextureFilter::trilinear}) {
        textured.textures = {image_texture(2, TextureTarget::replace_diffuse, filter),
                             image_texture(0, TextureTarget::replace_diffuse, filter),
                             image_texture(1, TextureTarget::replace_specular, filter)};
        for (Texture& texture : textured.textures) texture.normalizer = 256.0f;
        textured.materials[number].textures = {0, 1, 2};
        textured.materials[number].diffuse = textured.materials[number].specular = vec3(0.9f);
        // Spheres with textures and a transform are instances of their own: their hits are rounded otherwise.
        plain.spheres[0].transform = textured.spheres[0].transform = Transform(1.0f);
        CHECK(same_bytes(render(textured).pixels, render(plain).pixels));
    }
}

TEST_CASE("blending takes the mean, and what sends a texel is not shaded", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(1.0f)), 1);
    scene.images = {constant_image(51, 102, 204)};
    scene.textures = {image_texture(0, TextureTarget::replace_all)};
    scene.materials[0].textures = {0};
    CHECK(render(scene).pixels[0] == vec3(51, 102, 204));
    scene.textures = {image_texture(0, TextureTarget::blend_diffuse)};
    const vec3 blended = render(scene).pixels[0];
    scene.materials[0] = diffuse_material(vec3(0.6f, 0.7f, 0.9f));
    CASTOR_CHECK_CLOSE(blended, dvec3(render(scene).pixels[0]));
}

TEST_CASE("the planes uv and albedo hold texture coordinates, and reflectances after textures", "[textures][aov]") {
    constexpr std::uint32_t kSize = 8;
    Scene scene = square_scene(diffuse_material(vec3(0.25f)), kSize);
    scene.images = {random_image(kSize, kSize)};
    scene.textures = {image_texture(0, TextureTarget::replace_diffuse)};
    const auto plane_of = [](const Film& film, const std::string& name) {
        for (const FilmPlane& plane : film.planes)
            if (plane.name == name) return plane.values;
        FAIL("no plane " << name);
        return std::vector<float>();
    };
    RenderOptions options;
    options.aovs = {"uv", "albedo"};
    const Film plain = render(scene, options);
    scene.materials[0].textures = {0};
    const Film textured = render(scene, options);
    for (const Film* film : {&plain, &textured}) {
        const std::vector<float> uv = plane_of(*film, "uv"), albedo = plane_of(*film, "albedo");
        for (std::uint32_t i = 0; i < kSize * kSize; ++i) {
            CAPTURE(i);
            CHECK(uv[2 * i] == Approx((i % kSize + 0.5) / kSize).epsilon(1e-5));
            CHECK(uv[2 * i + 1] == Approx((i / kSize + 0.5) / kSize).epsilon(1e-5));
            for (std::uint32_t c = 0; c < 3; ++c)
                CHECK(albedo[3 * i + c] ==
                      Approx(film == &plain ? 0.25 : scene.images[0].bytes[3 * i + c] / 255.0).epsilon(1e-6));
        }
    }
    // Around a sphere: the point that faces the eye has u = (pi - pi/2) / (2 pi) and v = 1/2.
    Scene sphere = square_scene(diffuse_material(vec3(0.5f)), 1);
    sphere.meshes.clear();
    sphere.spheres = {{.center = {0, 0, -5}, .radius = 1, .material = 0}};
    const std::vector<float> facing = plane_of(render(sphere, options), "uv");
    CHECK(facing[0] == Approx(0.25).epsilon(1e-5));
    CHECK(facing[1] == Approx(0.5).epsilon(1e-5));
}

TEST_CASE("pictures lie on meshes by their texture coordinates, row 0 where v is 0", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(1.0f)), 8);
    scene.images = {random_image(8, 8)};
    scene.textures = {image_texture(0, TextureTarget::replace_all)};
    scene.materials[0].textures = {0};
    const Film film = render(scene);
    for (std::size_t i = 0; i < 64; ++i) {
        const auto* texel = scene.images[0].bytes.data() + 3 * i;
        CAPTURE(i);
        CHECK(film.pixels[i] == vec3(texel[0], texel[1], texel[2]));
    }
    // As seen from the right of an instance that is turned about, too.
    Scene placed = scene;
    placed.meshes[0].transform = turned(3.14159265f, vec3(1), {0, 0, -2});
    const Film back = render(placed);
    for (std::size_t y = 0; y < 8; ++y)
        for (std::size_t x = 0; x < 8; ++x) CHECK(back.pixels[8 * y + x] == film.pixels[8 * y + 7 - x]);
}

TEST_CASE("the picture of an OBJ file stands upright, with v from below", "[textures]") {
    const TemporaryDirectory directory;
    Image quarters{"", 32, 32, {}, {}};  // red and green above, blue and white below
    for (std::size_t i = 0; i < 32 * 32; ++i) {
        const bool is_right = i % 32 >= 16, is_below = i / 32 >= 16;
        const vec3 texel =
            is_below ? (is_right ? vec3(255) : vec3(0, 0, 255)) : (is_right ? vec3(0, 255, 0) : vec3(255, 0, 0));
        for (int c = 0; c < 3; ++c) quarters.bytes.push_back(static_cast<std::uint8_t>(texel[c]));
    }
    write_image(directory.path() / "q.png", quarters);
    directory.write("m.mtl", "newmtl q\nKd 0 0 0\nmap_Kd q.png\n");
    const std::filesystem::path obj =
        directory.write("a.obj",
                        "mtllib m.mtl\nv -5 -5 -5\nv 5 -5 -5\nv 5 5 -5\nv -5 5 -5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                        "usemtl q\nf 1/1 2/2 3/3 4/4\n");
    const std::filesystem::path xml =
        directory.write("a.xml", "<Scene><Objects><Mesh id=\"1\"><Faces objFile=\"a.obj\"/></Mesh></Objects></Scene>");
    RenderOptions options;
    options.aovs = {"albedo"};
    for (const auto& file : {obj, xml}) {
        CAPTURE(file.string());
        Scene scene = load_scene(file);
        CHECK(scene.textures.size() == 1);
        scene.cameras = {square_camera({0, 0, 0}, {0, 0, -1}, 1.0f, 4)};
        const std::vector<float> albedo = render(scene, options).planes.at(0).values;
        const auto at = [&](std::size_t x, std::size_t y) {
            return vec3(albedo[3 * (4 * y + x)], albedo[3 * (4 * y + x) + 1], albedo[3 * (4 * y + x) + 2]);
        };
        CHECK(at(1, 1) == vec3(1, 0, 0));
        CHECK(at(3, 1) == vec3(0, 1, 0));
        CHECK(at(1, 3) == vec3(0, 0, 1));
        CHECK(at(3, 3) == vec3(1, 1, 1));
    }
}

TEST_CASE("a background shows a texel for each pixel that meets nothing", "[textures]") {
    Scene scene = square_scene(ambient_material(vec3(0.5f)), 12);
    scene.meshes[0] = square({0, 0, -1}, 0.5f, 0);
    scene.images = {random_image(12, 12)};
    scene.background_texture = add_texture(scene, image_texture(0, TextureTarget::background));
    for (const std::uint32_t samples : {1u, 4u}) {
        RenderOptions options;
        options.samples_per_pixel = samples;
        options.filter = ReconstructionFilter::box;
        const Film film = render(scene, options);
        for (std::size_t i = 0; i < film.pixels.size(); ++i) {
            const std::size_t x = i % 12, y = i / 12;
            const bool is_hit = x >= 3 && x < 9 && y >= 3 && y < 9;
            const auto* texel = scene.images[0].bytes.data() + 3 * i;
            CAPTURE(samples, x, y);
            CHECK(film.pixels[i] == (is_hit ? vec3(50) : vec3(texel[0], texel[1], texel[2])));
        }
    }
}

TEST_CASE("a normal map gives texel / 127.5 - 1 along the axes of its coordinates", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(1.0f)), 2);
    scene.images = {constant_image(200, 90, 220)};
    scene.textures = {image_texture(0, TextureTarget::normal_map)};
    scene.materials[0].textures = {0};
    // u grows along x, and v along -y.
    const dvec3 map(200 / 127.5 - 1, 90 / 127.5 - 1, 220 / 127.5 - 1);
    const dvec3 expected = glm::normalize(dvec3(map.x, -map.y, map.z));
    CHECK(glm::length(dvec3(normal_at(render(scene, with_normals(1)), 0)) - expected) < 1e-6);
    // A transform takes the changed normal along, by its inverse transpose.
    scene.meshes[0].transform = turned(0.0f, {1, 2, 1}, vec3(0));
    const dvec3 stretched = glm::normalize(dvec3(expected.x, expected.y / 2, expected.z));
    CHECK(glm::length(dvec3(normal_at(render(scene, with_normals(1)), 0)) - stretched) < 1e-6);
}

TEST_CASE("a bump map tilts normals by the difference of its texels", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(1.0f)), 4);
    Image ramp{"", 16, 16, {}, {}};
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) ramp.bytes.insert(ramp.bytes.end(), {std::uint8_t(6 * x + 3 * y), 0, 0});
    scene.images = {ramp};
    scene.textures = {image_texture(0, TextureTarget::bump_map)};
    scene.textures[0].bump_factor = 0.5f;
    scene.materials[0].textures = {0};
    // Heights are a third of the red: 1 from a texel to the next, 0.5 to the one below. dp/du = (2,0,0), dp/dv =
    // (0,-2,0).
    const dvec3 across = glm::cross(dvec3(2, 0, 1.0), dvec3(0, -2, 0.5));
    const dvec3 expected = -glm::normalize(across);  // towards the normal
    const Film film = render(scene, with_normals(1));
    for (std::size_t i = 0; i < film.pixels.size(); ++i) {
        CAPTURE(i);
        CHECK(glm::length(dvec3(normal_at(film, i)) - expected) < 1e-5);
    }
    // Without texture coordinates there is no direction to tilt to.
    scene.meshes[0].texture_coordinates.clear();
    CHECK(normal_at(render(scene, with_normals(1)), 0) == vec3(0, 0, 1));
    scene.meshes[0].texture_coordinates.assign(4, vec2(0.3f, 0.3f));
    CHECK(normal_at(render(scene, with_normals(1)), 0) == vec3(0, 0, 1));
}

TEST_CASE("spheres have u around their y axis and v from their upper pole, in their own space", "[textures]") {
    Scene scene;
    Material material;
    scene.images = {random_image(64, 32)};
    scene.textures = {image_texture(0, TextureTarget::replace_all)};
    material.textures = {0};
    add_material(scene, material);
    scene.spheres = {{{0, 0, 0}, 1.0f, 0}};
    RandomSource random(9);
    const Transform transform = turned(0.9f, {2, 1, 1}, {1, 2, 3});
    for (const bool is_placed : {false, true}) {
        scene.spheres[0].transform = is_placed ? transform : Transform(1.0f);
        Probe probe(scene);
        for (int i = 0; i < 100; ++i) {
            const dvec3 p(random.direction());
            const double u = (M_PI - std::atan2(p.z, p.x)) / (2 * M_PI), v = std::acos(p.y) / M_PI;
            const double x = u * 64, y = v * 32;
            if (std::abs(x - std::round(x)) < 1e-3 || std::abs(y - std::round(y)) < 1e-3) continue;
            const auto* texel = scene.images[0].bytes.data() +
                                3 * (64 * static_cast<std::size_t>(std::floor(y)) + static_cast<std::size_t>(x));
            vec3 origin = 3.0f * vec3(p), direction = -vec3(p);
            if (is_placed) {
                origin = vec3(transform * glm::vec4(origin, 1.0f));
                direction = vec3(transform * glm::vec4(direction, 0.0f));
            }
            CAPTURE(is_placed, i);
            CHECK(probe(origin, direction) == vec3(texel[0], texel[1], texel[2]));
        }
    }
}

TEST_CASE("checkerboards and noise are functions of the point in the object's own space", "[textures]") {
    Texture checkers;
    checkers.kind = TextureKind::checkerboard;
    checkers.checker_scale = 3.0f;
    checkers.checker_offset = 0.1f;
    for (const Texture& texture : {checkers, noise_texture(TextureTarget::replace_diffuse, 2)}) {
        Scene scene = square_scene(diffuse_material(vec3(1.0f)), 16);
        scene.textures = {texture};
        scene.materials[0].textures = {0};
        const Film film = render(scene);
        // Camera and light go along.
        Scene placed = scene;
        placed.meshes[0].transform = Transform(1.0f);
        placed.meshes[0].transform[3] = {4, -8, 16};
        placed.cameras[0].position = {4, -8, 16};
        const Film moved = render(placed);
        CHECK(same_bytes(film.pixels, moved.pixels));
        if (texture.kind != TextureKind::checkerboard) continue;
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x) {
                const dvec3 p((x + 0.5) / 8 - 1, 1 - (y + 0.5) / 8, -1);
                bool is_black = false;
                for (int axis = 0; axis < 3; ++axis) is_black ^= static_cast<int>((p[axis] + 0.1) * 3) % 2 != 0;
                CAPTURE(x, y);
                CHECK((film.pixels[static_cast<std::size_t>(16 * y + x)] == vec3(0)) == is_black);
            }
    }
}

TEST_CASE("a trilinear texture is smooth far away, and the picture itself near by", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(1.0f)), 16);
    Image fine{"", 64, 64, {}, {}};
    for (int i = 0; i < 64 * 64; ++i) fine.bytes.insert(fine.bytes.end(), 3, (i / 64 + i) % 2 ? 255 : 0);
    scene.images = {fine};
    scene.textures = {image_texture(0, TextureTarget::replace_all, TextureFilter::trilinear)};
    scene.materials[0].textures = {0};
    for (const vec3& pixel : render(scene).pixels) CHECK(std::abs(pixel.x - 128.0f) < 1.0f);
    scene.cameras[0] = square_camera({0, 0, 0}, {0, 0, -1}, 0.1f, 16);
    const Film near_by = render(scene);
    scene.textures[0].filter = TextureFilter::bilinear;
    CHECK(same_bytes(near_by.pixels, render(scene).pixels));
}

TEST_CASE("textured scenes look as the course's own pictures", "[textures][reference]") {
    const std::filesystem::path folder = shared_folder() / "scenes" / "ceng795";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference pictures in %s\n", folder.c_str());
        return;
    }
    struct Reference {
        std::string scene, picture;
        RuleSet rules;
        double least_psnr;
    };
    const TemporaryDirectory output;
    for (const Reference& reference :
         {Reference{"sphere_nobump_bump.xml", "sphere_nobump_bump.png", RuleSet::r795, 50.0},
          Reference{"spheres_texture_bilinear.xml", "spheres_texture_bilinear.jpg", RuleSet::r2020, 40.0}}) {
        CAPTURE(reference.scene);
        const auto file = output.path() / (reference.scene + ".png");
        RenderOptions options;
        options.rules = reference.rules;
        write_image(file, render(load_scene(folder / reference.scene), options),
                    {.quantization = quantization(reference.rules)});
        const double found = psnr(read_image(file), read_image(folder / reference.picture));
        std::printf("%s: %.2f dB\n", reference.scene.c_str(), found);
        CHECK(found >= reference.least_psnr);
    }
}

TEST_CASE("in pictures of 2020 a sent texel takes the place of the diffuse term alone", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(0.5f)), 1);
    scene.images = {constant_image(51, 102, 204)};
    scene.textures = {image_texture(0, TextureTarget::replace_all)};
    scene.materials[0].ambient = vec3(0.25f);
    scene.materials[0].textures = {0};
    RenderOptions options;
    options.rules = RuleSet::r2020;
    CHECK(render(scene, options).pixels[0] == vec3(76, 127, 229));
    options.rules = RuleSet::r795;
    CHECK(render(scene, options).pixels[0] == vec3(51, 102, 204));
}

TEST_CASE("textures larger than any buffer of a device are refused with both numbers", "[textures]") {
    Scene scene = square_scene(diffuse_material(vec3(0.5f)), 1);
    scene.images = {random_image(64, 64)};
    scene.textures = {image_texture(0, TextureTarget::replace_all)};
    scene.materials[0].textures = {0};
    Device device = test_device();
    device.max_allocation_bytes = 16000;
    using Catch::Matchers::Contains;
    CHECK_THROWS_WITH(Renderer(scene, {device}), Contains("texels") && Contains("16384") && Contains("16000"));
    CHECK_THROWS_WITH(check_memory(plan_memory(scene, {.devices = {device}})),
                      Contains("texels") && Contains("16.0 KiB") && Contains("15.6 KiB"));
}

}  // namespace castor::test
