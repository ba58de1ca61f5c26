#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <set>
#include <vector>

#include "castor/shared/sample_order.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::vec2;

/// The samples of pixels that share a sequence, 2^samples_log a pixel: of a square of 2^side_log pixels a side.
std::vector<vec2> shared_points(KernelFixture& fixture, std::uint32_t x, std::uint32_t y, std::uint32_t side_log,
                                std::uint32_t samples_log) {
    std::vector<std::uint32_t> pixels, samples;
    for (std::uint32_t i = 0; i < 1u << 2 * side_log; ++i)
        for (std::uint32_t sample = 0; sample < 1u << samples_log; ++sample) {
            pixels.push_back((y + (i >> side_log)) << 16 | (x + (i & ((1u << side_log) - 1))));
            samples.push_back(sample);
        }
    return fixture.run<vec2>("random_test", pixels.size(), cl_uint{7}, (samples_log + 1) << CASTOR_Z_ORDER_SHIFT,
                             pixels, samples);
}

/// Whether each elementary rectangle holds one of the points, whose number is a power of two.
bool is_net(const std::vector<vec2>& points) {
    const auto log = static_cast<std::uint32_t>(std::bit_width(points.size()) - 1);
    for (std::uint32_t columns_log = 0; columns_log <= log; ++columns_log) {
        std::set<std::pair<int, int>> cells;
        for (const vec2 p : points)
            cells.emplace(static_cast<int>(p.x * static_cast<float>(1u << columns_log)),
                          static_cast<int>(p.y * static_cast<float>(1u << (log - columns_log))));
        if (cells.size() != points.size()) return false;
    }
    return true;
}

/// Samples [0, count) of one pixel.
std::vector<vec2> points_of(KernelFixture& fixture, std::uint32_t pixel, std::uint32_t count, std::uint32_t seed) {
    std::vector<std::uint32_t> pixels(count, pixel), samples(count);
    for (std::uint32_t i = 0; i < count; ++i) samples[i] = i;
    return fixture.run<vec2>("random_test", count, seed, cl_uint{0}, pixels, samples);
}

}  // namespace

TEST_CASE("samples of a pixel are a net: each elementary rectangle holds one", "[kernels][oclgrind]") {
    KernelFixture fixture;
    constexpr std::uint32_t kLog = 6, kCount = 1u << kLog;
    for (std::uint32_t pixel : {0u, 1u, 65536u, 0x12345678u}) {
        const auto points = points_of(fixture, pixel, kCount, 7);
        for (std::uint32_t columns_log = 0; columns_log <= kLog; ++columns_log) {
            const float columns = static_cast<float>(1u << columns_log),
                        rows = static_cast<float>(kCount >> columns_log);
            std::set<std::pair<int, int>> cells;
            for (vec2 p : points) {
                REQUIRE((p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1));
                cells.emplace(static_cast<int>(p.x * columns), static_cast<int>(p.y * rows));
            }
            CAPTURE(pixel, columns, rows);
            CHECK(cells.size() == kCount);
        }
    }
}

TEST_CASE("samples of squares of pixels that share a sequence are nets", "[kernels][oclgrind]") {
    KernelFixture fixture;
    for (const std::uint32_t samples_log : {0u, 2u, 3u}) {
        CAPTURE(samples_log);
        for (const std::uint32_t corner : {0u, 8u, 32768u, 65528u}) {
            CAPTURE(corner);
            for (const std::uint32_t side_log : {0u, 1u, 2u, 3u})
                CHECK(is_net(shared_points(fixture, corner, 40, side_log, samples_log)));
            CHECK(is_net(shared_points(fixture, 8, corner + 2, 1, samples_log)));
        }
    }
    CHECK_FALSE(is_net(shared_points(fixture, 1, 0, 1, 2)));  // no square of the curve
    // Squares that are too far from each other for one sequence have others.
    const std::vector<std::uint32_t> samples{0, 1, 2, 3};
    const auto points_of_million = [&](std::uint32_t pixel) {
        return fixture.run<vec2>("random_test", samples.size(), cl_uint{7}, 21u << CASTOR_Z_ORDER_SHIFT,
                                 std::vector<std::uint32_t>(samples.size(), pixel), samples);
    };
    CHECK(points_of_million(0) != points_of_million(64));
    CHECK(points_of_million(0) == points_of_million(0));
}

TEST_CASE("samples depend on pixel and seed, and on nothing else", "[kernels][oclgrind]") {
    KernelFixture fixture;
    const auto points = points_of(fixture, 5, 16, 1);
    CHECK(points_of(fixture, 5, 16, 1) == points);
    CHECK(points_of(fixture, 6, 16, 1) != points);
    CHECK(points_of(fixture, 5, 16, 2) != points);
    // The number of samples asked for does not matter.
    auto more = points_of(fixture, 5, 64, 1);
    more.resize(16);
    CHECK(more == points);
}

TEST_CASE("first samples of neighbouring pixels are uncorrelated", "[kernels]") {
    KernelFixture fixture;
    constexpr std::uint32_t kSide = 128;
    std::vector<std::uint32_t> pixels, samples(kSide * kSide, 0);
    for (std::uint32_t y = 0; y < kSide; ++y)
        for (std::uint32_t x = 0; x < kSide; ++x) pixels.push_back(y << 16 | x);
    const auto points = fixture.run<vec2>("random_test", pixels.size(), cl_uint{3}, cl_uint{0}, pixels, samples);
    double mean = 0, beside = 0, below = 0, crossed = 0;
    for (std::uint32_t y = 0; y + 1 < kSide; ++y)
        for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
            const vec2 p = points[y * kSide + x] - 0.5f;
            mean += p.x + p.y;
            beside += p.x * (points[y * kSide + x + 1].x - 0.5f);
            below += p.x * (points[(y + 1) * kSide + x].x - 0.5f);
            crossed += p.x * p.y;
        }
    // Five standard deviations of a mean of uncorrelated uniform numbers.
    const double n = (kSide - 1) * (kSide - 1);
    CHECK(std::fabs(mean / (2 * n)) < 5 * std::sqrt(1.0 / 12 / (2 * n)));
    for (double correlation : {beside, below, crossed}) CHECK(std::fabs(12 * correlation / n) < 5 / std::sqrt(n));
}

}  // namespace castor::test
