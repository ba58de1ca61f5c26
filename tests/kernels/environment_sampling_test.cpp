// Directions to environments, drawn by their pictures: that they are drawn with the density that is stated, that the
// density is that of the picture's light, and that nothing depends on the number of lanes. With a million directions
// each: the hidden tag [environment_full].
#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/shared/constants.h"
#include "reference/random_source.h"
#include "scene/environment_table.h"
#include "scene/scene_arrays.h"
#include "support/catch.h"
#include "support/chi_square.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec2;
using glm::dvec3;
using glm::vec4;
using reference::RandomSource;

constexpr double kPi = std::numbers::pi;

struct Drawn {
    vec4 direction_density;
    vec4 found;  // what the sample gives, the radiance from the direction, density_of_environment

    dvec3 direction() const { return dvec3(direction_density); }
    double density() const { return direction_density.w; }
};

/// (u, v) as EnvironmentMapping says it, in double precision.
dvec2 place_of(EnvironmentMapping mapping, const dvec3& d) {
    const double off_axis = std::hypot(d.x, d.y);
    if (mapping == EnvironmentMapping::latlong)
        return {(1.0 + std::atan2(d.x, -d.z) / kPi) / 2.0, std::atan2(std::hypot(d.x, d.z), d.y) / kPi};
    const double r = off_axis > 0.0 ? std::atan2(off_axis, -d.z) / (kPi * off_axis) : 0.0;
    return {(1.0 + r * d.x) / 2.0, (1.0 - r * d.y) / 2.0};
}

/// A picture of random greys between 1 and this contrast, which has bytes if that is at most 255.
Image random_picture(RandomSource& random, std::uint32_t width, std::uint32_t height, float contrast) {
    Image image{"", width, height, {}, {}};
    for (std::uint32_t i = 0; i < width * height; ++i) {
        const float value = std::pow(contrast, random.uniform_float(0.0f, 1.0f));
        if (contrast <= 255.0f)
            image.bytes.insert(image.bytes.end(), 3, static_cast<std::uint8_t>(value));
        else
            image.floats.insert(image.floats.end(), 3, value);
    }
    return image;
}

double value_of(const Image& image, std::size_t texel) {
    return image.floats.empty() ? image.bytes[3 * texel] : image.floats[3 * texel];
}

/// The value at a place of the picture, between the middles of texels.
double value_at(const Image& image, EnvironmentMapping mapping, const dvec2& place) {
    const dvec2 at = place * dvec2(image.width, image.height) - 0.5, first = glm::floor(at), between = at - first;
    double sum = 0.0;
    for (const int down : {0, 1})
        for (const int across : {0, 1}) {
            const int width = int(image.width), height = int(image.height);
            int x = int(first.x) + across;
            x = mapping == EnvironmentMapping::latlong ? (x + width) % width : std::clamp(x, 0, width - 1);
            const int y = std::clamp(int(first.y) + down, 0, height - 1);
            sum += (across ? between.x : 1 - between.x) * (down ? between.y : 1 - between.y) *
                   value_of(image, std::size_t(y * width + x));
        }
    return sum;
}

/// The mean over a texel of a latlong picture.
double mean_value(const Image& image, std::uint32_t x, std::uint32_t y) {
    double sum = 0.0;
    for (const double down : {0.25, 0.75})  // linear between the middles, so that these are enough
        for (const double across : {0.25, 0.75})
            sum += value_at(image, EnvironmentMapping::latlong,
                            dvec2(x + across, y + down) / dvec2(image.width, image.height));
    return sum / 4;
}

/// An environment on a device.
class Environment {
public:
    Environment(const Image& image, EnvironmentMapping mapping, bool is_joined = false,
                EnvironmentSampling sampling = EnvironmentSampling::picture)
        : is_joined_(is_joined) {
        Scene scene;
        scene.images = {image};
        Light light;
        light.kind = Light::Kind::environment;
        light.environment = {0, mapping, sampling};
        scene.lights = {light};
        scene.materials.emplace_back();
        scene.spheres = {{{0, 0, 0}, 1.0f, 0, 0}};
        arrays_ = flatten(scene);
        if (arrays_.environment_parts.empty()) arrays_.environment_parts.push_back(0);  // buffers have a size
    }

    const SceneArrays& arrays() const { return arrays_; }
    /// The words of the tree that is used.
    std::vector<std::uint32_t> tree() const {
        const auto& parts = arrays_.environment_parts;
        const auto first = parts.begin() + CASTOR_ENVIRONMENT_HEADER + (is_joined_ ? parts[3] : 0);
        return {first, first + parts[3]};
    }

    std::vector<Drawn> draw(std::size_t count, std::uint64_t seed, std::uint32_t lanes = usual_lanes()) const {
        RandomSource random(seed);
        std::vector<vec4> points;
        for (std::size_t i = 0; i < count; ++i) {
            const auto unit = [&] { return static_cast<float>(random.bits() >> 8) * 0x1p-24f; };
            const float x = unit();
            points.emplace_back(x, unit(), 0.0f, 0.0f);
        }
        return run<Drawn>("draw_environment_test", points, lanes);
    }

    /// The radiance and the density of directions.
    std::vector<vec4> look(const std::vector<vec4>& directions, std::uint32_t lanes = usual_lanes()) const {
        return run<vec4>("look_at_environment_test", directions, lanes);
    }

    static std::uint32_t usual_lanes() { return fixture().context().quirks().lanes; }

private:
    static KernelFixture& fixture() {
        static KernelFixture one;
        return one;
    }

    template <class Out>
    std::vector<Out> run(const std::string& kernel, const std::vector<vec4>& rows, std::uint32_t lanes) const {
        REQUIRE(rows.size() % 16 == 0);
        const std::vector<shared::TextureImage> images(arrays_.texture_images.begin(), arrays_.texture_images.end());
        const std::vector<std::uint32_t> texels(arrays_.texels.begin(), arrays_.texels.end());
        const std::vector<std::uint32_t> parts(arrays_.environment_parts.begin(), arrays_.environment_parts.end());
        const std::string width = std::to_string(lanes);
        return fixture().run_kernel<Out>("environment_test.x" + width, lanes > 1 ? kernel + width : kernel, rows.size(),
                                         arrays_.lights[0], std::uint32_t{is_joined_}, images, texels, parts, rows);
    }

    SceneArrays arrays_;
    bool is_joined_;
};

struct Case {
    std::uint32_t width, height;
    float contrast;
    EnvironmentMapping mapping;
    bool is_joined;
};

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const auto mapping : {EnvironmentMapping::latlong, EnvironmentMapping::probe})
        for (const bool is_joined : {false, true}) {
            for (const auto& [width, height] : {std::pair(1u, 1u), {2u, 1u}, {7u, 5u}, {13u, 64u}, {64u, 32u}})
                all.push_back({width, height, 100.0f, mapping, is_joined});
            all.push_back({40, 40, 1e6f, mapping, is_joined});
        }
    all.push_back({1111, 700, 1e3f, EnvironmentMapping::latlong, false});  // cells of 2 x 2 texels
    all.push_back({1111, 700, 1e3f, EnvironmentMapping::probe, true});
    return all;
}

std::vector<vec4> random_directions(std::uint64_t seed, std::size_t count) {
    RandomSource random(seed);
    std::vector<vec4> directions;
    while (directions.size() < count) directions.emplace_back(random.direction(), 0.0f);
    return directions;
}

/// The solid angle of each texel of a latlong picture.
std::vector<double> solid_angles(const Image& image) {
    std::vector<double> angles;
    for (std::uint32_t y = 0; y < image.height; ++y)
        angles.insert(
            angles.end(), image.width,
            2 * kPi / image.width * (std::cos(kPi * y / image.height) - std::cos(kPi * (y + 1.0) / image.height)));
    return angles;
}

/// Tests that directions fall on texels as their light says, and that their density is what it is said to be.
void check_draws(std::size_t count, std::uint64_t seed) {
    const std::vector<Case> all = cases();
    const double significance = 1 - std::pow(1 - 0.01, 0.5 / double(all.size()));  // Sidak
    RandomSource random(seed);
    double least = 1.0;
    for (const Case& one : all) {
        CAPTURE(one.width, one.height, one.contrast, int(one.mapping), one.is_joined);
        const Image image = random_picture(random, one.width, one.height, one.contrast);
        const Environment environment(image, one.mapping, one.is_joined);
        const std::vector<Drawn> draws = environment.draw(count, random.bits());

        // By the picture.
        std::vector<double> expected, found(image.width * image.height);
        const std::vector<double> angles = solid_angles(image);
        std::vector<double> means;
        for (std::uint32_t y = 0; y < image.height; ++y)
            for (std::uint32_t x = 0; x < image.width; ++x) means.push_back(mean_value(image, x, y));
        double light = 0.0;
        for (std::size_t i = 0; i < angles.size(); ++i) light += means[i] * angles[i];
        double total = 0.0;
        for (std::size_t i = 0; i < angles.size(); ++i) {
            const double above = std::max(0.0, means[i] - light / (4 * kPi));
            expected.push_back(angles[i] * (one.is_joined && one.width > 1 ? above : means[i]));
            total += expected.back();
        }
        for (double& share : expected) share *= double(count) / total;
        std::size_t directions = 0, bent = 0, differing = 0;
        // By the density: as many of each part of the sphere as 1 / density says, with their errors.
        constexpr int kBands = 8, kTurns = 16;
        std::vector<double> sums(kBands * kTurns), squares(kBands * kTurns);
        for (const Drawn& drawn : draws) {
            if (!(drawn.density() > 0.0)) continue;
            const dvec3 d = drawn.direction();
            if (!(std::abs(glm::length(d) - 1.0) < 1e-6)) ++bent;
            ++directions;
            const dvec2 place = place_of(one.mapping, d) * dvec2(image.width, image.height);
            const auto x = std::min(static_cast<std::uint32_t>(place.x), image.width - 1);
            const auto y = std::min(static_cast<std::uint32_t>(place.y), image.height - 1);
            found[y * image.width + x] += 1.0;
            // Where rounding puts the direction beside an edge, it sees another texel.
            if (std::abs(drawn.found.z - drawn.density()) > 1e-4 * drawn.density()) ++differing;
            CHECK(std::abs(drawn.found.x * drawn.density() - drawn.found.y) <= 1e-5 * drawn.found.y);
            const int band = std::min(int((d.y + 1) / 2 * kBands), kBands - 1);
            const int turn = std::min(int((std::atan2(d.z, d.x) / kPi + 1) / 2 * kTurns), kTurns - 1);
            sums[band * kTurns + turn] += 1 / drawn.density();
            squares[band * kTurns + turn] += std::pow(drawn.density(), -2.0);
        }
        CHECK(bent == 0);
        CHECK(double(differing) <= 1e-3 * double(count));
        // A table has the texels of a probe as if they were nearer to the middle, and cells of many texels in large
        // pictures.
        const bool is_exact = one.mapping == EnvironmentMapping::latlong && one.width <= 64;
        if (is_exact) {
            CHECK(directions == count);
            const double p = chi_square(expected, found);
            least = std::min(least, p);
            CAPTURE(p, significance);
            CHECK(p >= significance);
        }
        if (one.is_joined || one.contrast > 200.0f) continue;  // nearly all is dark
        double worst = 0.0;
        for (std::size_t i = 0; i < sums.size(); ++i) {
            const double mean = sums[i] / double(count), square = squares[i] / double(count);
            const double error = std::sqrt((square - mean * mean) / double(count));
            worst = std::max(worst, std::abs(mean - 4 * kPi / double(sums.size())) / error);
        }
        CAPTURE(worst);
        CHECK(worst <= 5.0);
    }
    WARN("chi-square of environments with " << count << " directions each: least p " << least << ", allowed "
                                            << significance);
}

/// Tests the cells that are drawn against the table itself.
void check_cells(std::size_t count, std::uint64_t seed) {
    RandomSource random(seed);
    for (const auto& [width, height] : {std::pair(37u, 20u), {1u, 9u}, {16u, 16u}}) {
        CAPTURE(width, height);
        const Environment environment(random_picture(random, width, height, 1e4f), EnvironmentMapping::latlong);
        std::vector<double> shares;
        for (const vec4& found : environment.look([&, w = width, h = height] {
                 std::vector<vec4> middles;
                 for (std::uint32_t y = 0; y < h; ++y)
                     for (std::uint32_t x = 0; x < w; ++x) {
                         const double theta = kPi * (y + 0.5) / h, phi = 2 * kPi * ((x + 0.5) / w - 0.5);
                         middles.emplace_back(glm::vec3(dvec3(std::sin(theta) * std::sin(phi), std::cos(theta),
                                                              -std::sin(theta) * std::cos(phi))),
                                              0.0f);
                     }
                 middles.resize((middles.size() + 15) / 16 * 16, vec4(0, 1, 0, 0));
                 return middles;
             }()))
            shares.push_back(found.y);
        shares.resize(width * height);
        double total = 0.0;
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x)
                total += shares[y * width + x] *=
                    2 * kPi / width * (std::cos(kPi * y / height) - std::cos(kPi * (y + 1.0) / height));
        CHECK(std::abs(total - 1.0) < 1e-5);
        std::vector<double> found(shares.size());
        for (double& share : shares) share *= double(count);
        for (const Drawn& drawn : environment.draw(count, random.bits())) {
            const dvec2 place = place_of(EnvironmentMapping::latlong, drawn.direction()) * dvec2(width, height);
            found[std::min(static_cast<std::uint32_t>(place.y), height - 1) * width +
                  std::min(static_cast<std::uint32_t>(place.x), width - 1)] += 1.0;
        }
        CHECK(chi_square(shares, found) >= 1 - std::pow(1 - 0.01, 1.0 / 3));
    }
}

}  // namespace

TEST_CASE("directions to environments are drawn as their light is distributed", "[kernels][environment]") {
    check_draws(1 << 17, 5);
    check_cells(1 << 17, 6);
}

TEST_CASE("directions to environments are drawn as their light is distributed, a million each",
          "[.][environment_full]") {
    check_draws(1 << 20, 15);
    check_cells(1 << 20, 16);
}

TEST_CASE("the density of directions to an environment integrates to 1", "[kernels][environment]") {
    RandomSource random(8);
    for (const auto mapping : {EnvironmentMapping::latlong, EnvironmentMapping::probe})
        for (const bool is_joined : {false, true}) {
            CAPTURE(int(mapping), is_joined);
            const Environment environment(random_picture(random, 33, 16, 50.0f), mapping, is_joined);
            double sum = 0.0, squares = 0.0;
            const std::vector<vec4> found = environment.look(random_directions(9, 1 << 18));
            for (const vec4& one : found) {
                sum += 4 * kPi * one.y;
                squares += std::pow(4 * kPi * one.y, 2.0);
            }
            const double mean = sum / double(found.size());
            const double error = std::sqrt((squares / double(found.size()) - mean * mean) / double(found.size()));
            CAPTURE(mean, error);
            // A probe's points outside of its disk have a density, too, and no direction.
            const double missing = mapping == EnvironmentMapping::probe ? 0.05 : 0.0;
            CHECK(mean <= 1.0 + 4 * error);
            CHECK(mean >= 1.0 - missing - 4 * error);
        }
}

TEST_CASE("directions to environments are the same for one lane and for sixteen", "[kernels][environment]") {
    if (test_device().platform_name == "rusticl") return;  // it compiles for minutes what has vectors
    RandomSource random(11);
    for (const auto mapping : {EnvironmentMapping::latlong, EnvironmentMapping::probe})
        for (const auto& [width, height] : {std::pair(1u, 1u), {2u, 1u}, {50u, 31u}, {1111u, 700u}}) {
            CAPTURE(int(mapping), width, height);
            const Environment environment(random_picture(random, width, height, 1e5f), mapping, width == 50);
            const std::vector<Drawn> one = environment.draw(4096, 12, 1), many = environment.draw(4096, 12, 16);
            CHECK(std::memcmp(one.data(), many.data(), one.size() * sizeof one[0]) == 0);
            std::vector<vec4> directions = random_directions(13, 4096);
            directions[0] = {0, 0, 1, 0};
            directions[1] = {0, 0, -1, 0};
            directions[2] = {0, 1, 0, 0};
            directions[3] = {0, -1, 0, 0};
            const std::vector<vec4> seen = environment.look(directions, 1), seen_by_many = environment.look(directions);
            CHECK(std::memcmp(seen.data(), seen_by_many.data(), seen.size() * sizeof seen[0]) == 0);
            CHECK(std::all_of(seen.begin(), seen.end(),
                              [](const vec4& found) { return found.y >= 0.0f && std::isfinite(found.y); }));
        }
}

TEST_CASE("one bright texel of a large picture is found by every direction", "[kernels][environment]") {
    Image image{"", 4096, 2048, {}, {}};
    image.floats.resize(std::size_t{3} * image.width * image.height);
    const std::uint32_t x = 1234, y = 777;
    image.floats[3 * (std::size_t{y} * image.width + x)] = 1e9f;
    for (const bool is_joined : {false, true}) {
        const Environment environment(image, EnvironmentMapping::latlong, is_joined);
        double sum = 0.0;
        const std::vector<Drawn> draws = environment.draw(4096, 21);
        for (const Drawn& drawn : draws) {
            const dvec2 place = place_of(EnvironmentMapping::latlong, drawn.direction()) * dvec2(4096, 2048);
            // A cell has 4 x 4 texels.
            CHECK((place.x > 1231.99 && place.x < 1236.01 && place.y > 775.99 && place.y < 780.01));
            sum += drawn.found.x;
        }
        const double angle = 2 * kPi / 4096 * (std::cos(kPi * y / 2048) - std::cos(kPi * (y + 1) / 2048));
        const double mean = sum / double(draws.size()), error = 1e9 * angle * std::sqrt(15.0 / double(draws.size()));
        CAPTURE(mean, 1e9 * angle, error);
        CHECK(std::abs(mean - 1e9 * angle) <= 4 * error);
    }
}

TEST_CASE("black environments, and those that are the same everywhere, are drawn uniformly", "[kernels][environment]") {
    for (const float value : {0.0f, 3.0f})
        for (const bool is_joined : {false, true}) {
            CAPTURE(value, is_joined);
            Image image{"", 20, 10, {}, {}};
            image.floats.assign(600, value);
            for (const Drawn& drawn : Environment(image, EnvironmentMapping::latlong, is_joined).draw(1024, 31)) {
                CHECK(std::abs(drawn.density() * 4 * kPi - 1.0) < 1e-4);
                CHECK(std::abs(drawn.found.x - 4 * kPi * value) <= 1e-4 * 4 * kPi * value);
            }
        }
}

TEST_CASE("directions see what lies between the middles of texels, across the seam too", "[kernels][environment]") {
    RandomSource random(61);
    for (const auto mapping : {EnvironmentMapping::latlong, EnvironmentMapping::probe})
        for (const auto& [width, height] : {std::pair(1u, 1u), {2u, 3u}, {9u, 5u}}) {
            const Image image = random_picture(random, width, height, 100.0f);
            std::vector<vec4> directions = random_directions(62, 512);
            for (const double turn : {-1e-3, 1e-3})  // on both sides of the seam
                directions.emplace_back(std::sin(turn) * 0.8, 0.6, std::cos(turn) * 0.8, 0);
            directions.resize(528, vec4(0, 0, -1, 0));
            const std::vector<vec4> found = Environment(image, mapping).look(directions);
            for (std::size_t i = 0; i < found.size(); ++i) {
                const dvec2 place = place_of(mapping, dvec3(directions[i]));
                const double expected = value_at(image, mapping, place);
                CAPTURE(int(mapping), width, height, place.x, place.y, expected, found[i].x);
                CHECK(std::abs(found[i].x - expected) <= 2e-3);
            }
            if (mapping == EnvironmentMapping::latlong) CHECK(std::abs(found[512].x - found[513].x) <= 0.1);
        }
}

TEST_CASE("directions are drawn to texels that have light or are beside such, and to no others",
          "[kernels][environment]") {
    Image image{"", 9, 6, {}, {}};
    image.floats.resize(3 * 9 * 6);
    image.floats[3 * (0 * 9 + 0)] = 2.0f;
    image.floats[3 * (4 * 9 + 5) + 1] = 2.0f;
    for (const bool is_joined : {false, true}) {
        std::size_t found[2] = {};
        for (const Drawn& drawn : Environment(image, EnvironmentMapping::latlong, is_joined).draw(4096, 41)) {
            const dvec2 place = place_of(EnvironmentMapping::latlong, drawn.direction()) * dvec2(9, 6);
            const int x = int(place.x), y = int(place.y);
            CAPTURE(is_joined, x, y);
            CHECK(((y <= 1 && (x <= 1 || x == 8)) || (std::abs(x - 5) <= 1 && std::abs(y - 4) <= 1)));
            ++found[y >= 3];
        }
        CHECK((found[0] > 400 && found[1] > 400));
    }
    for (const float bad : {NAN, INFINITY}) {
        image.floats[5] = bad;
        CHECK_THROWS_AS(Environment(image, EnvironmentMapping::latlong), SceneError);
    }
}

TEST_CASE("the other ways to draw directions to an environment have their densities", "[kernels][environment]") {
    RandomSource random(51);
    const Image image = random_picture(random, 5, 3, 10.0f);
    for (const auto sampling : {EnvironmentSampling::uniform, EnvironmentSampling::cosine})
        for (const Drawn& drawn : Environment(image, EnvironmentMapping::latlong, false, sampling).draw(1024, 52)) {
            const double expected = sampling == EnvironmentSampling::uniform ? 0.5 / kPi : drawn.direction().y / kPi;
            CHECK(std::abs(drawn.density() - expected) <= 1e-6);
            CHECK(std::abs(drawn.found.z - expected) <= 1e-6);
        }
}

}  // namespace castor::test
