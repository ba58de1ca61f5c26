#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <numeric>
#include <vector>

#include "reference/random_source.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

std::vector<glm::vec4> noise_at(const std::vector<glm::vec4>& points) {
    KernelFixture fixture;
    return fixture.run<glm::vec4>("noise_test", points.size(), points);
}

/// Points in a box around the origin, with one octave.
std::vector<glm::vec4> random_points(std::size_t count, float extent) {
    RandomSource random(91);
    std::vector<glm::vec4> points;
    for (std::size_t i = 0; i < count; ++i) points.emplace_back(random.in_box(-extent, extent), 1.0f);
    return points;
}

}  // namespace

TEST_CASE("noise has a mean of zero, values within one, and zeros at lattice points", "[kernels][oclgrind]") {
    const std::vector<glm::vec4> points = random_points(test_size(200'000, 4096), 100.0f);
    const std::vector<glm::vec4> noise = noise_at(points);
    double sum = 0, squares = 0, largest = 0;
    for (const glm::vec4& value : noise) {
        sum += value.w;
        squares += double{value.w} * value.w;
        largest = std::max(largest, std::abs(double{value.w}));
    }
    const double count = static_cast<double>(noise.size());
    CHECK(std::abs(sum / count) < (count > 1e5 ? 0.005 : 0.03));
    CHECK(std::sqrt(squares / count) > 0.2);
    CHECK(std::sqrt(squares / count) < 0.35);
    CHECK(largest > 0.75);
    CHECK(largest <= 1.0);
    std::vector<glm::vec4> lattice;
    for (int i = -300; i < 300; i += 7) lattice.emplace_back(i, 2 * i + 1, -i, 1);
    for (const glm::vec4& value : noise_at(lattice)) CHECK(value.w == 0.0f);
}

TEST_CASE("noise is continuous, and its slope is that of its values", "[kernels][oclgrind]") {
    constexpr float kStep = 0x1p-10f;
    const std::vector<glm::vec4> points = random_points(test_size(20'000, 512), 8.0f);
    std::vector<glm::vec4> all;
    for (const glm::vec4& point : points)
        for (int axis = 0; axis < 3; ++axis)
            for (const float sign : {-1.0f, 1.0f}) {
                glm::vec4 beside = point;
                beside[axis] += sign * kStep;
                all.push_back(beside);
            }
    const std::vector<glm::vec4> noise = noise_at(points), beside = noise_at(all);
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t at = 6 * i + 2 * static_cast<std::size_t>(axis);
            const double slope = (double{beside[at + 1].w} - beside[at].w) / (2 * kStep);
            CAPTURE(i, axis, points[i].x, points[i].y, points[i].z);
            REQUIRE(std::abs(slope - noise[i][axis]) < 2e-3);
        }
}

TEST_CASE("noise is that of Perlin's reference implementation", "[kernels][oclgrind]") {
    // noise(x, y, z) of Perlin's program of 2002 at these points, by an implementation in double precision.
    struct Known {
        glm::vec3 point;
        double value;
    };
    const Known known[] = {{{3.14f, 42.0f, 7.0f}, 0.13691995878400012},
                           {{-4.20f, 10.0f, 6.0f}, 0.14208000000000043},
                           {{1.3f, -2.7f, 5.1f}, 0.04552979885583362},
                           {{100.25f, -3.5f, 0.7f}, 0.14060725781250005}};
    std::vector<glm::vec4> points;
    for (const Known& each : known) points.emplace_back(each.point, 1.0f);
    const std::vector<glm::vec4> found = noise_at(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        CAPTURE(i);
        CHECK(std::abs(found[i].w - known[i].value) < 1e-5);
    }
}

TEST_CASE("octaves add finer noise and stay within one", "[kernels][oclgrind]") {
    std::vector<glm::vec4> points = random_points(test_size(20'000, 512), 10.0f);
    const std::vector<glm::vec4> one = noise_at(points);
    std::vector<glm::vec4> twice = points;
    for (glm::vec4& point : twice) point = glm::vec4(2.0f * glm::vec3(point), 1.0f);
    const std::vector<glm::vec4> finer = noise_at(twice);
    for (glm::vec4& point : points) point.w = 2.0f;
    const std::vector<glm::vec4> both = noise_at(points);
    for (std::size_t i = 0; i < points.size(); ++i)
        REQUIRE(std::abs(both[i].w - (one[i].w + 0.5 * finer[i].w) / 1.5) < 1e-6);
}

TEST_CASE("noise of far, huge and strange points is finite", "[kernels][oclgrind]") {
    const float far[] = {0x1p23f, -0x1p24f, 1e12f, -1e30f, 3e38f, -1e-30f, 1e-45f};
    std::vector<glm::vec4> points;
    for (const float x : far)
        for (const float y : far) points.emplace_back(x, y, -x, 24.0f);
    for (std::size_t i = 0; const glm::vec4& value : noise_at(points)) {
        CAPTURE(i, points[i].x, points[i].y);
        CHECK(std::abs(value.w) <= 1.0f);
        ++i;
    }
}

}  // namespace castor::test
