// The planes of lights: what each light makes of a picture, and what none makes.
#include "render/light_planes.h"

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/memory_plan.h"
#include "support/catch.h"
#include "support/picture.h"

namespace castor::test {

namespace {

constexpr std::uint32_t kSamples = 4, kDepth = 4;

/// Mirror, glass and a texture under lights of five kinds, of which three are sampled. All scenes here are built with
/// the same kernels: their unused material emits.
Scene scene_of_lights() {
    Scene scene;
    scene.ambient_light = {20, 25, 30};
    scene.background = {5, 6, 7};
    scene.max_recursion_depth = kDepth;
    Material matt = diffuse_material({0.7f, 0.6f, 0.5f});
    matt.ambient = glm::vec3(0.4f);
    matt.specular = glm::vec3(0.3f);
    matt.phong_exponent = 15;
    Material checked = matt;
    checked.textures = {0};
    Material glass;
    glass.kind = MaterialKind::dielectric;
    glass.refraction_index = 1.5f;
    glass.absorption = {0.1f, 0.2f, 0.05f};
    Material lamp, unused;
    lamp.emission = {90, 80, 60};
    unused.emission = {1, 1, 1};
    scene.materials = {matt, checked, mirror_material(glm::vec3(0.6f)), glass, lamp, unused};
    scene.images = {{"", 2, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 90, 90, 90}, {}},
                    {"", 2, 1, {}, {10, 20, 40, 60, 50, 30}}};
    scene.textures.resize(1);
    Mesh floor = rectangle({0, -1, -4}, {4, 0, 0}, {0, 0, -4}, 1);
    floor.texture_coordinates = {{0, 0}, {3, 0}, {3, 3}, {0, 3}};
    scene.meshes = {floor, rectangle({-1.5f, 0.3f, -5.5f}, {1, 0, 0.4f}, {0, 1, 0}, 2)};
    scene.spheres = {
        {{0.6f, -0.2f, -3.4f}, 0.7f, 3, 0}, {{1.8f, 0.8f, -5}, 0.4f, 4, 0}, {{-0.6f, -0.6f, -3}, 0.4f, 0, 0}};
    Light area, spot, sphere, environment;
    area.kind = Light::Kind::area;
    area.area = {{-1, 3, -3}, {0.2f, -1, 0}, 1.5f, {40, 50, 45}};
    spot.kind = Light::Kind::spot;
    spot.spot = {{2, 4, -2}, {-0.4f, -1, -0.4f}, glm::vec3(700), 0.9f, 0.6f};
    sphere.kind = Light::Kind::sphere;
    sphere.object.object = 1;
    environment.kind = Light::Kind::environment;
    environment.environment.image = 1;
    scene.lights = {point_light({3, 3, 0}, {500, 400, 450}), area, spot, sphere, environment};
    Camera camera;
    camera.left = -0.6f, camera.right = 0.6f, camera.bottom = -0.4f, camera.top = 0.4f;
    camera.width = 24;
    camera.height = 16;
    scene.cameras = {camera};
    return scene;
}

/// The scene where a light alone lights it, and no other thing is seen to shine. Light 0 to 2.
Scene lit_by(std::size_t light) {
    Scene scene = scene_of_lights();
    scene.ambient_light = scene.background = glm::vec3(0);
    scene.materials[4].emission = glm::vec3(0);
    scene.images[1].floats.assign(6, 0.0f);
    if (light != 0) scene.lights[0].point.intensity = glm::vec3(0);
    if (light != 1) scene.lights[1].area.radiance = glm::vec3(0);
    if (light != 2) scene.lights[2].spot.intensity = glm::vec3(0);
    return scene;
}

RenderOptions with_lights() {
    RenderOptions options;
    options.samples_per_pixel = kSamples;
    options.aovs = {"lights", "depth"};
    return options;
}

Film render(const Scene& scene, const RenderOptions& options = {.samples_per_pixel = kSamples}) {
    return Renderer(scene, {test_device()}).render(scene.cameras[0], options);
}

bool is_picture_of(const FilmPlane& plane, const Film& film) {
    return plane.values.size() == 3 * film.pixels.size() &&
           std::memcmp(plane.values.data(), film.pixels.data(), plane.values.size() * sizeof(float)) == 0;
}

}  // namespace

TEST_CASE("planes of lights are pictures by one light each, and their sum is the picture", "[aov][lights]") {
    const Scene scene = scene_of_lights();
    const Film film = render(scene, with_lights());
    std::vector<std::string> names;
    for (const FilmPlane& plane : film.planes) names.push_back(plane.name);
    CHECK(names == std::vector<std::string>{"depth", "light-0-point", "light-1-area", "light-2-spot", "light-3-sphere",
                                            "light-4-environment", "light-none"});
    CHECK(plane_names(scene, with_lights().aovs) == names);
    CHECK(film.pixels == render(scene).pixels);

    // Sums of floats of one sign: each of these roundings is at most 2^-24 of the sum. A sample's tree of rays has
    // fewer than 2^(depth + 1) hits, and each has a term of every light and one more.
    const double terms = kSamples * std::pow(2.0, kDepth + 1) * static_cast<double>(scene.lights.size() + 1);
    const double tolerance = 2 * terms * std::pow(2.0, -24);
    double largest = 0.0;
    for (std::size_t i = 0; i < 3 * film.pixels.size(); ++i) {
        double sum = 0.0;
        for (std::size_t plane = 1; plane < film.planes.size(); ++plane) sum += film.planes[plane].values[i];
        const double pixel = film.pixels[i / 3][static_cast<int>(i % 3)];
        CAPTURE(i, sum, pixel);
        REQUIRE(std::abs(sum - pixel) <= tolerance * pixel);
        largest = std::max(largest, pixel > 0 ? std::abs(sum - pixel) / pixel : 0.0);
    }
    INFO("the largest difference is " << largest << " of a pixel, " << tolerance << " may be");
    for (std::size_t plane = 1; plane < film.planes.size(); ++plane) {
        CAPTURE(film.planes[plane].name);
        CHECK_FALSE(is_picture_of(film.planes[plane], film));
        CHECK(std::any_of(film.planes[plane].values.begin(), film.planes[plane].values.end(),
                          [](float value) { return value > 1.0f; }));
    }

    for (std::size_t light = 0; light < 3; ++light) {
        CAPTURE(light);
        CHECK(is_picture_of(film.planes[1 + light], render(lit_by(light))));
    }
    // Light that is not sampled depends on no number: the scene may have no other.
    Scene spot_alone = lit_by(2);
    spot_alone.lights = {spot_alone.lights[2], spot_alone.lights[4]};
    CHECK(is_picture_of(film.planes[3], render(spot_alone)));

    RenderOptions tiles = with_lights();
    tiles.tile_size = 8;
    const Film again = render(scene, tiles);
    for (std::size_t plane = 0; plane < film.planes.size(); ++plane)
        CHECK(again.planes[plane].values == film.planes[plane].values);
}

TEST_CASE("planes of lights are counted, stopped and refused", "[aov][lights]") {
    const Scene scene = scene_of_lights();
    Renderer renderer(scene, {test_device()});
    std::uint64_t last = 0, total = 0;
    bool falls = false;
    const Film film = renderer.render(scene.cameras[0], with_lights(), [&](const RenderProgress& progress) {
        falls |= progress.samples_done < last || progress.samples_done > progress.samples_total;
        last = progress.samples_done;
        total = progress.samples_total;
        return progress.snapshot().pixels.size() == 24 * 16;
    });
    CHECK_FALSE(falls);
    CHECK(total == 7u * kSamples * 24 * 16);
    RenderStatistics statistics = renderer.statistics();
    CHECK(statistics.part_complete);
    CHECK(statistics.samples_done == kSamples * 24 * 16);

    RenderOptions options = with_lights();
    CHECK(picture_bytes({scene.cameras[0], options, 5}) ==
          picture_bytes({scene.cameras[0], {}, 5}) * 2 + (6 * 3 + 1) * sizeof(float) * 24 * 16);
    const auto refuses = [&](const char* reason) {
        INFO(reason);
        CHECK_THROWS_WITH(renderer.render(scene.cameras[0], options), Catch::Contains(reason));
        options = with_lights();
    };
    options.part = PicturePart{1, 2};
    refuses("of a part of a picture");
    options.checkpoint_file = "nowhere";
    refuses("with a checkpoint");
    options.resume_file = "nowhere";
    refuses("with a checkpoint");
    options.verify_share = 0.5;
    refuses("two devices");
    options.aovs.push_back("lights");
    refuses("twice");

    const Film stopped = renderer.render(scene.cameras[0], with_lights(), [&](const RenderProgress& progress) {
        return progress.samples_done <= kSamples * 24 * 16;
    });
    statistics = renderer.statistics();
    CHECK(stopped.complete());
    CHECK(stopped.pixels == film.pixels);
    CHECK_FALSE(statistics.part_complete);
    CHECK(stopped.planes.size() == film.planes.size());

    Scene dark = scene;
    dark.lights.clear();
    CHECK(plane_names(dark, {"lights"}) == std::vector<std::string>{"light-none"});
    CHECK(plane_names(dark, {"uv", "t"}) == std::vector<std::string>{"uv", "t"});
}

TEST_CASE("lights of groups are found by numbers and names", "[light_groups]") {
    std::vector<Light> lights(5);
    lights[0].names = {"Key", "Bulb"};
    lights[2].names = {"Neon tube"};
    lights[3].names = {"Neon tube", "1", "9"};
    lights[4].kind = Light::Kind::environment;
    lights[4].names = {"SphericalDirectionalLight-1"};
    using Numbers = std::vector<std::uint32_t>;
    CHECK(find_lights(lights, {"1", "Bulb", "environment"}) == Numbers{1, 0, 4});
    CHECK(find_lights(lights, {"Neon tube", "3", "Key", "Bulb", "0"}) == Numbers{2, 3, 0});
    CHECK(find_lights(lights, {"9", "SphericalDirectionalLight-1"}) == Numbers{3, 4});  // there is no light 9
    CHECK_THROWS_WITH(find_lights(lights, {"Key", "key"}),
                      "there is no light \"key\": expected a number below 5, or one of \"1\", \"9\", \"Bulb\", "
                      "\"Key\", \"Neon tube\", \"SphericalDirectionalLight-1\", \"environment\"");
    for (const char* word : {"5", "-1", "1 ", "0x1", "4294967296", ""})
        CHECK_THROWS_AS(find_lights(lights, {word}), UsageError);
    for (int i = 0; i < 5; ++i) lights[1].names.push_back("Spot " + std::to_string(i));
    CHECK_THROWS_WITH(find_lights(lights, {"key"}),
                      "there is no light \"key\": expected a number below 5, or one of \"1\", \"9\", \"Bulb\", "
                      "\"Key\", \"Neon tube\", \"SphericalDirectionalLight-1\", \"Spot 0\", \"Spot 1\", \"Spot 2\", "
                      "\"Spot 3\" and 2 more, which castor info --json lists");
    CHECK_THROWS_WITH(find_lights({Light()}, {"1"}),
                      "there is no light \"1\": expected a number below 1; none has a name");
    CHECK_THROWS_WITH(find_lights({}, {"0"}), "there is no light \"0\": the scene has none");
}

}  // namespace castor::test
