// Lights with an extent, emission and lenses: means beside closed formulas, with errors judged by what the pixels of a
// picture say of it, and the same bytes however the work is cut.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/merge.h"
#include "castor/renderer.h"
#include "reference/meshes.h"
#include "support/catch.h"
#include "support/estimate.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

using glm::dvec3;
using glm::vec3;

constexpr double kPi = std::numbers::pi;

Light area_light(const vec3& position, const vec3& normal, float size, const vec3& radiance) {
    Light light;
    light.kind = Light::Kind::area;
    light.area = {position, normal, size, radiance};
    return light;
}

Light object_light(Light::Kind kind, std::uint32_t object) {
    Light light;
    light.kind = kind;
    light.object.object = object;
    return light;
}

Material emitting_material(const vec3& emission) {
    Material material;
    material.emission = emission;
    return material;
}

/// A white floor, the plane y = 0, whose outside is above. A point of it sends the irradiance there.
Scene white_floor() {
    Scene scene;
    scene.planes.push_back({{0, 0, 0}, {0, 1, 0}, add_material(scene, diffuse_material(vec3(1))), 0});
    return scene;
}

/// Looks straight down, from a little above, at one point.
Estimate seen_below(const Scene& scene, const vec3& point, std::uint32_t samples) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    Renderer renderer(scene, {test_device()});
    return estimate_of(renderer.render(square_camera(point + vec3(0, 0.01f, 0), {0, -1, 0}, 1e-4f, 16), options));
}

/// The irradiance at `point` of a surface with this normal, above whose horizon a polygon of radiance 1 lies (Lambert
/// 1760, Photometria).
double polygon_irradiance(const std::vector<vec3>& corners, const dvec3& point, const dvec3& normal) {
    double sum = 0.0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const dvec3 a = glm::normalize(dvec3(corners[i]) - point);
        const dvec3 b = glm::normalize(dvec3(corners[(i + 1) % corners.size()]) - point);
        sum += std::acos(glm::dot(a, b)) * glm::dot(normal, glm::normalize(glm::cross(a, b)));
    }
    return std::abs(sum) / 2.0;
}

/// The outline of an ellipsoid, the unit sphere transformed, as it is seen from `point`: directions to it are those to
/// the sphere in the sphere's own space.
std::vector<vec3> outline(const Transform& transform, const dvec3& point) {
    const glm::dmat3 linear{dvec3(transform[0]), dvec3(transform[1]), dvec3(transform[2])};
    const dvec3 to_middle = glm::inverse(linear) * (dvec3(transform[3]) - point);
    const double sine = 1.0 / glm::length(to_middle), cosine = std::sqrt(1.0 - sine * sine);
    const dvec3 z = glm::normalize(to_middle);
    const dvec3 x = glm::normalize(glm::cross(z, std::abs(z.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
    constexpr int kSides = 2000;
    std::vector<vec3> corners;
    for (int i = 0; i < kSides; ++i) {
        const double angle = 2.0 * kPi * i / kSides;
        const dvec3 aside = std::cos(angle) * x + std::sin(angle) * glm::cross(z, x);
        corners.emplace_back(point + linear * (cosine * z + sine * aside));
    }
    return corners;
}

/// The mean over time of what irradiance(t) gives.
template <class Irradiance>
double mean_over_time(const Irradiance& irradiance) {
    constexpr int kTimes = 64;  // whose midpoints are exact to 1e-5 where it is as smooth as here
    double sum = 0.0;
    for (int i = 0; i < kTimes; ++i) sum += irradiance((i + 0.5) / kTimes);
    return sum / kTimes;
}

/// A disk in the plane y = height around the axis, as a fan with its outside below.
Mesh disk(float height, float radius, std::uint32_t sides, std::uint32_t material) {
    Mesh mesh;
    mesh.positions.push_back({0, height, 0});
    for (std::uint32_t i = 0; i < sides; ++i) {
        const double angle = 2.0 * kPi * i / sides;
        mesh.positions.push_back({radius * std::cos(angle), height, radius * std::sin(angle)});
        mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % sides});
    }
    mesh.material = material;
    return mesh;
}

/// A picture with all that is drawn at random here: an area light, emissive sphere and mesh, mirrors, a lens.
Scene lit_scene() {
    Scene scene;
    scene.background = {5, 6, 7};
    scene.ambient_light = {4, 4, 4};
    Material shiny = diffuse_material({0.5f, 0.3f, 0.2f});
    shiny.ambient = vec3(0.5f);
    shiny.specular = vec3(0.4f);
    shiny.phong_exponent = 20.0f;
    const std::uint32_t plain = add_material(scene, shiny);
    const std::uint32_t mirror = add_material(scene, mirror_material(vec3(0.7f)));
    const std::uint32_t lamp = add_material(scene, emitting_material({90, 80, 60}));
    const std::uint32_t panel = add_material(scene, emitting_material({10, 30, 50}));
    scene.planes = {{{0, -1, 0}, {0, 1, 0}, plain, 0}};
    scene.spheres = {{{-1, 0, -5}, 1.0f, mirror, 0}, {{1.2f, -0.2f, -4}, 0.8f, plain, 0}, {{0, 1, -4}, 0.3f, lamp, 0}};
    scene.meshes = {rectangle({0, 1, -7}, {2, 0, 0}, {0, 1, 0.5f}, mirror), moved(bumpy_sphere(1), 0.3f, {-2, 1, -4})};
    scene.meshes[1].material = panel;
    scene.lights = {object_light(Light::Kind::mesh, 1), area_light({1, 3, -3}, {0.2f, -1, 0}, 1.5f, {60, 70, 80}),
                    object_light(Light::Kind::sphere, 2), point_light({3, 3, 0}, {300, 200, 100})};
    scene.max_recursion_depth = 3;
    Camera camera;
    camera.left = -0.8f, camera.right = 0.8f, camera.bottom = -0.5f, camera.top = 0.5f;
    camera.width = 45;
    camera.height = 30;
    camera.samples_per_pixel = 6;
    camera.aperture_size = 0.2f;
    camera.focus_distance = 4.0f;
    scene.cameras = {camera};
    return scene;
}

}  // namespace

TEST_CASE("a square light gives the irradiance of a square", "[lights]") {
    // The configuration factor of four rectangles with a common corner above the point, of edges s/2 at height h: with
    // a = s / 2h and b = sqrt(1 + a^2) it is 4 / (2 pi) * 2 a / b atan(a / b).
    const float height = 2.0f, size = 3.0f;
    const double a = 0.5 * size / height, b = std::sqrt(1.0 + a * a);
    Scene scene = white_floor();
    scene.lights = {area_light({0, height, 0}, {0, -2, 0}, size, vec3(80, 0, 0))};
    check_mean(seen_below(scene, {0, 0, 0}, 64), 80.0 * 4.0 * a / b * std::atan(a / b));
    // It lights both of its sides.
    scene.lights[0].area.normal = {0, 1, 0};
    check_mean(seen_below(scene, {0, 0, 0}, 64), 80.0 * 4.0 * a / b * std::atan(a / b));
    // Upright, and seen from beside: Lambert's polygon.
    scene.lights = {area_light({0, 2, 0}, {1, 0, 0}, 2.0f, vec3(80, 0, 0))};
    const std::vector<vec3> upright{{0, 1, -1}, {0, 3, -1}, {0, 3, 1}, {0, 1, 1}};
    check_mean(seen_below(scene, {1.5f, 0, 0.5f}, 64), 80.0 * polygon_irradiance(upright, {1.5, 0, 0.5}, {0, 1, 0}));
}

TEST_CASE("under r795 what eye rays hit is lit by the point that lies in the light as the sample in its pixel",
          "[lights][rules]") {
    // One pixel sees the floor from -1 to 1. `along` and `down` are its columns and rows, from 0 to 1; the light's
    // edges are those of the frame (n' x n, n x (n' x n)), where n' is n with its smallest component replaced by 1.
    constexpr double kHeight = 1.0, kSize = 2.0, kRadiance = 80.0;
    const auto floor_point = [](double along, double down) { return dvec3(1.0 - 2.0 * along, 0.0, 1.0 - 2.0 * down); };
    const auto light_point = [&](double along, double down) {
        return dvec3(0, kHeight, 0) + kSize * (along - 0.5) * dvec3(0, 0, -1) + kSize * (down - 0.5) * dvec3(1, 0, 0);
    };
    const auto sent = [&](const dvec3& from, const dvec3& to) {
        const double squared = glm::dot(from - to, from - to);
        return kRadiance * kSize * kSize * kHeight * kHeight / (squared * squared);
    };
    constexpr int kSteps = 32;
    double dependent = 0.0, independent = 0.0;
    for (int i = 0; i < kSteps * kSteps; ++i) {
        const double x = (i % kSteps + 0.5) / kSteps, y = (i / kSteps + 0.5) / kSteps;
        dependent += sent(light_point(x, y), floor_point(x, y)) / (kSteps * kSteps);
        for (int j = 0; j < kSteps * kSteps; ++j)
            independent +=
                sent(light_point((j % kSteps + 0.5) / kSteps, (j / kSteps + 0.5) / kSteps), floor_point(x, y)) /
                std::pow(kSteps, 4.0);
    }
    REQUIRE(std::abs(dependent / independent - 1.0) > 0.1);

    Scene scene = white_floor();
    scene.lights = {area_light({0, kHeight, 0}, {0, -1, 0}, kSize, vec3(kRadiance, 0, 0))};
    scene.planes.push_back({{0, 4, 0}, {0, -1, 0}, add_material(scene, mirror_material(vec3(1))), 0});
    Renderer renderer(scene, {test_device()});
    const auto seen = [&](const vec3& position, const vec3& gaze, float half_width, RuleSet rules) {
        RenderOptions options;
        options.samples_per_pixel = 1 << 14;
        options.filter = ReconstructionFilter::box;
        options.rules = rules;
        return renderer.render(square_camera(position, gaze, half_width, 1), options).pixels.at(0).x;
    };
    const vec3 up(0, 1, 0);
    CHECK(seen({0, 3, 0}, -up, 1.0f / 3.0f, RuleSet::r795) == Approx(dependent).epsilon(0.01));
    CHECK(seen({0, 3, 0}, -up, 1.0f / 3.0f, RuleSet::r2022) == Approx(independent).epsilon(0.03));
    // In a mirror points are drawn anew.
    CHECK(seen({0, 3, 0}, up, 0.2f, RuleSet::r795) == Approx(independent).epsilon(0.03));
}

TEST_CASE("half of a hidden square light gives half of its irradiance", "[lights]") {
    // The screen hides x > 0 from the origin: its edge lies on the axis.
    const std::vector<vec3> half{{-1, 2, -1}, {0, 2, -1}, {0, 2, 1}, {-1, 2, 1}};
    Scene scene = white_floor();
    scene.lights = {area_light({0, 2, 0}, {0, -1, 0}, 2.0f, vec3(80, 0, 0))};
    scene.meshes = {rectangle({5, 1, 0}, {5, 0, 0}, {0, 0, 5}, 0)};
    check_mean(seen_below(scene, {0, 0, 0}, 64), 80.0 * polygon_irradiance(half, {0, 0, 0}, {0, 1, 0}));
}

TEST_CASE("a sphere light gives the irradiance of a sphere", "[lights]") {
    // Above the horizon: pi L (r/d)^2 cos, with the angle of its centre.
    Scene scene = white_floor();
    const std::uint32_t lamp = add_material(scene, emitting_material({50, 0, 0}));
    scene.lights = {object_light(Light::Kind::sphere, 0)};
    struct Case {
        vec3 centre;
        float radius;
    };
    for (const Case& c : {Case{{0, 2, 0}, 1.0f}, Case{{3, 2, -1}, 1.9f}, Case{{0, 500, 0}, 1.0f}}) {
        CAPTURE(c.centre.x, c.centre.y, c.radius);
        scene.spheres = {{c.centre, c.radius, lamp, 0}};
        const double distance = glm::length(dvec3(c.centre)), ratio = c.radius / distance;
        check_mean(seen_below(scene, {0, 0, 0}, 64), 50.0 * kPi * ratio * ratio * c.centre.y / distance);
    }
}

TEST_CASE("within a sphere light every surface gets pi times the radiance", "[lights]") {
    Scene scene;
    const std::uint32_t white = add_material(scene, diffuse_material(vec3(1)));
    const std::uint32_t lamp = add_material(scene, emitting_material({50, 0, 0}));
    scene.meshes = {rectangle({0.5f, 0, 0}, {0, 0, 0.1f}, {0.1f, 0, 0}, white)};
    scene.spheres = {{{0, 0, 0}, 2.0f, lamp, 0}};
    scene.lights = {object_light(Light::Kind::sphere, 0)};
    check_mean(seen_below(scene, {0.5f, 0, 0}, 64), 50.0 * kPi);
}

TEST_CASE("an ellipsoid lights as what is seen of its outline", "[lights]") {
    Scene scene = white_floor();
    const std::uint32_t lamp = add_material(scene, emitting_material({50, 0, 0}));
    scene.lights = {object_light(Light::Kind::sphere, 0)};
    // Long, flat, turned, sheared, mirrored; near, and far away.
    for (const Transform& transform :
         {Transform(vec3(2, 0, 0), vec3(0, 0.5f, 0), vec3(0, 0, 0.5f), vec3(0, 1.5f, 0)),
          Transform(vec3(1, 0, 0), vec3(0, 0.02f, 0), vec3(0, 0, 1), vec3(1, 1, -0.5f)),
          Transform(vec3(0.6f, 1, 0.4f), vec3(-0.3f, 0.4f, 0), vec3(0, 0.2f, 0.3f), vec3(0.5f, 2, 1)),
          Transform(vec3(-1, 0.3f, 0), vec3(0, 0.4f, 0), vec3(0, 0, 2), vec3(0, 1, 0)),
          Transform(vec3(3, 0, 0), vec3(0, 1, 0), vec3(0, 0, 5), vec3(100, 300, 0))}) {
        CAPTURE(transform[3].x, transform[3].y, transform[3].z);
        scene.spheres = {{{0, 0, 0}, 1.0f, lamp, 0, transform}};
        check_mean(seen_below(scene, {0, 0, 0}, 64),
                   50.0 * polygon_irradiance(outline(transform, dvec3(0)), dvec3(0), {0, 1, 0}));
    }
    // A sphere with a centre and a radius of its own.
    const Transform flat(vec3(2, 0, 0), vec3(0, 0.5f, 0), vec3(0, 0, 1), vec3(0));
    scene.spheres = {{{0.2f, 4, 0}, 0.7f, lamp, 0, flat}};
    const Transform same(0.7f * flat[0], 0.7f * flat[1], 0.7f * flat[2], vec3(0.4f, 2, 0));
    check_mean(seen_below(scene, {0, 0, 0}, 64),
               50.0 * polygon_irradiance(outline(same, dvec3(0)), dvec3(0), {0, 1, 0}));
    // From within it is seen everywhere.
    scene.spheres[0].transform = Transform(vec3(5, 0, 0), vec3(0, 4, 0), vec3(0, 0, 9), vec3(0, -16.5f, 0));
    check_mean(seen_below(scene, {0, 0, 0}, 64), 50.0 * kPi);
}

TEST_CASE("lamps that move light from where they are at their rays' times", "[lights][motion]") {
    Scene scene = white_floor();
    const std::uint32_t lamp = add_material(scene, emitting_material({50, 0, 0}));
    const vec3 motion(1.5f, 1, -0.5f);
    double expected = 0.0;
    SECTION("a mesh") {
        scene.meshes = {rectangle({-1, 1, 0}, {0.5f, 0, 0}, {0, 0, 0.5f}, lamp)};
        scene.meshes[0].motion = motion;
        scene.lights = {object_light(Light::Kind::mesh, 0)};
        expected = mean_over_time([&](double t) {
            std::vector<vec3> corners = scene.meshes[0].positions;
            for (vec3& corner : corners) corner += static_cast<float>(t) * motion;
            return polygon_irradiance(corners, dvec3(0), {0, 1, 0});
        });
    }
    SECTION("a sphere") {
        scene.spheres = {{{-1, 1, 0}, 0.5f, lamp, 0, Transform(1.0f), motion}};
        expected = mean_over_time([&](double t) {
            const dvec3 centre = dvec3(-1, 1, 0) + t * dvec3(motion);
            return kPi * 0.25 * centre.y / std::pow(glm::length(centre), 3.0);
        });
    }
    SECTION("an ellipsoid") {
        const Transform flat(vec3(1, 0, 0), vec3(0, 0.2f, 0), vec3(0, 0, 0.5f), vec3(-1, 1, 0));
        scene.spheres = {{{0, 0, 0}, 1.0f, lamp, 0, flat, motion}};
        expected = mean_over_time([&](double t) {
            Transform placed = flat;
            placed[3] += static_cast<float>(t) * motion;
            return polygon_irradiance(outline(placed, dvec3(0)), dvec3(0), {0, 1, 0});
        });
    }
    if (!scene.spheres.empty()) scene.lights = {object_light(Light::Kind::sphere, 0)};
    CHECK(Renderer(scene, {test_device()}).warnings().empty());
    check_mean(seen_below(scene, {0, 0, 0}, 64), 50.0 * expected);
}

TEST_CASE("a mesh light gives the irradiance of its polygons", "[lights]") {
    Scene scene = white_floor();
    const std::uint32_t lamp = add_material(scene, emitting_material({50, 0, 0}));
    scene.lights = {object_light(Light::Kind::mesh, 0)};
    SECTION("a disk, with triangles of no area between") {
        scene.meshes = {disk(1.5f, 1.0f, 40, lamp)};
        scene.meshes[0].triangles.insert(scene.meshes[0].triangles.begin() + 7, glm::uvec3(3, 3, 4));
        std::vector<vec3> rim = scene.meshes[0].positions;
        rim.erase(rim.begin());
        check_mean(seen_below(scene, {0, 0, 0}, 64), 50.0 * polygon_irradiance(rim, {0, 0, 0}, {0, 1, 0}));
        check_mean(seen_below(scene, {1, 0, 2}, 64), 50.0 * polygon_irradiance(rim, {1, 0, 2}, {0, 1, 0}));
    }
    SECTION("triangles of other sizes, moved, turned and mirrored by a transform") {
        scene.meshes = {disk(1.0f, 1.0f, 5, lamp)};
        scene.meshes[0].positions[2] *= vec3(3, 1, 3);
        scene.meshes[0].transform = Transform(vec3(-1, 0.3f, 0), vec3(0, 1, 0), vec3(0, 0, 2), vec3(0.5f, 1, 0));
        double expected = 0.0;
        for (const glm::uvec3& t : scene.meshes[0].triangles) {
            std::vector<vec3> corners;
            for (const std::uint32_t i : {t.x, t.y, t.z})
                corners.push_back(scene.meshes[0].transform * glm::vec4(scene.meshes[0].positions[i], 1.0f));
            expected += polygon_irradiance(corners, {0, 0, 0}, {0, 1, 0});
        }
        check_mean(seen_below(scene, {0, 0, 0}, 64), 50.0 * expected);
    }
    SECTION("a closed box hides its far sides") {
        // From below only its floor is seen.
        scene.meshes = {cube_grid(2)};
        Mesh& box = scene.meshes[0];
        box.material = lamp;
        vec3 lower = box.positions[0], upper = lower;
        for (const vec3& p : box.positions) lower = glm::min(lower, p), upper = glm::max(upper, p);
        for (vec3& p : box.positions) p = (p - lower) / (upper - lower) * 2.0f + vec3(-1, 1, -1);
        const std::vector<vec3> bottom{{-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}};
        check_mean(seen_below(scene, {0, 0, 0}, 256), 50.0 * polygon_irradiance(bottom, {0, 0, 0}, {0, 1, 0}));
    }
}

TEST_CASE("rays that hit an emitter return its radiance, from both sides and in mirrors", "[lights]") {
    Scene scene;
    const std::uint32_t lamp = add_material(scene, emitting_material({11, 22, 33}));
    const std::uint32_t mirror = add_material(scene, mirror_material({0.5f, 0.25f, 1.0f}));
    scene.meshes = {rectangle({0, 0, -2}, {1, 0, 0}, {0, 1, 0}, lamp)};
    scene.spheres = {{{5, 0, -3}, 1.0f, lamp, 0}};
    scene.planes = {{{0, 0, 3}, {0, 0, -1}, mirror, 0}};
    scene.lights = {object_light(Light::Kind::mesh, 0), object_light(Light::Kind::sphere, 0)};
    Probe probe(scene);
    CASTOR_CHECK_CLOSE(probe({0.3f, 0, 0}, {0, 0, -1}), dvec3(11, 22, 33));
    CASTOR_CHECK_CLOSE(probe({0.3f, 0, -3}, {0, 0, 1}), dvec3(11, 22, 33));
    CASTOR_CHECK_CLOSE(probe({5, 0, 0}, {0, 0, -1}), dvec3(11, 22, 33));
    CASTOR_CHECK_CLOSE(probe({5, 0, -3}, {1, 0, 0}), dvec3(11, 22, 33));  // from within
    CASTOR_CHECK_CLOSE(probe({0.3f, 0, 0}, {0, 0, 1}), dvec3(5.5, 5.5, 33));
}

TEST_CASE("an emitter is not lit by itself", "[lights]") {
    // A white sphere and a white square that shine: what is seen of them is their emission.
    Scene scene;
    Material material = emitting_material(vec3(10));
    material.diffuse = vec3(1);
    const std::uint32_t lamp = add_material(scene, material);
    scene.spheres = {{{0, 0, -3}, 1.0f, lamp, 0}};
    scene.meshes = {rectangle({0, 5, -3}, {1, 0, 0}, {0, 1, 0}, lamp)};
    scene.lights = {object_light(Light::Kind::sphere, 0)};
    RenderOptions options;
    options.samples_per_pixel = 16;
    const Film sphere = Renderer(scene, {test_device()}).render(square_camera({}, {0, 0, -1}, 0.2f, 32), options);
    for (const vec3& pixel : sphere.pixels) REQUIRE(std::abs(pixel.x - 10.0f) <= 1e-4f);
    scene.lights = {object_light(Light::Kind::mesh, 0)};
    const Film square =
        Renderer(scene, {test_device()}).render(square_camera({0, 5, 0}, {0, 0, -1}, 0.2f, 32), options);
    for (const vec3& pixel : square.pixels) REQUIRE(std::abs(pixel.x - 10.0f) <= 1e-2f);
}

TEST_CASE("a point out of focus is spread over the lens' image", "[lights][lens]") {
    // A small sphere at distance z is seen, by a lens of edge a that is focused at f, where the lens' rays cross the
    // image plane at distance d: over a square of edge a d |1/f - 1/z|.
    Scene scene;
    scene.materials = {emitting_material(vec3(1000))};
    const float z = 6.0f, focus = 3.0f, aperture = 0.5f, radius = 0.03f;
    scene.spheres = {{{0, 0, -z}, radius, 0, 0}};
    Camera camera = square_camera({}, {0, 0, -1}, 0.1f, 80);
    camera.aperture_size = aperture;
    camera.focus_distance = focus;
    RenderOptions options;
    options.samples_per_pixel = 1024;
    options.filter = ReconstructionFilter::box;
    Renderer renderer(scene, {test_device()});
    const auto spread = [&](const Film& film) {
        // A uniform distribution of edge w has the variance w^2 / 12, and on a disk of radius r r^2 / 4.
        double sum = 0.0, squares = 0.0;
        for (std::size_t i = 0; i < film.pixels.size(); ++i) {
            const double x = (0.5 + double(i % film.width)) / film.width * 0.2 - 0.1;
            sum += film.pixels[i].x;
            squares += x * x * film.pixels[i].x;
        }
        return std::sqrt(12.0 * squares / sum);
    };
    const double edge = aperture * std::abs(1.0 / focus - 1.0 / z);
    const double expected = std::sqrt(edge * edge + 3.0 * std::pow(radius / z, 2.0));
    const double found = spread(renderer.render(camera, options));
    CAPTURE(found, expected);
    CHECK(std::abs(found - expected) <= 0.02 * expected);
    camera.focus_distance = z;
    CHECK(spread(renderer.render(camera, options)) <= 0.15 * expected);
    // One sample a pixel, through its centre, goes through some point of the lens all the same.
    camera.focus_distance = focus;
    options.samples_per_pixel = 1;
    std::size_t lit = 0;
    for (const vec3& pixel : renderer.render(camera, options).pixels) lit += pixel.x > 0.0f;
    CHECK(lit > 0);
    // Planes are those of the pinhole.
    options.aovs = {"depth"};
    Camera pinhole = camera;
    pinhole.aperture_size = 0.0f;
    CHECK(same_bytes(renderer.render(camera, options).planes[0].values,
                     renderer.render(pinhole, options).planes[0].values));
}

TEST_CASE("t_min and t_max of a camera with a lens are those of its image plane", "[lights][lens]") {
    Scene scene;
    scene.materials = {ambient_material(vec3(1))};
    scene.ambient_light = vec3(9);
    scene.planes = {{{0, 0, -2}, {0, 0, 1}, 0, 0}};
    Camera camera = square_camera({}, {0, 0, -1}, 0.1f, 8);
    camera.aperture_size = 0.1f;
    camera.focus_distance = 7.0f;
    Renderer renderer(scene, {test_device()});
    const auto mean = [&] { return estimate_of(renderer.render(camera)).mean; };
    camera.t_max = 1.99f;
    CHECK(mean() == 0.0);
    camera.t_max = 2.01f;
    CHECK(mean() == 9.0);
    camera.t_min = 2.005f;
    CHECK(mean() == 0.0);
}

TEST_CASE("sampled lights and lenses have the same bytes however the work is cut", "[lights]") {
    const Scene scene = lit_scene();
    const Camera& camera = scene.cameras[0];
    const Device device = test_device();
    Renderer renderer(scene, {device});
    RenderOptions options;
    options.aovs = {"depth"};
    const Film expected = renderer.render(camera, options);
    REQUIRE(all_finite(expected));
    CHECK(same_bytes(renderer.render(camera, options), expected));
    for (const std::uint32_t tile_size : {8u, 24u, 4096u}) {
        CAPTURE(tile_size);
        RenderOptions tiled = options;
        tiled.tile_size = tile_size;
        CHECK(same_bytes(renderer.render(camera, tiled), expected));
    }
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        CHECK(same_bytes(Renderer(scene, {device}, {strategy}).render(camera, options), expected));
    }
    RenderOptions small_tiles = options;
    small_tiles.tile_size = 8;  // so that both have something to do
    CHECK(same_bytes(Renderer(scene, {device, device}).render(camera, small_tiles), expected));

    const TemporaryDirectory folder;
    BuiltScene(scene, {device}).save(folder.path() / "scene");
    const BuiltScene saved = load_built_scene(folder.path() / "scene");
    CHECK(same_bytes(Renderer(saved, {device}).render(camera, options), expected));

    std::vector<std::filesystem::path> parts;
    for (const std::uint32_t number : {2u, 1u}) {
        RenderOptions of_part = small_tiles;
        of_part.part = PicturePart{number, 2};
        of_part.checkpoint_file = parts.emplace_back(folder.path() / std::to_string(number));
        renderer.render(camera, of_part);
    }
    CHECK(same_bytes(merge_checkpoints(parts).film, expected));

    RenderOptions resumed = options;
    resumed.resume_file = parts.front();
    CHECK(same_bytes(renderer.render(camera, resumed), expected));
    options.seed = 1;
    CHECK_FALSE(same_bytes(renderer.render(camera, options), expected));
}

}  // namespace castor::test
