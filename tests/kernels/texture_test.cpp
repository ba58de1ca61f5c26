#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <string>
#include <vector>

#include "castor/scene.h"
#include "reference/random_source.h"
#include "reference/textures.h"
#include "scene/texture_columns.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using reference::is_near_border;
using reference::levels_of;

/// A picture of random texels.
Image random_image(RandomSource& random, std::uint32_t width, std::uint32_t height, bool has_bytes) {
    Image image{"", width, height, {}, {}};
    for (std::uint32_t i = 0; i < 3 * width * height; ++i) {
        if (has_bytes)
            image.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
        else
            image.floats.push_back(random.uniform_float(0.0f, 4.0f));
    }
    return image;
}

std::vector<glm::vec4> nasty_points(RandomSource& random, std::size_t count) {
    const float nasty[] = {0.0f,   -0.0f,   1.0f,     -1.0f, 0.5f,    0x1.fffffep-1f, -0x1p-30f, 0x1p-30f,
                           1e-38f, -1e-38f, 1e-45f,   7.0f,  -7.0f,   0x1p23f,        -0x1p24f,  1e12f,
                           -1e12f, 0.25f,   1.0f / 3, 2.75f, 0.9999f, -0.0001f,       12345.68f, -98765.43f};
    std::vector<glm::vec4> points;
    for (const float u : nasty)
        for (const float v : nasty) points.emplace_back(u, v, random.uniform_float(-1.0f, 5.0f), 0.0f);
    // Sixteen and sixteen, which are neighbours in every second group, as the samples of a pixel are.
    while (points.size() % 16 != 0) points.push_back(points.front());
    for (bool are_neighbours = false; points.size() < count; are_neighbours = !are_neighbours) {
        const float u = random.uniform_float(-3.0f, 3.0f), v = random.uniform_float(-3.0f, 3.0f);
        const float extent = are_neighbours ? random.uniform_float(0.0f, 0.2f) : 3.0f;
        const float level = random.uniform_float(-1.0f, 5.0f), depth = are_neighbours ? 0.3f : 3.0f;
        for (int i = 0; i < 16; ++i)
            points.emplace_back(u + random.uniform_float(0.0f, extent), v + random.uniform_float(0.0f, extent),
                                level + random.uniform_float(0.0f, depth), 0.0f);
    }
    return points;
}

std::vector<glm::vec4> look_up(const SceneArrays& arrays, std::uint32_t texture, std::vector<glm::vec4> points,
                               const std::string& kernel) {
    KernelFixture fixture;
    const std::vector<shared::TextureImage> images(arrays.texture_images.begin(), arrays.texture_images.end());
    const std::vector<std::uint32_t> texels(arrays.texels.begin(), arrays.texels.end());
    const std::size_t count = points.size();
    points.resize((count + 15) / 16 * 16);
    auto found = fixture.run_kernel<glm::vec4>("texture_test", kernel, points.size(), arrays.textures[texture], images,
                                               texels, points);
    found.resize(count);
    return found;
}

/// The same for one lane and for sixteen, which must not differ.
std::vector<glm::vec4> look_up(const SceneArrays& arrays, std::uint32_t texture, const std::vector<glm::vec4>& points) {
    const std::vector<glm::vec4> found = look_up(arrays, texture, points, "texture_test");
    if (test_device().platform_name != "rusticl") {  // it compiles for minutes what has vectors
        const std::vector<glm::vec4> in_lanes = look_up(arrays, texture, points, "texture16_test");
        CHECK(std::memcmp(found.data(), in_lanes.data(), found.size() * sizeof(glm::vec4)) == 0);
    }
    return found;
}

}  // namespace

TEST_CASE("texels are those of a reference in double precision, with every filter and wrap",
          "[kernels][oclgrind_vectors]") {
    RandomSource random(77);
    Scene scene;
    scene.images = {random_image(random, 40, 24, true), random_image(random, 7, 5, true),
                    random_image(random, 13, 4, false), random_image(random, 1, 1, true)};
    for (std::uint32_t image = 0; image < scene.images.size(); ++image)
        for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear, TextureFilter::trilinear})
            for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp}) {
                Texture texture;
                texture.image = image;
                texture.filter = filter;
                texture.wrap = wrap;
                scene.textures.push_back(texture);
            }
    SceneArrays arrays;
    append_textures(arrays, scene);
    CHECK(arrays.texels.size() == texel_words(scene));
    const std::vector<glm::vec4> points = nasty_points(random, test_size(20000, 576));
    for (std::uint32_t number = 0; number < scene.textures.size(); ++number) {
        const Texture& texture = scene.textures[number];
        const Image& image = scene.images[texture.image];
        const std::vector<Image> levels = levels_of(image);
        const std::vector<glm::vec4> found = look_up(arrays, number, points);
        const double white = image.floats.empty() ? 255.0 : 4.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double u = points[i].x, v = points[i].y, level = points[i].z;
            dvec3 expected;
            if (texture.filter == TextureFilter::nearest) {
                if (is_near_border(u, image.width) || is_near_border(v, image.height)) continue;
                expected = reference::nearest_texel(image, u, v, texture.wrap);
            } else if (texture.filter == TextureFilter::bilinear) {
                expected = reference::bilinear_texel(image, u, v, texture.wrap);
            } else {
                expected = reference::trilinear_texel(levels, u, v, level, texture.wrap);
            }
            const dvec3 error = dvec3(found[i]) - expected;
            const double worst = std::max({std::abs(error.x), std::abs(error.y), std::abs(error.z)});
            if (worst <= reference::texel_tolerance(image, white)) continue;
            CAPTURE(number, points[i].x, points[i].y, points[i].z, found[i].x, expected.x);
            FAIL("a texel differs by " << worst);
        }
    }
}

TEST_CASE("levels of trilinear textures are those of a reference in double precision", "[kernels][oclgrind_vectors]") {
    KernelFixture fixture;
    RandomSource random(79);
    const auto number = [&](double least, double most) {
        return static_cast<float>(std::exp2(random.uniform_float(static_cast<float>(least), static_cast<float>(most))));
    };
    const auto direction = [&](float length) {
        dvec3 d(0);
        while (glm::dot(d, d) < 1e-3 || glm::dot(d, d) > 1.0)
            d = dvec3(random.uniform_float(-1.0f, 1.0f), random.uniform_float(-1.0f, 1.0f),
                      random.uniform_float(-1.0f, 1.0f));
        return glm::vec4(glm::vec3(glm::normalize(d)) * length, 0.0f);
    };
    const shared::TextureImage image{1024, 300, CASTOR_TEXELS_BYTES, 11, 0, {}};
    constexpr float kSpread = 0.001f;
    std::vector<glm::vec4> e1_t, e2, duv, normals, directions;
    std::vector<double> expected;
    while (expected.size() < test_size(20000, 256)) {
        const float size = number(-20, 20);  // of the world
        glm::vec4 a = direction(size * number(-6, 0)), b = direction(size * number(-6, 0)), n = direction(1.0f);
        const glm::vec4 d = direction(number(-2, 2));
        const float scale = number(-12, 3);
        const glm::vec4 uv(random.uniform_float(-1.0f, 1.0f) * scale, random.uniform_float(-1.0f, 1.0f) * scale,
                           random.uniform_float(-1.0f, 1.0f) * scale, random.uniform_float(-1.0f, 1.0f) * scale);
        a.w = size * number(-3, 20);
        const double determinant = double{uv.x} * uv.w - double{uv.y} * uv.z;
        const double area = glm::length(glm::cross(dvec3(a), dvec3(b)));
        const double cosine = glm::dot(dvec3(n), dvec3(d)) / glm::length(dvec3(d));
        // Where these cancel, rounding alone changes the level.
        if (std::abs(determinant) < 0.01 * scale * scale || std::abs(cosine) < 0.01 ||
            area < 0.01 * glm::length(dvec3(a)) * glm::length(dvec3(b)))
            continue;
        const double width = a.w * glm::length(dvec3(d)) * kSpread;
        const double cut = width * width / std::abs(cosine);
        const double texel = area / std::abs(determinant) / (1024.0 * 300.0);
        e1_t.push_back(a), e2.push_back(b), duv.push_back(uv), normals.push_back(n), directions.push_back(d);
        expected.push_back(std::log2(cut / texel) / 2);
    }
    // A mesh without texture coordinates has one texel for all of it: the last level.
    e1_t.push_back(e1_t[0]), e2.push_back(e2[0]), duv.emplace_back(0.0f), normals.push_back(normals[0]);
    directions.push_back(directions[0]);
    const auto levels_in = [&](std::uint32_t lanes) {
        return fixture.run_in_lanes<float>("texture_levels_test", lanes, e1_t.size(), image, kSpread, e1_t, e2, duv,
                                           normals, directions);
    };
    const std::vector<float> found = levels_in(1);
    for (std::size_t i = 0; i < expected.size(); ++i) {
        CAPTURE(i, found[i], expected[i]);
        if (std::abs(found[i] - expected[i]) > 1e-4) FAIL("a level differs");
    }
    CHECK(found.back() >= 10.0f);
    if (fixture.device().platform_name != "rusticl")  // it compiles for minutes what has vectors
        CHECK(std::memcmp(found.data(), levels_in(16).data(), found.size() * sizeof(float)) == 0);
}

TEST_CASE("texel coordinates just below a border stay in the last texel", "[kernels][oclgrind_vectors]") {
    Scene scene;
    scene.images = {{"", 3, 1, {10, 10, 10, 20, 20, 20, 30, 30, 30}, {}}};
    scene.textures = {Texture{}, Texture{}};
    scene.textures[1].wrap = TextureWrap::clamp;
    SceneArrays arrays;
    append_textures(arrays, scene);
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
    const std::vector<glm::vec4> points{
        {0x1.fffffep-1f, 0, 0, 0}, {-1e-20f, 0, 0, 0},   {1.0f, 0, 0, 0}, {2.0f, 0, 0, 0},
        {kNaN, kNaN, kNaN, 0},     {kInfinity, 0, 0, 0}, {0.5f, 0, 0, 0}};
    const auto repeated = look_up(arrays, 0, points), clamped = look_up(arrays, 1, points);
    const float of_repeated[] = {30, 30, 10, 10}, of_clamped[] = {30, 10, 30, 30};
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(repeated[i].x == of_repeated[i]);
        CHECK(clamped[i].x == of_clamped[i]);
    }
    // No texture coordinates are NaN or infinite, but where a kernel fails to see to that, it reads no foreign memory.
    for (std::size_t i = 4; i < 6; ++i) CHECK((repeated[i].x == 10 || repeated[i].x == 30));
    CHECK(repeated[6].x == 20);
}

TEST_CASE("pictures are halved by the means of what a texel covers", "[scene]") {
    const Image even{"", 4, 2, {0, 8, 1, 2, 8, 1, 100, 0, 0, 101, 0, 0, 4, 8, 1, 6, 8, 2, 102, 0, 0, 103, 255, 0}, {}};
    const Image half = half_size(even);
    CHECK(half.width == 2);
    CHECK(half.height == 1);
    CHECK(half.bytes == std::vector<std::uint8_t>{3, 8, 1, 102, 64, 0});  // 101.5 and 63.75 up, 1.25 down
    // Of three, the middle one counts fully, the outer ones by the part that is covered.
    const Image odd{"", 3, 1, {30, 0, 0, 60, 0, 0, 90, 255, 255}, {}};
    CHECK(half_size(odd).bytes == std::vector<std::uint8_t>{60, 85, 85});
    // The linear mean of black and white is 188 on sRGB's curve; equal bytes stay, and alpha is linear.
    const Image coded{"", 2, 1, {0, 10, 200, 255, 10, 201}, {}, {100, 50}};
    CHECK(half_size(coded).bytes == std::vector<std::uint8_t>{128, 10, 201});
    CHECK(half_size(coded, true).bytes == std::vector<std::uint8_t>{188, 10, 201});
    for (const bool is_srgb : {false, true}) CHECK(half_size(coded, is_srgb).alpha == std::vector<std::uint8_t>{75});
    CHECK(half_size(even).alpha.empty());
    for (int byte = 0; byte < 256; ++byte) {
        const std::vector<std::uint8_t> same(6, static_cast<std::uint8_t>(byte));
        CHECK(half_size({"", 2, 1, same, {}}, true).bytes == std::vector(3, same[0]));
    }
    const Image five{"", 5, 1, {}, {1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 5, 0, 5}};
    const Image half_of_five = half_size(five);
    REQUIRE(half_of_five.floats.size() == 6);
    CHECK(half_of_five.floats[0] == float((2.0 * 1 + 2.0 * 2 + 1.0 * 3) / 5));
    CHECK(half_of_five.floats[3] == float((1.0 * 3 + 2.0 * 4 + 2.0 * 5) / 5));
    CHECK(half_of_five.floats[5] == 2.0f);
}

TEST_CASE("halving keeps the mean of a picture", "[scene]") {
    RandomSource random(78);
    for (const auto& size :
         {glm::uvec2(1, 1), glm::uvec2(2, 1), glm::uvec2(3, 7), glm::uvec2(64, 33), glm::uvec2(1, 9)}) {
        const Image image = random_image(random, size.x, size.y, false);
        const auto mean = [](const Image& picture) {
            double sum = 0;
            for (const float value : picture.floats) sum += value;
            return sum / static_cast<double>(picture.floats.size());
        };
        const double of_all = mean(image);
        CAPTURE(size.x, size.y);
        for (const Image& level : levels_of(image)) CHECK(std::abs(mean(level) - of_all) < 1e-6);
    }
}

}  // namespace castor::test
