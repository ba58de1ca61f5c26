// The tree by which paths choose lights: that probabilities sum to 1, that lights are drawn with the ones that are
// stated, that no light that gives something has none, and that nothing depends on the number of lanes.
#include "scene/light_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/shared/constants.h"
#include "reference/random_source.h"
#include "scene/scene_arrays.h"
#include "support/catch.h"
#include "support/chi_square.h"
#include "support/kernel_fixture.h"
#include "support/picture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec2;
using glm::vec3;
using glm::vec4;
using reference::RandomSource;

struct Receiver {
    vec3 origin{0.0f}, normal{0.0f, 1.0f, 0.0f};
    bool has_both_sides = false;
};

struct Chosen {
    std::uint32_t number;
    float probability;
    float normal_x;
    float rest_and_sides;  // plus 1 where both sides count
};

KernelFixture& fixture() {
    static KernelFixture one;
    return one;
}

std::uint32_t usual_lanes() {
    return fixture().context().quirks().lanes;
}

/// A tree of lights on a device.
class LightTree {
public:
    explicit LightTree(const Scene& scene) : arrays_(flatten(scene)) {
        REQUIRE(problem_of_light_tree(arrays_).empty());
        nodes_.assign(arrays_.light_nodes.begin(), arrays_.light_nodes.end());
    }

    const SceneArrays& arrays() const { return arrays_; }
    std::size_t size() const { return arrays_.lights.size(); }

    /// The probability of each light.
    std::vector<double> probabilities(const Receiver& receiver, std::uint32_t lanes = usual_lanes()) const {
        std::vector<vec4> trails;
        for (const shared::Light& light : arrays_.lights)
            trails.emplace_back(0.0f, 0.0f, std::bit_cast<float>(light.trail), 0.0f);
        std::vector<double> found;
        const std::vector<Chosen> chosen = run(receiver, false, trails, lanes);
        for (std::size_t i = 0; i < chosen.size(); ++i) {
            if (chosen[i].number != i) FAIL("the trail of light " << i << " leads to light " << chosen[i].number);
            found.push_back(double{chosen[i].probability});
        }
        return found;
    }

    std::vector<Chosen> draw(const Receiver& receiver, std::size_t count, std::uint64_t seed,
                             std::uint32_t lanes = usual_lanes()) const {
        RandomSource random(seed);
        std::vector<vec2> points;
        const auto unit = [&] { return static_cast<float>(random.bits() >> 8) * 0x1p-24f; };
        for (std::size_t i = 0; i < count; ++i) {
            const float x = unit();
            points.emplace_back(x, unit());
        }
        return draw(receiver, points, lanes);
    }

    std::vector<Chosen> draw(const Receiver& receiver, const std::vector<vec2>& points,
                             std::uint32_t lanes = usual_lanes()) const {
        std::vector<vec4> rows;
        for (const vec2& point : points) rows.emplace_back(point, 0.0f, 0.0f);
        return run(receiver, true, rows, lanes);
    }

private:
    std::vector<Chosen> run(const Receiver& receiver, bool is_drawn, std::vector<vec4> points,
                            std::uint32_t lanes) const {
        const std::size_t count = points.size();
        points.resize((count + 15) / 16 * 16);
        const std::vector<vec4> origins(points.size(), vec4(receiver.origin, 0.0f)),
            normals(points.size(), vec4(receiver.normal, receiver.has_both_sides ? 1.0f : 0.0f));
        const std::string width = std::to_string(lanes), kernel = "choose_lights_test";
        std::vector<Chosen> chosen =
            fixture().run_kernel<Chosen>("light_tree_test.x" + width, lanes > 1 ? kernel + width : kernel,
                                         points.size(), nodes_, std::uint32_t{is_drawn}, origins, normals, points);
        chosen.resize(count);
        return chosen;
    }

    SceneArrays arrays_;
    std::vector<shared::LightNode> nodes_;
};

Light point(const vec3& position, const vec3& intensity) {
    Light light;
    light.point = {position, intensity};
    return light;
}

Light spot(const vec3& position, const vec3& direction, const vec3& intensity, float coverage, float falloff) {
    Light light;
    light.kind = Light::Kind::spot;
    light.spot = {position, direction, intensity, coverage, falloff};
    return light;
}

Light directional(const vec3& direction, const vec3& radiance) {
    Light light;
    light.kind = Light::Kind::directional;
    light.directional = {direction, radiance};
    return light;
}

Scene empty_scene() {
    Scene scene;
    scene.materials.emplace_back();
    scene.materials.back().emission = vec3(2.0f);
    return scene;
}

/// Lights of all kinds, some of them black, one above the other, or larger than what is between them.
Scene many_lights(std::size_t count, std::uint64_t seed) {
    RandomSource random(seed);
    Scene scene = empty_scene();
    Image sky{"", 4, 2, {}, {}};
    for (int i = 0; i < 24; ++i) sky.floats.push_back(random.uniform_float(0.0f, 2.0f));
    scene.images = {sky};
    const auto place = [&] {
        return 4.0f * vec3(random.uniform_float(-1, 1), random.uniform_float(-1, 1), random.uniform_float(-1, 1));
    };
    for (std::size_t i = 0; i < count; ++i) {
        const vec3 color = i % 13 == 0 ? vec3(0.0f) : vec3(std::pow(1000.0f, random.uniform_float(-1.0f, 1.0f)));
        const float size = random.uniform_float(0.01f, 1.5f);
        Light light;
        switch (i % 8) {
            case 0:
                light = spot(place(), random.direction(), color, random.uniform_float(1.0f, 6.2f), 0.9f);
                break;
            case 1:
                light.kind = Light::Kind::area;
                light.area = {place(), random.direction(), size, color};
                break;
            case 2:
                light.kind = Light::Kind::sphere;
                light.object.object = static_cast<std::uint32_t>(scene.spheres.size());
                scene.spheres.push_back({place(), size, 0, 0});
                if (i % 16 == 2) scene.spheres.back().transform[0] *= 3.0f;
                if (i % 24 == 2) scene.spheres.back().motion = place();
                break;
            case 3:
                light.kind = Light::Kind::mesh;
                light.object.object = static_cast<std::uint32_t>(scene.meshes.size());
                scene.meshes.push_back(rectangle(place(), size * random.direction(), size * random.direction(), 0));
                break;
            case 4:
                light = point(vec3(1.0f, 2.0f, 0.5f), color);  // all at the same place
                break;
            case 5:
                if (i == 5) {
                    light.kind = Light::Kind::environment;
                    break;
                }
                light = directional(random.direction(), 0.01f * color);
                break;
            default:
                light = point(place(), color);
        }
        scene.lights.push_back(light);
    }
    return scene;
}

std::vector<Receiver> receivers(std::uint64_t seed) {
    RandomSource random(seed);
    std::vector<Receiver> all;
    for (const float scale : {0.5f, 2.0f, 4.0f, 20.0f, 1e4f, 1e12f})
        for (int i = 0; i < 3; ++i) all.push_back({scale * random.direction(), random.direction(), i == 1});
    all.push_back({{1.0f, 2.0f, 0.5f}, {0, 1, 0}, false});  // where lights are
    return all;
}

double sum_of(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum;
}

}  // namespace

TEST_CASE("the probabilities of lights sum to 1 at any point", "[kernels][light_tree]") {
    for (const std::size_t count : {2, 3, 9, 500}) {
        const LightTree tree(many_lights(count, count));
        for (const Receiver& at : receivers(count)) {
            CAPTURE(count, at.origin.x, at.origin.y, at.origin.z);
            const std::vector<double> found = tree.probabilities(at);
            CHECK(std::all_of(found.begin(), found.end(), [](double p) { return p >= 0.0 && p <= 1.0; }));
            CHECK(std::abs(sum_of(found) - 1.0) <= 1e-5);
        }
    }
}

TEST_CASE("lights are chosen with the probabilities that are stated", "[kernels][light_tree]") {
    const LightTree tree(many_lights(300, 1));
    const std::vector<Receiver> all = receivers(2);
    constexpr std::size_t kEvery = 4, kDraws = 1 << 20;
    const double significance = 1 - std::pow(1 - 0.01, double(kEvery) / double(all.size()));  // Sidak
    double least = 1.0;
    for (std::size_t i = 0; i < all.size(); i += kEvery) {
        CAPTURE(i, all[i].origin.x, all[i].origin.y, all[i].origin.z);
        std::vector<double> expected = tree.probabilities(all[i]), found(expected.size());
        std::size_t differing = 0;
        for (const Chosen& chosen : tree.draw(all[i], kDraws, i)) {
            if (chosen.number >= found.size()) FAIL("light " << chosen.number << " of " << found.size());
            found[chosen.number] += 1.0;
            if (double{chosen.probability} != expected[chosen.number]) ++differing;
        }
        CHECK(differing == 0);
        for (double& share : expected) share *= double(kDraws);
        const double p = chi_square(expected, found);
        least = std::min(least, p);
        CHECK(p >= significance);
    }
    WARN("chi-square of chosen lights: least p " << least << ", allowed " << significance);
}

TEST_CASE("lights are chosen alike by any number of lanes", "[kernels][light_tree]") {
    const LightTree tree(many_lights(100, 3));
    for (const Receiver& at : receivers(4)) {
        const std::vector<Chosen> one = tree.draw(at, 512, 5, 1), many = tree.draw(at, 512, 5, 16);
        CHECK(std::memcmp(one.data(), many.data(), one.size() * sizeof(Chosen)) == 0);
        CHECK(tree.probabilities(at, 1) == tree.probabilities(at, 16));
    }
}

TEST_CASE("lights that give something at a point can be chosen there", "[kernels][light_tree]") {
    RandomSource random(6);
    Scene scene = empty_scene();
    for (int i = 0; i < 200; ++i) {
        const vec3 position = 3.0f * random.direction() * random.uniform_float(0.0f, 1.0f);
        const float coverage = random.uniform_float(0.02f, 6.28f);
        if (i % 3 == 0)
            scene.lights.push_back(point(position, vec3(1.0f)));
        else
            scene.lights.push_back(spot(position, random.direction(), vec3(1.0f), coverage,
                                        coverage * (i % 3 == 1 ? 1.0f : random.uniform_float(0.1f, 1.0f))));
    }
    const LightTree tree(scene);
    std::size_t lit = 0, missed = 0, dark = 0;
    for (int i = 0; i < 64; ++i) {
        const Receiver at{3.0f * random.direction(), random.direction(), i % 2 == 1};
        const std::vector<double> found = tree.probabilities(at);
        for (std::size_t light = 0; light < found.size(); ++light) {
            const bool is_spot = scene.lights[light].kind == Light::Kind::spot;
            const SpotLight& beam = scene.lights[light].spot;
            const dvec3 to = dvec3(is_spot ? beam.position : scene.lights[light].point.position) - dvec3(at.origin);
            const dvec3 wi = glm::normalize(to);
            const double above = glm::dot(wi, dvec3(at.normal));
            const bool is_seen = at.has_both_sides ? std::abs(above) > 1e-5 : above > 1e-5;
            const bool shines = !is_spot || glm::dot(-wi, glm::normalize(dvec3(beam.direction))) >
                                                std::cos(0.5 * beam.coverage_radians);
            if (is_seen && shines) {
                ++lit;
                if (!(found[light] > 0.0)) ++missed;
            } else if (found[light] == 0.0) {
                ++dark;
            }
        }
    }
    CAPTURE(lit, missed, dark);
    CHECK(lit > 1000);
    CHECK(missed == 0);
    CHECK(dark > 1000);  // and others are mostly left out
}

TEST_CASE("what is left of random numbers is spread as evenly over each light", "[kernels][light_tree]") {
    const LightTree tree(many_lights(40, 14));
    constexpr std::size_t kCount = 1 << 14;
    std::vector<vec2> points;
    for (std::size_t i = 0; i < kCount; ++i)
        points.emplace_back((static_cast<float>(i) + 0.5f) / kCount, static_cast<float>(i * 7 % 16) / 16);
    std::vector<std::vector<float>> rests(tree.size());
    for (const Chosen& found : tree.draw({{1, 2, 3}, {0, -1, 0}, false}, points))
        rests[found.number].push_back(found.rest_and_sides);
    std::size_t seen_often = 0;
    for (std::vector<float>& of_light : rests) {
        std::sort(of_light.begin(), of_light.end());
        const auto count = static_cast<double>(of_light.size());
        double farthest = 0.0;
        for (std::size_t i = 0; i < of_light.size(); ++i)
            farthest = std::max(farthest, std::abs(of_light[i] * count - (static_cast<double>(i) + 0.5)));
        CAPTURE(&of_light - rests.data(), count);
        CHECK(farthest <= 1.0);
        seen_often += of_light.size() > 100;
    }
    CHECK(seen_often > 5);
}

TEST_CASE("normals come back from a word, with their bit", "[kernels][light_tree]") {
    const LightTree tree(many_lights(2, 7));
    RandomSource random(8);
    std::vector<Receiver> all{{{}, {1, 0, 0}, true}, {{}, {0, 0, 1}, false}, {{}, {0, -1, 0}, true}};
    for (int i = 0; i < 200; ++i) all.push_back({{}, random.direction(), i % 2 == 0});
    for (const Receiver& at : all) {
        const Chosen found = tree.draw(at, 1, 9).front();
        CAPTURE(at.normal.x, at.normal.y, at.normal.z);
        CHECK(std::abs(found.normal_x - at.normal.x) <= 2e-4f);
        CHECK((found.rest_and_sides >= 1.0f) == at.has_both_sides);
    }
}

TEST_CASE("a hundred thousand lights have a tree, wherever they are", "[light_tree]") {
    Scene scene = empty_scene();
    RandomSource random(10);
    scene.lights.assign(100'000, point({1e12f, -1e12f, 1e12f}, vec3(1.0f)));
    SceneArrays arrays = flatten(scene);
    CHECK(problem_of_light_tree(arrays).empty());
    // Each half as far away as the other half is wide: as deep as bins alone would make it, it had no end.
    for (std::size_t i = 0; i < scene.lights.size(); ++i)
        scene.lights[i].point.position =
            i < 1000 ? vec3(std::ldexp(1.0f, -static_cast<int>(i % 120)), 0.0f, 0.0f) : 1e3f * random.direction();
    arrays = flatten(scene);
    CHECK(problem_of_light_tree(arrays).empty());
    CHECK(arrays.light_nodes.size() == 199'999);
    double flux = 0.0;
    for (const shared::LightNode& node : arrays.light_nodes)
        if (node.flags & CASTOR_LIGHT_NODE_LEAF) flux += double{node.flux};
    CHECK(std::abs(flux - 1.0) <= 1e-4);
}

TEST_CASE("a tree of lights is the same each time, and none where it is of no use", "[light_tree]") {
    const Scene scene = many_lights(5000, 11);
    const SceneArrays a = flatten(scene), b = flatten(scene);
    REQUIRE(a.light_nodes.size() == b.light_nodes.size());
    CHECK(std::memcmp(a.light_nodes.data(), b.light_nodes.data(), a.light_nodes.size() * sizeof(shared::LightNode)) ==
          0);
    CHECK(flatten(many_lights(1, 12)).light_nodes.empty());
    CHECK(flatten(empty_scene()).light_nodes.empty());
}

TEST_CASE("what is wrong with a tree of lights is told", "[light_tree]") {
    const SceneArrays whole = flatten(many_lights(20, 13));
    const auto problem_with = [&](const auto& damage) {
        SceneArrays arrays = whole;
        damage(arrays);
        return problem_of_light_tree(arrays);
    };
    const auto leaf = static_cast<std::size_t>(
        std::find_if(whole.light_nodes.begin(), whole.light_nodes.end(),
                     [](const shared::LightNode& node) { return node.flags & CASTOR_LIGHT_NODE_LEAF; }) -
        whole.light_nodes.begin());
    const std::uint32_t other = whole.light_nodes[leaf].first == 0 ? 1 : 0;
    CHECK(problem_with([](SceneArrays&) {}).empty());
    const auto contains = [](const char* text) { return Catch::Matchers::Contains(text); };
    CHECK_THAT(problem_with([](SceneArrays& a) { a.light_nodes.pop_back(); }), contains("expected 39 for 20"));
    CHECK_THAT(problem_with([](SceneArrays& a) { a.light_nodes[3].flux = NAN; }), contains("flux"));
    CHECK_THAT(problem_with([](SceneArrays& a) { a.light_nodes[3].flux = -1.0f; }), contains("flux"));
    CHECK_THAT(problem_with([](SceneArrays& a) { a.light_nodes[3].radius = INFINITY; }), contains("radius"));
    CHECK_THAT(problem_with([](SceneArrays& a) { a.light_nodes[0].first = 0; }), contains("first child"));
    CHECK_THAT(problem_with([](SceneArrays& a) { a.light_nodes[0].first = 38; }), contains("first child"));
    CHECK_THAT(problem_with([&](SceneArrays& a) { a.light_nodes[leaf].first = 20; }), contains("the light 20"));
    CHECK_FALSE(problem_with([&](SceneArrays& a) { a.light_nodes[leaf].first = other; }).empty());
    CHECK_THAT(problem_with([](SceneArrays& a) { a.lights[7].trail ^= 1u; }), contains("another trail"));
    CHECK_FALSE(problem_with([](SceneArrays& a) { a.light_nodes[0].first = 2; }).empty());
}

}  // namespace castor::test
