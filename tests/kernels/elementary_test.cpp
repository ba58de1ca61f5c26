#include "reference/elementary.h"

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "reference/random_source.h"
#include "reference/ulp.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using reference::ElementaryFunction;
using reference::kArcTangent2;
using reference::kArcTangent2Error;
using reference::kElementaryCount;
using reference::kElementaryFunctions;
using reference::kPower;
using reference::kPowerError;
using reference::ulp_error;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

bool is_kept(const Device& device, float x, long double exact) {
    return device.denormals ||
           (std::fpclassify(x) != FP_SUBNORMAL && std::fabs(exact) >= std::numeric_limits<float>::min());
}

/// Runs an elementary function as renders do: for as many lanes.
std::vector<float> run(KernelFixture& fixture, std::size_t count, cl_uint function, const std::vector<float>& x,
                       const std::vector<float>& y) {
    return fixture.run_in_lanes<float>("doctor/elementary_test", fixture.context().quirks().lanes, count, function, x,
                                       y);
}

struct Worst {
    double error = 0.0;
    std::size_t index = 0;
};

template <class Reference>
Worst worst_error(const Device& device, const std::vector<float>& x, const std::vector<float>& y,
                  const std::vector<float>& found, Reference reference) {
    Worst worst;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const long double exact = reference(static_cast<long double>(x[i]), static_cast<long double>(y[i]));
        if (!is_kept(device, x[i], exact)) continue;
        const double error = ulp_error(found[i], exact);
        if (error > worst.error) worst = {error, i};
    }
    return worst;
}

}  // namespace

TEST_CASE("elementary functions keep the errors that they state", "[kernels][oclgrind]") {
    KernelFixture fixture;
    const std::uint32_t stride = static_cast<std::uint32_t>((std::uint64_t{1} << 32) / test_size(1'000'003, 1024));
    for (const ElementaryFunction& function : kElementaryFunctions) {
        std::vector<float> x{0.0f, -0.0f, 1.0f, -1.0f, 0.5f, -0.5f, kInfinity, -kInfinity, kNaN};
        for (std::uint64_t bits = function.number; bits < (std::uint64_t{1} << 32); bits += stride)
            x.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
        std::erase_if(x, [&](float value) { return std::fabs(value) > function.largest_argument; });
        const auto found = run(fixture, x.size(), function.number, x, x);
        const Worst worst = worst_error(fixture.device(), x, x, found,
                                        [&](long double value, long double) { return function.reference(value); });
        CAPTURE(function.name, x[worst.index], found[worst.index]);
        CHECK(worst.error <= function.stated_error);
    }
}

TEST_CASE("elementary functions have the same bits for one lane and for sixteen", "[kernels][oclgrind_vectors]") {
    KernelFixture fixture;
    if (fixture.device().platform_name == "rusticl") return;  // it compiles for minutes what has vectors
    RandomSource random(5);
    std::vector<float> x, y;
    const std::vector<float> special{0.0f, -0.0f, 1.0f, -1.0f, 0.5f, -0.5f, kInfinity, -kInfinity, kNaN};
    for (const float one : special)
        for (const float other : special) x.push_back(one), y.push_back(other);
    const std::size_t count = test_size(16 * 20'000, 16 * 32);
    while (x.size() < count) {
        x.push_back(random.any_float());
        y.push_back(random.below(2) ? random.any_float() : random.uniform_float(-4.0f, 4.0f));
        x.push_back(random.uniform_float(-1.0f, 1.0f));
        y.push_back(random.uniform_float(0.0f, 100.0f));
    }
    x.resize(count);
    y.resize(count);
    for (cl_uint function = 0; function < kElementaryCount; ++function) {
        const auto one = fixture.run_in_lanes<std::uint32_t>("doctor/elementary_test", 1, count, function, x, y);
        const auto sixteen = fixture.run_in_lanes<std::uint32_t>("doctor/elementary_test", 16, count, function, x, y);
        std::size_t i = 0;
        const auto is_same = [&](std::size_t k) {
            return one[k] == sixteen[k] ||
                   (std::isnan(std::bit_cast<float>(one[k])) && std::isnan(std::bit_cast<float>(sixteen[k])));
        };
        while (i < count && is_same(i)) ++i;
        CAPTURE(function, i);
        if (i < count) FAIL_CHECK("of " << x[i] << " and " << y[i] << ": " << one[i] << " and " << sixteen[i]);
    }
}

TEST_CASE("sine and cosine beyond their range are NaN, not wrong", "[kernels][oclgrind]") {
    KernelFixture fixture;
    const std::vector<float> x{std::nextafter(1e5f, 2e5f), -2e5f, 1e30f, kInfinity, -kInfinity, kNaN};
    for (cl_uint function : {0u, 1u})
        for (float value : run(fixture, x.size(), function, x, x)) CHECK(std::isnan(value));
}

TEST_CASE("power keeps the error that it states", "[kernels][oclgrind]") {
    KernelFixture fixture;
    RandomSource random(2);
    std::vector<float> x, y;
    for (std::size_t i = 0; i < test_size(1'000'000, 1024); ++i) {
        switch (i % 4) {
            case 0:  // any x, any result
                x.push_back(std::fabs(random.any_float()));
                y.push_back(random.uniform_float(-1e4f, 1e4f));
                break;
            case 1:  // highlights: a cosine and a Phong exponent
                x.push_back(random.uniform_float(0.0f, 1.0f));
                y.push_back(static_cast<float>(random.below(10001)));
                break;
            case 2:  // near 1, where small errors of the logarithm grow
                x.push_back(random.uniform_float(0.98f, 1.02f));
                y.push_back(random.uniform_float(-1e4f, 1e4f));
                break;
            case 3:  // results of all sizes
                x.push_back(std::exp2(random.uniform_float(-126.0f, 126.0f)));
                y.push_back(random.uniform_float(-150.0f, 130.0f) / std::log2(x.back()));
                break;
        }
    }
    const auto found = run(fixture, x.size(), kPower, x, y);
    const Worst worst =
        worst_error(fixture.device(), x, y, found, [](long double a, long double b) { return std::pow(a, b); });
    CAPTURE(x[worst.index], y[worst.index], found[worst.index]);
    CHECK(worst.error <= kPowerError);
}

TEST_CASE("power has pow's special cases", "[kernels][oclgrind]") {
    KernelFixture fixture;
    std::vector<float> x, y;
    for (float base : {0.0f, 1e-40f, 0.5f, 1.0f, 2.0f, 1e30f, kInfinity, kNaN})
        for (float exponent : {0.0f, -0.0f, 1.0f, -1.0f, 3e38f, -3e38f, kInfinity, -kInfinity, kNaN}) {
            x.push_back(base);
            y.push_back(exponent);
        }
    const auto found = run(fixture, x.size(), kPower, x, y);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const float expected =
            static_cast<float>(std::pow(static_cast<long double>(x[i]), static_cast<long double>(y[i])));
        if (!is_kept(fixture.device(), x[i], expected)) continue;
        CAPTURE(x[i], y[i], found[i], expected);
        CHECK(ulp_error(found[i], expected) <= 1.0);
    }
    const std::vector<float> negative{-1.0f, -2.0f}, exponents{2.0f, 0.0f};
    const auto of_negative = run(fixture, negative.size(), kPower, negative, exponents);
    CHECK(std::isnan(of_negative[0]));
    CHECK(of_negative[1] == 1.0f);
}

TEST_CASE("arc_tangent2 keeps the error that it states in all directions", "[kernels][oclgrind]") {
    KernelFixture fixture;
    RandomSource random(3);
    std::vector<float> y, x;
    for (float a : {0.0f, -0.0f, 1.0f, -1.0f, 1e-40f, 3e38f, -3e38f, kInfinity, -kInfinity, kNaN})
        for (float b : {0.0f, -0.0f, 1.0f, -1.0f, 1e-40f, 3e38f, -3e38f, kInfinity, -kInfinity, kNaN}) {
            y.push_back(a);
            x.push_back(b);
        }
    for (std::size_t i = 0; i < test_size(1'000'000, 1024); ++i) {
        y.push_back(i % 2 ? random.any_float() : random.uniform_float(-1.0f, 1.0f));
        x.push_back(i % 2 ? random.any_float() : random.uniform_float(-1.0f, 1.0f));
    }
    const auto found = run(fixture, x.size(), kArcTangent2, y, x);
    const Worst worst =
        worst_error(fixture.device(), y, x, found, [](long double a, long double b) { return std::atan2(a, b); });
    CAPTURE(y[worst.index], x[worst.index], found[worst.index]);
    CHECK(worst.error <= kArcTangent2Error);
}

}  // namespace castor::test
