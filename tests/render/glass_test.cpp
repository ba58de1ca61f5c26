// Pictures of dielectrics: against a recursive tracer in double precision, and the same bytes however they are made.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "reference/meshes.h"
#include "reference/shading.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

using glm::dvec3;

Material glass(float index, const glm::vec3& absorption = glm::vec3(0.0f)) {
    Material material;
    material.kind = MaterialKind::dielectric;
    material.refraction_index = index;
    material.absorption = absorption;
    return material;
}

/// The light that eye rays bring in a scene of spheres and planes without lights, by the rules of the format.
class Tracer64 {
public:
    Tracer64(const Scene& scene, std::uint32_t max_depth) : scene_(scene), max_depth_(max_depth) {}

    dvec3 operator()(const dvec3& origin, const dvec3& direction) const {
        return radiance(origin, glm::normalize(direction), 0, {});
    }

private:
    struct Met {
        double t = std::numeric_limits<double>::infinity();
        dvec3 normal{0.0};
        std::uint32_t material = 0;
    };

    Met nearest(const dvec3& origin, const dvec3& direction) const {
        Met met;
        const auto take = [&](double t, const dvec3& normal, std::uint32_t material) {
            if (t > 0.0 && t < met.t) met = {t, normal, material};
        };
        for (const Sphere& sphere : scene_.spheres) {
            const dvec3 centre(sphere.center), to_centre = centre - origin;
            const double b = glm::dot(to_centre, direction), r = sphere.radius;
            const double d = b * b - glm::dot(to_centre, to_centre) + r * r;
            if (d < 0.0) continue;
            for (const double t : {b - std::sqrt(d), b + std::sqrt(d)})
                take(t, (origin + t * direction - centre) / r, sphere.material);
        }
        for (const Plane& plane : scene_.planes) {
            const dvec3 normal = glm::normalize(dvec3(plane.normal));
            take(glm::dot(dvec3(plane.point) - origin, normal) / glm::dot(direction, normal), normal, plane.material);
        }
        return met;
    }

    /// Dielectrics in which a ray is, the innermost one last.
    using Media = std::vector<std::uint32_t>;

    static Media entered(Media media, std::uint32_t material) {
        if (media.empty() || media.back() != material) media.push_back(material);
        return media;
    }
    static Media left(Media media, std::uint32_t material) {
        const auto found = std::find(media.rbegin(), media.rend(), material);
        if (found == media.rend()) return {};
        media.erase(std::next(found).base());
        return media;
    }
    static Media stayed(Media media, std::uint32_t material) {
        return std::find(media.begin(), media.end(), material) == media.end() ? Media{material} : media;
    }

    dvec3 radiance(const dvec3& origin, const dvec3& direction, std::uint32_t depth, const Media& media) const {
        const Met met = nearest(origin, direction);
        if (std::isinf(met.t)) return depth == 0 ? dvec3(scene_.background) : dvec3(0.0);
        const dvec3 passed =
            media.empty() ? dvec3(1.0) : glm::exp(-dvec3(scene_.materials[media.back()].absorption) * met.t);
        const Material& material = scene_.materials[met.material];
        const dvec3 wo = -direction, position = origin + met.t * direction;
        const bool is_outside = glm::dot(wo, met.normal) > 0.0;
        const dvec3 offset = met.normal * double(scene_.shadow_ray_epsilon) * (is_outside ? 1.0 : -1.0);
        const dvec3 mirrored = 2.0 * glm::dot(wo, met.normal) * met.normal - wo;
        const dvec3 ambient = dvec3(material.ambient) * dvec3(scene_.ambient_light);
        if (material.kind == MaterialKind::mirror && depth < max_depth_)
            return passed * (ambient + dvec3(material.mirror) *
                                           radiance(position + met.normal * double(scene_.shadow_ray_epsilon), mirrored,
                                                    depth + 1, media));
        if (material.kind != MaterialKind::dielectric) return passed * ambient;
        dvec3 sum = is_outside ? ambient : dvec3(0.0);
        if (depth < max_depth_) {
            const reference::Refraction bent = reference::refract(material.refraction_index, met.normal, wo);
            const Media here = is_outside ? media : stayed(media, met.material);
            const Media there = is_outside ? entered(media, met.material) : left(media, met.material);
            sum += bent.reflectance * radiance(position + offset, mirrored, depth + 1, here);
            if (bent.reflectance < 1.0)
                sum += (1.0 - bent.reflectance) * radiance(position - offset, bent.direction, depth + 1, there);
        }
        return passed * sum;
    }

    const Scene& scene_;
    std::uint32_t max_depth_;
};

/// Compares a picture through the pixels' centres with the reference, where neighbouring rays bring nearly the same.
void check_against_reference(const Scene& scene, std::uint32_t max_depth) {
    CAPTURE(max_depth);
    constexpr std::uint32_t kSize = 24;
    const Camera camera = square_camera({0.3f, 0.2f, 6}, {0, 0, -1}, 0.6f, kSize);
    RenderOptions options;
    options.max_recursion_depth = max_depth;
    const Film film = Renderer(scene, {test_device()}).render(camera, options);
    const Tracer64 tracer(scene, max_depth);
    std::size_t compared = 0, wrong = 0;
    for (std::uint32_t y = 0; y < kSize; ++y) {
        for (std::uint32_t x = 0; x < kSize; ++x) {
            const auto through = [&](double dx, double dy) {
                return tracer(dvec3(camera.position),
                              {-0.6 + 1.2 * (x + 0.5 + dx) / kSize, 0.6 - 1.2 * (y + 0.5 + dy) / kSize, -1.0});
            };
            const dvec3 expected = through(0, 0);
            const double tolerance = 1e-3 * (1.0 + glm::length(expected));
            if (glm::length(through(0.01, 0.01) - expected) > 10 * tolerance) continue;
            ++compared;
            const dvec3 found(film.pixels[y * kSize + x]);
            if (!(glm::length(found - expected) <= tolerance)) {
                ++wrong;
                UNSCOPED_INFO("pixel " << x << ' ' << y << ": found " << to_decimal(found) << ", expected "
                                       << to_decimal(expected));
            }
        }
    }
    CHECK(compared > kSize * kSize * 8 / 10);
    CHECK(wrong == 0);
}

/// A slab between z = 1 and z = 0 before a wall, and a bright plane behind the eye.
Scene slab_scene(float index, const glm::vec3& absorption) {
    Scene scene;
    scene.background = {1, 2, 3};
    scene.ambient_light = glm::vec3(100);
    scene.shadow_ray_epsilon = 1e-4f;
    const std::uint32_t pane = add_material(scene, glass(index, absorption));
    const std::uint32_t wall = add_material(scene, ambient_material({0.8f, 0.5f, 0.3f}));
    const std::uint32_t lamp = add_material(scene, ambient_material({2, 3, 4}));
    scene.planes = {{{0, 0, 1}, {0.1f, 0, 1}, pane, 0},
                    {{0, 0, 0}, {0, 0, -1}, pane, 0},
                    {{0, 0, -3}, {0, 0.3f, 1}, wall, 0},
                    {{0, 0, 9}, {0, 0, -1}, lamp, 0}};
    return scene;
}

/// Glass in glass, a bubble, a mirror in glass, glass that touches glass, and coincident faces, over a floor.
Scene nasty_scene() {
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = {30, 25, 20};
    Material shiny = diffuse_material({0.5f, 0.4f, 0.3f});
    shiny.ambient = glm::vec3(0.5f);
    shiny.specular = glm::vec3(0.3f);
    shiny.phong_exponent = 30.0f;
    const std::uint32_t plain = add_material(scene, shiny);
    const std::uint32_t clear = add_material(scene, glass(1.5f));
    const std::uint32_t green = add_material(scene, glass(1.3f, {0.8f, 0.1f, 0.8f}));
    const std::uint32_t rare = add_material(scene, glass(0.7f, {0.05f, 0.05f, 0.0f}));
    const std::uint32_t mirror = add_material(scene, mirror_material(glm::vec3(0.8f)));
    Material frosted = glass(1.6f);
    frosted.roughness = 0.1f;
    const std::uint32_t rough = add_material(scene, frosted);
    scene.spheres = {{{-1, 0, -5}, 1.0f, clear, 0},      {{-1, 0, -5}, 0.6f, green, 0},
                     {{-1, 0, -5}, 0.3f, mirror, 0},     {{1.2f, -0.2f, -4}, 0.8f, green, 0},
                     {{1.2f, -0.2f, -4}, 0.4f, rare, 0}, {{0, 1, -7}, 1.0f, rough, 0},
                     {{1.2f, 1.4f, -4}, 0.8f, green, 0}, {{1.2f, 1.4f, -4}, 0.8f, clear, 0}};
    Mesh block = cube_grid(2);
    for (glm::vec3& position : block.positions) position = position * 0.5f + glm::vec3(0.1f, -0.5f, -3.5f);
    block.material = clear;
    Mesh same = block;
    same.material = green;
    Mesh neighbour = block;
    for (glm::vec3& position : neighbour.positions) position.x += 0.5f;
    Mesh smooth = rectangle({0, -0.9f, -5}, {2, 0, 0}, {0, 0.2f, -2}, clear);
    compute_smooth_normals(smooth);
    scene.meshes = {block, same, neighbour, smooth, rectangle({0, 0, -9}, {4, 0, 0}, {0, 4, 0}, plain)};
    scene.planes = {{{0, -1, 0}, {0, 1, 0}, plain, 0}};
    scene.lights = {point_light({3, 3, 0}, glm::vec3(800, 700, 600)), directional_light({1, -2, -1}, glm::vec3(60))};
    return scene;
}

Camera nasty_camera() {
    Camera camera;
    camera.left = -0.8f, camera.right = 0.8f, camera.bottom = -0.5f, camera.top = 0.5f;
    camera.width = 36;
    camera.height = 22;
    return camera;
}

RenderOptions options_of(std::uint32_t depth, std::uint32_t samples) {
    RenderOptions options;
    options.max_recursion_depth = depth;
    options.samples_per_pixel = samples;
    return options;
}

}  // namespace

TEST_CASE("slabs of glass reflect, refract and absorb as in double precision", "[glass]") {
    for (const std::uint32_t depth : {0u, 1u, 2u, 3u, 8u}) {
        check_against_reference(slab_scene(1.5f, {0.1f, 0.5f, 0.0f}), depth);
        check_against_reference(slab_scene(0.6f, {0.3f, 0.0f, 0.2f}), depth);  // total reflection on the way in
    }
}

TEST_CASE("spheres of glass reflect, refract and absorb as in double precision", "[glass]") {
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = glm::vec3(100);
    scene.shadow_ray_epsilon = 1e-4f;
    const std::uint32_t outer = add_material(scene, glass(1.5f, {0.2f, 0.05f, 0.6f}));
    const std::uint32_t inner = add_material(scene, glass(1.2f, {0.0f, 1.0f, 0.1f}));
    const std::uint32_t wall = add_material(scene, ambient_material({0.8f, 0.5f, 0.3f}));
    const std::uint32_t lamp = add_material(scene, ambient_material({2, 3, 4}));
    const std::uint32_t mirror = add_material(scene, mirror_material({0.9f, 0.8f, 0.7f}));
    scene.spheres = {{{0, 0, 0}, 2.0f, outer, 0}, {{0.2f, 0.1f, 0.3f}, 0.9f, inner, 0}, {{-2, 2, -3}, 1.0f, mirror, 0}};
    scene.planes = {{{0, 0, -5}, {0, 0.3f, 1}, wall, 0}, {{0, 0, 9}, {0, 0, -1}, lamp, 0}};
    for (const std::uint32_t depth : {1u, 2u, 4u, 6u}) check_against_reference(scene, depth);
}

TEST_CASE("what leaves glass within glass is in the outer one again", "[glass]") {
    // Two balls in a block of coloured glass: light is absorbed before, between and behind them, also on its way back.
    Scene scene;
    scene.ambient_light = glm::vec3(100);
    scene.shadow_ray_epsilon = 1e-4f;
    const std::uint32_t block = add_material(scene, glass(1.2f, {0.3f, 0.05f, 0.6f}));
    const std::uint32_t ball = add_material(scene, glass(1.4f, {0.0f, 0.5f, 0.1f}));
    const std::uint32_t wall = add_material(scene, ambient_material({0.8f, 0.5f, 0.3f}));
    scene.spheres = {{{0, 0, 0}, 3.0f, block, 0}, {{0.1f, 0, 1}, 0.8f, ball, 0}, {{-0.1f, 0.2f, -1}, 0.9f, ball, 0}};
    scene.planes = {{{0, 0, -5}, {0, 0.3f, 1}, wall, 0}};
    for (const std::uint32_t depth : {3u, 6u}) check_against_reference(scene, depth);
    // Along the axis, straight through: 5 of the block and 1 of the ball, less an epsilon at each of the surfaces.
    scene.spheres = {{{0, 0, 0}, 3.0f, block, 0}, {{0, 0, 0}, 0.5f, ball, 0}};
    scene.materials[block].refraction_index = scene.materials[ball].refraction_index = 1.0f;
    scene.planes[0].normal = {0, 0, 1};
    scene.max_recursion_depth = 4;
    CASTOR_CHECK_CLOSE(
        Probe(scene)({0, 0, 6}, {0, 0, -1}),
        dvec3(80, 50, 30) * glm::exp(-4.9998 * dvec3(0.3f, 0.05f, 0.6f) - 0.9999 * dvec3(0.0, 0.5, 0.1f)));
}

TEST_CASE("a ray that starts inside glass is reflected totally beyond the critical angle", "[glass]") {
    // The eye is inside a slab of index 1.5 between y = 0 and y = 1; a lamp lies above it, darkness below.
    Scene scene;
    scene.ambient_light = glm::vec3(100);
    const std::uint32_t pane = add_material(scene, glass(1.5f));
    const std::uint32_t lamp = add_material(scene, ambient_material(glm::vec3(1)));
    scene.planes = {
        {{0, 1, 0}, {0, 1, 0}, pane, 0}, {{0, 0, 0}, {0, -1, 0}, pane, 0}, {{0, 3, 0}, {0, -1, 0}, lamp, 0}};
    scene.max_recursion_depth = 1;
    Probe probe(scene);
    const auto seen_at = [&](double sine) {
        return probe({0, 0.5f, 0}, glm::vec3(sine, std::sqrt(1 - sine * sine), 0)).x;
    };
    CHECK(seen_at(0.0) > 95.9f);
    CHECK(seen_at(0.0) < 96.1f);   // 1 - ((n-1)/(n+1))^2
    CHECK(seen_at(0.66) > 30.0f);  // the critical angle has the sine 2/3
    CHECK(seen_at(0.67) == 0.0f);
}

TEST_CASE("a picture of glass is the same bytes however it is made", "[glass][renderer]") {
    const Scene scene = nasty_scene();
    const Device device = test_device();
    const std::uint32_t depth = GENERATE(0u, 1u, 20u), samples = GENERATE(1u, 5u);
    CAPTURE(depth, samples);
    const RenderOptions options = options_of(depth, samples);
    Renderer renderer(scene, {device});
    const Film expected = renderer.render(nasty_camera(), options);
    REQUIRE(expected.complete());
    REQUIRE(all_finite(expected));
    for (const std::uint32_t tile_size : {8u, 4096u}) {
        RenderOptions tiles = options;
        tiles.tile_size = tile_size;
        CHECK(same_bytes(renderer.render(nasty_camera(), tiles), expected));
    }
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        CHECK(same_bytes(Renderer(scene, {device}, {strategy}).render(nasty_camera(), options), expected));
    }
    RenderOptions small_tiles = options;
    small_tiles.tile_size = 8;  // so that both have something to do
    CHECK(same_bytes(Renderer(scene, {device, device}).render(nasty_camera(), small_tiles), expected));
}

TEST_CASE("a picture of glass that goes on from a checkpoint has the same bytes", "[glass][checkpoint]") {
    const TemporaryDirectory folder;
    Renderer renderer(nasty_scene(), {test_device()});
    RenderOptions options = options_of(6, 9);
    const Film expected = renderer.render(nasty_camera(), options);
    options.tile_size = 8;
    options.checkpoint_file = folder.path() / "glass.checkpoint";
    options.part = PicturePart{2, 3};  // whose checkpoint is there however fast the device is
    renderer.render(nasty_camera(), options);
    options.part.reset();
    options.resume_file = options.checkpoint_file;
    CHECK(same_bytes(renderer.render(nasty_camera(), options), expected));
    CHECK(renderer.statistics().samples_resumed > 0);
}

TEST_CASE("parts of a picture of glass are the whole picture together", "[glass][merge]") {
    Renderer renderer(nasty_scene(), {test_device()});
    RenderOptions options = options_of(6, 3);
    const Film expected = renderer.render(nasty_camera(), options);
    std::size_t pixels = 0;
    for (const std::uint32_t number : {1u, 2u, 3u}) {
        options.part = PicturePart{number, 3};
        const Film part = renderer.render(nasty_camera(), options);
        for (std::size_t i = 0; i < part.pixels.size(); ++i) {
            if (!part.done[i]) continue;
            ++pixels;
            REQUIRE(part.pixels[i] == expected.pixels[i]);
        }
    }
    CHECK(pixels == expected.pixels.size());
}

TEST_CASE("glass ends in recursions that are deep", "[glass]") {
    Renderer renderer(nasty_scene(), {test_device()});
    const Film deep = renderer.render(nasty_camera(), options_of(1000, 1));
    REQUIRE(deep.complete());
    CHECK(all_finite(deep));
    CHECK(same_bytes(renderer.render(nasty_camera(), options_of(1000, 1)), deep));
    // In a pane nothing is left after some ten reflections.
    Renderer pane(slab_scene(1.5f, glm::vec3(0.1f)), {test_device()});
    const Camera camera = square_camera({0, 0, 5}, {0, 0, -1}, 0.5f, 20);
    CHECK(same_bytes(pane.render(camera, options_of(65535, 2)), pane.render(camera, options_of(50, 2))));
}

TEST_CASE("glass under all rule sets is refracted, and its own mirror reflectance has no meaning", "[glass][rules]") {
    Scene scene = slab_scene(1.5f, glm::vec3(0));
    const glm::vec3 expected = Probe(scene)({0, 0, 5}, {0, 0.1f, -1});
    scene.materials[0].mirror = glm::vec3(0.5f);
    Probe probe(scene);
    for (const RuleSet rules : {RuleSet::r2022, RuleSet::r795, RuleSet::r2020, RuleSet::r2018}) {
        CAPTURE(to_string(rules));
        CHECK(glm::length(probe({0, 0, 5}, {0, 0.1f, -1}, rules) - expected) < 0.02f);
    }
}

TEST_CASE("culling passes back faces outside of glass, and never inside", "[glass][culling]") {
    // A cube of glass, closed, has the same picture with culling; one that stands open towards the eye is seen into.
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = glm::vec3(100);
    const std::uint32_t pane = add_material(scene, glass(1.4f, {0.1f, 0.2f, 0.3f}));
    const std::uint32_t wall = add_material(scene, ambient_material({0.8f, 0.5f, 0.3f}));
    Mesh cube = cube_grid(1);
    cube.material = pane;
    scene.meshes = {cube};
    scene.planes = {{{0, 0, -5}, {0, 0.3f, 1}, wall, 0}};
    const Camera camera = square_camera({0.7f, 0.9f, 4}, {-0.1f, -0.2f, -1}, 0.4f, 24);
    RenderOptions options = options_of(5, 1);
    Renderer renderer(scene, {test_device()});
    const Film expected = renderer.render(camera, options);
    options.cull_back_faces = true;
    CHECK(same_bytes(renderer.render(camera, options), expected));
}

TEST_CASE("roughness spreads reflections around the mirror direction, alike with and without branches", "[glass]") {
    // A lamp plane of which a mirror shows more, or less, as rays are spread: the mean is between the two sides.
    Scene scene;
    scene.ambient_light = glm::vec3(100);
    Material rough = mirror_material(glm::vec3(1));
    rough.roughness = 0.4f;
    const std::uint32_t mirror = add_material(scene, rough);
    const std::uint32_t lamp = add_material(scene, ambient_material(glm::vec3(1)));
    scene.planes = {{{0, 0, 0}, {0, 1, 0}, mirror, 0}};
    // Above, half of what is seen in the mirror straight below: x > 0.
    scene.meshes = {rectangle({50, 10, 0}, {50, 0, 0}, {0, 0, 50}, lamp)};
    const Camera camera = square_camera({0, 5, 0}, {0, -1, 0}, 1e-4f, 8);
    RenderOptions options = options_of(2, 64);
    const Film film = Renderer(scene, {test_device()}).render(camera, options);
    double mean = 0.0;
    for (const glm::vec3& pixel : film.pixels) mean += pixel.x / static_cast<double>(film.pixels.size());
    CHECK(std::abs(mean - 50.0) < 1.0);
    // With a dielectric that is nowhere, paths keep their own nodes, and the samples are the same.
    add_material(scene, glass(1.5f));
    const Film same = Renderer(scene, {test_device()}).render(camera, options);
    CHECK(same_bytes(same, film));
}

}  // namespace castor::test
