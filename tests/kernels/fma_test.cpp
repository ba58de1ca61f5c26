#include <cmath>
#include <vector>

#include "reference/operands.h"
#include "reference/random_source.h"
#include "reference/ulp.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using reference::random_operand;
using reference::same_float;
using reference::special_values;

struct Operands {
    std::vector<float> a, b, c;

    void add(float x, float y, float z) {
        a.push_back(x);
        b.push_back(y);
        c.push_back(z);
    }
};

void check(const std::vector<float>& results, const Operands& operands) {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < results.size() && wrong < 5; ++i) {
        const float a = operands.a[i], b = operands.b[i], c = operands.c[i];
        if (same_float(results[i], std::fma(a, b, c))) continue;
        ++wrong;
        CAPTURE(i, a, b, c, results[i], std::fma(a, b, c));
        CHECK(same_float(results[i], std::fma(a, b, c)));
    }
    CHECK(wrong == 0);
}

}  // namespace

TEST_CASE("fma by integers is IEEE's for special values", "[kernels][oclgrind]") {
    KernelFixture fixture;
    Operands operands;
    std::vector<float> values = special_values();
    values.resize(test_size(values.size(), 20));
    for (float x : values)
        for (float y : values)
            for (float z : values) operands.add(x, y, z);
    check(fixture.run<float>("fma_test", operands.a.size(), operands.a, operands.b, operands.c), operands);
}

TEST_CASE("fma by integers is IEEE's for random bits", "[kernels][oclgrind]") {
    KernelFixture fixture;
    RandomSource random(1);
    Operands operands;
    const std::size_t count = test_size(4'000'000, 2048);
    for (std::size_t i = 0; i < count; ++i) {
        const float a = random_operand(random, i % 4), b = random_operand(random, i / 4 % 4);
        // Any summand, or one that cancels the product, but for what was rounded off, or almost.
        float c = random_operand(random, i / 16 % 4);
        if (i / 64 % 2 == 1) c = std::fma(-a, b, i / 128 % 2 == 1 ? c : 0.0f);
        operands.add(a, b, c);
    }
    check(fixture.run<float>("fma_test", count, operands.a, operands.b, operands.c), operands);
}

TEST_CASE("fma by integers takes vectors apart in their order", "[kernels][oclgrind_vectors]") {
    KernelFixture fixture;
    RandomSource random(2);
    Operands operands;
    for (std::size_t i = 0; i < 16; ++i)
        operands.add(random_operand(random, 3), random_operand(random, 3), random_operand(random, 3));
    const auto vectors =
        fixture.run_kernel<float>("fma_test", "fma_vectors_test", 31, operands.a, operands.b, operands.c);
    check({vectors.begin(), vectors.begin() + 16}, operands);
    check({vectors.begin() + 16, vectors.end()}, operands);
}

}  // namespace castor::test
