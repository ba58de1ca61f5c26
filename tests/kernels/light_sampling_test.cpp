// Points of lights with an extent, and of lenses: that they are drawn as the densities say that are stated, and that
// nothing depends on the number of lanes. A million of each.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "reference/random_source.h"
#include "render/camera.h"
#include "scene/scene_arrays.h"
#include "support/catch.h"
#include "support/chi_square.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dmat3;
using glm::dvec3;
using glm::vec3;
using glm::vec4;
using reference::RandomSource;

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kDraws = std::size_t{1} << 20;
constexpr int kBins = 16;  // an axis
constexpr std::size_t kTests = 12;
const double kSignificance = 1 - std::pow(1 - 0.01, 1.0 / double(kTests));  // Sidak

struct Drawn {
    vec4 direction_density, point_irradiance, density;
};

KernelFixture& fixture() {
    static KernelFixture one;
    return one;
}

/// A scene whose light 0 is one with an extent.
struct LightCase {
    SceneArrays arrays;
    vec3 origin{0.0f};
    vec3 normal{0.0f, 0.0f, 1.0f};  // of a flat light

    std::vector<Drawn> draw(std::size_t count, std::uint32_t lanes) const {
        RandomSource random(3);
        std::vector<vec4> points;
        const auto unit = [&] { return static_cast<float>(random.bits() >> 8) * 0x1p-24f; };
        for (std::size_t i = 0; i < count; ++i) {
            const float x = unit(), y = unit();
            points.emplace_back(x, y, arrays.instances.empty() ? 0.0f : 0.5f, 0.0f);
        }
        std::vector<shared::Emitter> emitters(arrays.emitters.begin(), arrays.emitters.end());
        std::vector<shared::Instance> instances(arrays.instances.begin(), arrays.instances.end());
        emitters.resize(std::max<std::size_t>(1, emitters.size()));  // buffers have a size
        instances.resize(std::max<std::size_t>(1, instances.size()));
        const std::string width = std::to_string(lanes), kernel = "draw_lights_test";
        return fixture().run_kernel<Drawn>("light_sampling_test.x" + width, lanes > 1 ? kernel + width : kernel, count,
                                           arrays.lights[0], vec4(origin, 0.0f), vec4(normal, 0.0f), emitters,
                                           instances, points);
    }
    std::vector<Drawn> draw(std::size_t count) const { return draw(count, fixture().context().quirks().lanes); }
};

Scene lamp_scene() {
    Scene scene;
    scene.materials.emplace_back().emission = vec3(2.0f);
    return scene;
}

Light object_light(Light::Kind kind) {
    Light light;
    light.kind = kind;
    return light;
}

/// Counts of pairs of numbers in [0, 1).
struct Grid {
    std::vector<double> found = std::vector<double>(kBins * kBins);

    void add(double x, double y) {
        const auto bin = [](double v) { return std::clamp(int(v * kBins), 0, kBins - 1); };
        found[bin(y) * kBins + bin(x)] += 1.0;
    }
    void check_uniform() const {
        double count = 0.0;
        for (const double n : found) count += n;
        const double p = chi_square(std::vector<double>(found.size(), count / double(found.size())), found);
        CAPTURE(p, kSignificance);
        CHECK(p >= kSignificance);
    }
};

/// Checks the two densities of each sample, and that what it gives is radiance / density.
void check_densities(const std::vector<Drawn>& draws, const auto& expected) {
    std::size_t wrong = 0, differing = 0, bright = 0;
    for (const Drawn& drawn : draws) {
        const double density = drawn.direction_density.w;
        if (!(std::abs(density / expected(drawn) - 1.0) <= 1e-3)) ++wrong;
        if (!(std::abs(drawn.density.x / density - 1.0) <= 1e-3)) ++differing;
        if (!(std::abs(drawn.point_irradiance.w * density / 2.0 - 1.0) <= 1e-4)) ++bright;
    }
    CAPTURE(wrong, differing, bright);
    CHECK(wrong == 0);
    CHECK(differing <= draws.size() / 1000);  // at a sphere's edge, where rounding decides
    CHECK(bright == 0);
}

/// An axis and two directions perpendicular to it.
dmat3 frame_around(const dvec3& axis) {
    const dvec3 z = glm::normalize(axis),
                x = glm::normalize(glm::cross(z, std::abs(z.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
    return {x, glm::cross(z, x), z};
}

/// Checks that directions are uniform over those in which a sphere is seen.
void check_cone(const std::vector<dvec3>& directions, const dvec3& to_middle, double radius) {
    const double distance = glm::length(to_middle), sine = radius / distance;
    const double width = distance < radius ? 2.0 : 1.0 - std::sqrt(1.0 - sine * sine);
    const dmat3 frame = frame_around(to_middle);
    Grid grid;
    std::size_t beside = 0;
    for (const dvec3& direction : directions) {
        const dvec3 in_frame = glm::transpose(frame) * direction;
        // 1 - cosine, without cancellation.
        const double across = std::hypot(in_frame.x, in_frame.y);
        const double off_axis = in_frame.z > 0.0 ? across * across / (1.0 + in_frame.z) : 1.0 - in_frame.z;
        if (off_axis > width * (1.0 + 1e-4)) ++beside;
        grid.add(off_axis / width, (std::atan2(in_frame.y, in_frame.x) / kPi + 1.0) / 2.0);
    }
    CHECK(beside == 0);
    grid.check_uniform();
}

}  // namespace

TEST_CASE("points of an area light are drawn uniformly", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    Light light;
    light.kind = Light::Kind::area;
    light.area = {{1, 3, -2}, {0.3f, -1, 0.4f}, 1.5f, vec3(2.0f)};
    scene.lights = {light};
    const LightCase one{flatten(scene), {0.5f, 0, 0}};
    const shared::Light& made = one.arrays.lights[0];
    const dvec3 middle(made.position[0], made.position[1], made.position[2]),
        u(made.tangent[0], made.tangent[1], made.tangent[2]),
        n(made.direction[0], made.direction[1], made.direction[2]), v = glm::cross(n, u);
    Grid grid;
    std::size_t wrong = 0;
    for (const Drawn& drawn : one.draw(kDraws)) {
        const dvec3 at = dvec3(vec3(drawn.point_irradiance)) - middle;
        grid.add(glm::dot(at, u) / 1.5 + 0.5, glm::dot(at, v) / 1.5 + 0.5);
        const dvec3 to = dvec3(vec3(drawn.point_irradiance)) - dvec3(one.origin);
        const double expected = 2.0 * 1.5 * 1.5 * std::abs(glm::dot(n, glm::normalize(to))) / glm::dot(to, to);
        if (!(std::abs(drawn.point_irradiance.w / expected - 1.0) <= 1e-4)) ++wrong;
    }
    grid.check_uniform();
    CHECK(wrong == 0);
}

TEST_CASE("points of a mesh are drawn uniformly over its area", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    Mesh mesh;
    RandomSource random(5);
    for (std::uint32_t i = 0; i < 7; ++i) {  // flat, so that one normal is all triangles'
        for (int corner = 0; corner < 3; ++corner)
            mesh.positions.emplace_back(float(i) * 3.0f + random.uniform_float(0, 2), random.uniform_float(0, 2),
                                        -4.0f);
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    scene.meshes = {mesh};
    scene.lights = {object_light(Light::Kind::mesh)};
    const LightCase one{flatten(scene), {6.0f, 1.0f, 0.0f}};
    const std::vector<Drawn> draws = one.draw(kDraws);
    // Each triangle is cut into kCuts^2 that are alike.
    constexpr int kCuts = 4;
    std::vector<double> expected(7 * kCuts * kCuts), found(expected.size());
    double total = 0.0;
    for (std::size_t i = 0; i < 7; ++i) {
        const dvec3 a(mesh.positions[3 * i]), b(mesh.positions[3 * i + 1]), c(mesh.positions[3 * i + 2]);
        const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
        total += area;
        std::fill_n(expected.begin() + static_cast<std::ptrdiff_t>(i * kCuts * kCuts), kCuts * kCuts, area);
    }
    for (double& share : expected) share *= double(kDraws) / (total * kCuts * kCuts);
    for (const Drawn& drawn : draws) {
        const dvec3 at(vec3(drawn.point_irradiance));
        const auto i = static_cast<std::size_t>(std::clamp(at.x / 3.0, 0.0, 6.0));
        const dvec3 a(mesh.positions[3 * i]), u = dvec3(mesh.positions[3 * i + 1]) - a,
                                              v = dvec3(mesh.positions[3 * i + 2]) - a;
        const double all = u.x * v.y - u.y * v.x, x = at.x - a.x, y = at.y - a.y;
        const double of_u = kCuts * (x * v.y - y * v.x) / all, of_v = kCuts * (u.x * y - u.y * x) / all;
        const int column = std::clamp(int(of_u), 0, kCuts - 1), row = std::clamp(int(of_v), 0, kCuts - 1 - column);
        const bool is_upper = (of_u - column) + (of_v - row) > 1.0 && column + row < kCuts - 1;
        // Row by row: of each row first the triangles that stand as the whole does, then the others.
        const int first = row * (2 * kCuts - row);
        found[i * kCuts * kCuts + first + (is_upper ? kCuts - row : 0) + column] += 1.0;
    }
    const double p = chi_square(expected, found);
    CAPTURE(p, kSignificance);
    CHECK(p >= kSignificance);
    check_densities(draws, [&](const Drawn& drawn) {
        const dvec3 to = dvec3(vec3(drawn.point_irradiance)) - dvec3(one.origin);
        return glm::dot(to, to) / (total * std::abs(glm::normalize(to).z));
    });
}

TEST_CASE("points of smooth meshes are weighed the same whatever the normal", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    Mesh mesh;
    mesh.positions = {{0, 0, -4}, {2, 0, -4}, {0, 1, -3}};
    mesh.triangles = {{0, 1, 2}};
    mesh.normals = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    scene.meshes = {mesh};
    scene.lights = {object_light(Light::Kind::mesh)};
    LightCase one{flatten(scene)};
    for (const vec3& normal : {vec3(0, 0, 1), vec3(0.6f, -0.8f, 0)}) {
        one.normal = normal;
        std::size_t differing = 0;
        for (const Drawn& drawn : one.draw(1024))
            differing += !(std::abs(drawn.density.x / drawn.direction_density.w - 1.0f) <= 1e-5f);
        CHECK(differing == 0);
    }
}

struct Resampled {
    vec4 point_irradiance, density;
};

std::vector<Resampled> resample(const SceneArrays& arrays, const vec3& position, const vec3& normal,
                                bool has_both_sides, std::size_t count, std::uint32_t lanes) {
    RandomSource random(9);
    std::vector<vec4> points;
    const auto unit = [&] { return static_cast<float>(random.bits() >> 8) * 0x1p-24f; };
    for (std::size_t i = 0; i < count; ++i) {
        const float x = unit(), y = unit(), choice = unit();
        points.emplace_back(x, y, choice, 0.5f);
    }
    const std::vector<shared::Emitter> emitters(arrays.emitters.begin(), arrays.emitters.end());
    const std::string width = std::to_string(lanes), kernel = "resample_meshes_test";
    return fixture().run_kernel<Resampled>("light_sampling_test.x" + width, lanes > 1 ? kernel + width : kernel, count,
                                           arrays.lights[0], vec4(position, 0.0f), vec4(normal, 0.0f),
                                           std::uint32_t{has_both_sides}, emitters, points);
}

/// The irradiance, by a sum over many points of each triangle, that those of the radiance 2 give which are not hidden.
double irradiance_of(const Mesh& mesh, const dvec3& position, const dvec3& normal, bool has_both_sides,
                     const auto& is_hidden) {
    constexpr int kCuts = 400;
    double sum = 0.0;
    for (const glm::uvec3& triangle : mesh.triangles) {
        const dvec3 a(mesh.positions[triangle.x]), u = dvec3(mesh.positions[triangle.y]) - a,
                                                   v = dvec3(mesh.positions[triangle.z]) - a;
        const dvec3 across = glm::cross(u, v);
        for (int i = 0; i < kCuts; ++i) {
            for (int j = 0; j < kCuts; ++j) {
                const double root = std::sqrt((i + 0.5) / kCuts), down = (j + 0.5) / kCuts;
                const dvec3 to = a + root * (1.0 - down) * u + root * down * v - position;
                if (is_hidden(across, to)) continue;
                const double squared = glm::dot(to, to), above = glm::dot(normal, to) / std::sqrt(squared);
                const double cosine = has_both_sides ? std::abs(above) : std::max(above, 0.0);
                sum += cosine * std::abs(glm::dot(across, to)) / (squared * std::sqrt(squared));
            }
        }
    }
    return 2.0 * 0.5 * sum / (kCuts * kCuts);
}

Mesh box_mesh(const vec3& half) {
    Mesh mesh;
    for (int i = 0; i < 8; ++i) mesh.positions.push_back(half * vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    for (const auto& [a, b, c, d] : {std::array{0u, 4u, 6u, 2u},
                                     {1u, 3u, 7u, 5u},
                                     {0u, 1u, 5u, 4u},
                                     {2u, 6u, 7u, 3u},
                                     {0u, 2u, 3u, 1u},
                                     {4u, 5u, 7u, 6u}}) {
        mesh.triangles.emplace_back(a, b, c);
        mesh.triangles.emplace_back(a, c, d);
    }
    return mesh;
}

/// The same surface, of four times as many triangles.
Mesh subdivided(const Mesh& mesh) {
    Mesh fine;
    for (const glm::uvec3& triangle : mesh.triangles) {
        const vec3 a = mesh.positions[triangle.x], b = mesh.positions[triangle.y], c = mesh.positions[triangle.z];
        const auto first = static_cast<std::uint32_t>(fine.positions.size());
        fine.positions.insert(fine.positions.end(), {a, b, c, 0.5f * (a + b), 0.5f * (b + c), 0.5f * (c + a)});
        for (const glm::uvec3& part : {glm::uvec3(0, 3, 5), {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
            fine.triangles.push_back(part + first);
    }
    return fine;
}

// The outward normal of the box's face at a point.
dvec3 outward_of_box(const vec3& at) {
    const dvec3 part = glm::abs(dvec3(at)) / dvec3(1.0, 0.2, 0.7);
    const int axis = part.x > part.y && part.x > part.z ? 0 : part.y > part.z ? 1 : 2;
    dvec3 outward(0.0);
    outward[axis] = at[axis] > 0.0f ? 1.0 : -1.0;
    return outward;
}

TEST_CASE("points of meshes that are worth a ray give the light that all points give", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    scene.meshes = {box_mesh({1.0f, 0.2f, 0.7f})};
    scene.lights = {object_light(Light::Kind::mesh)};
    struct Case {
        const char* name;
        vec3 position, normal;
        bool has_both_sides = false, is_open = false, is_turned = false, is_within = false, is_fine = false;
    };
    for (const Case& one :
         {Case{"below", {0.3f, -2.0f, 0.5f}, {0, 1, 0}}, Case{"near a side", {1.3f, 0.1f, 0.0f}, {-0.8f, 0.6f, 0.0f}},
          Case{"from both sides", {0.5f, 1.5f, 0.9f}, {0.6f, 0.8f, 0.0f}, true},
          Case{"turned inside out", {0.3f, -2.0f, 0.5f}, {0, 1, 0}, false, false, true},
          Case{"open", {0.3f, -2.0f, 0.5f}, {0, 1, 0}, false, true},
          Case{"from within", {0.3f, 0.05f, 0.1f}, {0, 1, 0}, false, false, false, true}}) {
        CAPTURE(one.name);
        Mesh& mesh = scene.meshes[0];
        mesh = box_mesh({1.0f, 0.2f, 0.7f});
        if (one.is_fine) mesh = subdivided(mesh);
        if (one.is_open) mesh.triangles.pop_back();
        if (one.is_turned) {
            for (glm::uvec3& triangle : mesh.triangles) std::swap(triangle.y, triangle.z);
        }
        const SceneArrays arrays = flatten(scene);
        const double side = one.is_turned ? -1.0 : 1.0;
        const bool hides = !one.is_open && !one.is_within;
        const auto is_hidden = [&](const dvec3& across, const dvec3& to) {
            return hides && side * glm::dot(across, to) > 0.0;
        };
        const double expected =
            irradiance_of(mesh, dvec3(one.position), dvec3(one.normal), one.has_both_sides, is_hidden);
        double sum = 0.0, squares = 0.0;
        std::size_t hidden = 0, dark = 0;
        for (const Resampled& drawn : resample(arrays, one.position, one.normal, one.has_both_sides, kDraws,
                                               fixture().context().quirks().lanes)) {
            const dvec3 at(vec3(drawn.point_irradiance)), to = at - dvec3(one.position);
            const double above = glm::dot(dvec3(one.normal), glm::normalize(to));
            const double value =
                drawn.point_irradiance.w * (one.has_both_sides ? std::abs(above) : std::max(above, 0.0));
            sum += value;
            squares += value * value;
            if (drawn.point_irradiance.w == 0.0f) {
                ++dark;
                continue;
            }
            hidden += hides && glm::dot(outward_of_box(vec3(at)), to) > 1e-6;
        }
        const double mean = sum / double(kDraws);
        const double error = std::sqrt((squares / double(kDraws) - mean * mean) / double(kDraws));
        CAPTURE(mean, expected, error, dark);
        CHECK(std::abs(mean - expected) <= 4.0 * error + 1e-4 * expected);
        CHECK(hidden <= 10);  // on edges the test does not know the face
        CHECK((dark == 0 || one.is_fine));
        // One point drawn by area, as good as it may be, has more noise.
        double plain = 0.0, plain_squares = 0.0;
        for (const Drawn& drawn : LightCase{arrays, one.position}.draw(kDraws)) {
            const dvec3 to = dvec3(vec3(drawn.point_irradiance)) - dvec3(one.position);
            const double above = glm::dot(dvec3(one.normal), glm::normalize(to));
            const double value =
                hides && glm::dot(outward_of_box(vec3(drawn.point_irradiance)), to) > 0.0
                    ? 0.0
                    : drawn.point_irradiance.w * (one.has_both_sides ? std::abs(above) : std::max(above, 0.0));
            plain += value;
            plain_squares += value * value;
        }
        plain /= double(kDraws);
        CHECK(error * error < (plain_squares / double(kDraws) - plain * plain) / double(kDraws));
    }
}

TEST_CASE("points of meshes that are worth a ray are the same for any number of lanes", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    scene.meshes = {box_mesh({1.0f, 0.2f, 0.7f})};
    scene.meshes[0].motion = {0.5f, 0.0f, -0.25f};
    scene.lights = {object_light(Light::Kind::mesh)};
    const SceneArrays arrays = flatten(scene);
    const auto draw = [&](std::uint32_t lanes) {
        return resample(arrays, {0.3f, -2.0f, 0.5f}, {0, 1, 0}, true, 4096, lanes);
    };
    const std::vector<Resampled> a = draw(1), b = draw(16);
    CHECK(std::memcmp(a.data(), b.data(), a.size() * sizeof(Resampled)) == 0);
    // Of a mesh without area, nothing.
    SceneArrays empty = arrays;
    empty.lights[0].count = 0;
    for (const Resampled& drawn : resample(empty, {0.3f, -2.0f, 0.5f}, {0, 1, 0}, true, 64, 16))
        CHECK((drawn.point_irradiance.w == 0.0f && drawn.density.x == 0.0f));
}

TEST_CASE("directions to a sphere are drawn uniformly over those in which it is seen", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    scene.spheres = {{{1, 2, -5}, 1.5f, 0, 0}};
    scene.lights = {object_light(Light::Kind::sphere)};
    const SceneArrays arrays = flatten(scene);
    for (const vec3& origin : {vec3(0, 0, 0), vec3(1, 2, -3.4f), vec3(1.5f, 2, -5), vec3(40, 2, 10)}) {
        CAPTURE(origin.x, origin.y, origin.z);
        const LightCase one{arrays, origin};
        const std::vector<Drawn> draws = one.draw(kDraws);
        std::vector<dvec3> directions;
        for (const Drawn& drawn : draws) directions.emplace_back(vec3(drawn.direction_density));
        const dvec3 to_middle = dvec3(1, 2, -5) - dvec3(origin);
        check_cone(directions, to_middle, 1.5);
        const double sine = 1.5 / glm::length(to_middle);
        const double width = sine > 1.0 ? 2.0 : sine * sine / (1.0 + std::sqrt(1.0 - sine * sine));
        check_densities(draws, [&](const Drawn&) { return 1.0 / (2.0 * kPi * width); });
    }
}

TEST_CASE("directions to a sun are drawn uniformly over its disk", "[kernels][light_sampling]") {
    Scene scene;
    Light sun;
    sun.kind = Light::Kind::directional;
    sun.directional = {{-1, -2, 5}, vec3(2.0f)};
    for (const float angle : {0.0093f, 0.5f, 3.0f}) {
        CAPTURE(angle);
        sun.directional.angle_radians = angle;
        scene.lights = {sun};
        const LightCase one{flatten(scene)};
        std::vector<Drawn> draws = one.draw(kDraws);
        std::vector<dvec3> directions;
        for (Drawn& drawn : draws) {
            directions.emplace_back(vec3(drawn.direction_density));
            drawn.point_irradiance.w *= 1.0f / drawn.direction_density.w;  // the irradiance, not the radiance
        }
        const double half_sine = std::sin(0.25 * double{angle}), width = 2.0 * half_sine * half_sine;
        check_cone(directions, {1, 2, -5}, std::sqrt(30.0) * std::sin(0.5 * double{angle}));
        check_densities(draws, [&](const Drawn&) { return 1.0 / (2.0 * kPi * width); });
    }
}

TEST_CASE("directions to an ellipsoid that moves are drawn as to the sphere that it was", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    Sphere sphere{{0.5f, 0, 0}, 0.7f, 0, 0};
    sphere.transform[0] = {1.2f, 0.3f, 0};
    sphere.transform[1] = {-0.2f, 0.5f, 0.1f};
    sphere.transform[2] = {0, 0.4f, 2.0f};
    sphere.transform[3] = {1, 1, -4};
    sphere.motion = {0.5f, -1, 0.25f};
    scene.spheres = {sphere};
    scene.lights = {object_light(Light::Kind::sphere)};
    const SceneArrays arrays = flatten(scene);
    for (const vec3& origin : {vec3(0, 0, 0), vec3(9, -3, 2)}) {
        CAPTURE(origin.x, origin.y, origin.z);
        const LightCase one{arrays, origin};
        const std::vector<Drawn> draws = one.draw(kDraws);
        // In the space of the sphere.
        const dmat3 linear(dvec3(sphere.transform[0]), dvec3(sphere.transform[1]), dvec3(sphere.transform[2]));
        const dmat3 back = glm::inverse(linear);
        const dvec3 from = back * (dvec3(origin) - 0.5 * dvec3(sphere.motion) - dvec3(sphere.transform[3]));
        const dvec3 to_middle = dvec3(sphere.center) - from;
        std::vector<dvec3> directions;
        for (const Drawn& drawn : draws)
            directions.push_back(glm::normalize(back * dvec3(vec3(drawn.direction_density))));
        check_cone(directions, to_middle, double{sphere.radius});
        const double sine = double{sphere.radius} / glm::length(to_middle);
        const double width = sine * sine / (1.0 + std::sqrt(1.0 - sine * sine));
        // A solid angle about the unit direction d in the world is |det B| / |B d|^3 times as much there.
        check_densities(draws, [&](const Drawn& drawn) {
            const dvec3 there = back * dvec3(vec3(drawn.direction_density));
            return std::abs(glm::determinant(back)) / std::pow(glm::length(there), 3.0) / (2.0 * kPi * width);
        });
    }
}

TEST_CASE("points of lights are drawn alike by any number of lanes", "[kernels][light_sampling]") {
    Scene scene = lamp_scene();
    scene.spheres = {{{1, 2, -5}, 1.5f, 0, 0}};
    scene.spheres[0].transform[0] *= 2.0f;
    scene.lights = {object_light(Light::Kind::sphere)};
    const LightCase one{flatten(scene)};
    const std::vector<Drawn> a = one.draw(1024, 1), b = one.draw(1024, 16);
    CHECK(std::memcmp(a.data(), b.data(), a.size() * sizeof(Drawn)) == 0);
}

TEST_CASE("rays begin anywhere on a lens alike", "[kernels][light_sampling]") {
    Camera camera;
    camera.gaze = {1, -2, -3};
    camera.aperture_size = 0.5f;
    camera.focus_distance = 3.0f;
    const shared::Camera made = make_camera(camera, "test");
    REQUIRE(made.projection == CASTOR_PROJECTION_LENS);
    std::vector<vec4> pixels;
    for (std::uint32_t i = 0; i < kDraws; ++i) pixels.emplace_back(std::bit_cast<float>(i), 0.0f, 0.0f, 0.0f);
    const std::uint32_t lanes = fixture().context().quirks().lanes;
    const std::string width = std::to_string(lanes), kernel = "draw_lens_test";
    const dvec3 x(made.lens_x[0], made.lens_x[1], made.lens_x[2]), y(made.lens_y[0], made.lens_y[1], made.lens_y[2]);
    Grid grid;
    for (const vec4& origin : fixture().run_kernel<vec4>("light_sampling_test.x" + width,
                                                         lanes > 1 ? kernel + width : kernel, kDraws, made, pixels)) {
        const dvec3 at = dvec3(vec3(origin)) - dvec3(camera.position);
        grid.add(glm::dot(at, x) / glm::dot(x, x) + 0.5, glm::dot(at, y) / glm::dot(y, y) + 0.5);
    }
    CHECK(std::abs(glm::length(x) - 0.5) <= 1e-6);
    grid.check_uniform();
}

}  // namespace castor::test
