#include <cmath>
#include <vector>

#include "reference/operands.h"
#include "reference/random_source.h"
#include "reference/ulp.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using reference::same_float;

struct Results {
    float quotient, quotient_by_integers, root, root_by_integers;
};

void check(KernelFixture& fixture, const std::vector<float>& a, const std::vector<float>& b) {
    const auto results = fixture.run<Results>("doctor/exact_test", a.size(), a, b);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < a.size() && wrong < 5; ++i) {
        // The integer versions keep denormals everywhere; the device's own operators do where it says so.
        const bool denormal = std::fpclassify(a[i]) == FP_SUBNORMAL || std::fpclassify(b[i]) == FP_SUBNORMAL ||
                              std::fpclassify(a[i] / b[i]) == FP_SUBNORMAL;
        const bool own_counts = fixture.device().denormals || !denormal;
        const bool right = same_float(results[i].quotient_by_integers, a[i] / b[i]) &&
                           same_float(results[i].root_by_integers, std::sqrt(a[i])) &&
                           (!own_counts || (same_float(results[i].quotient, a[i] / b[i]) &&
                                            same_float(results[i].root, std::sqrt(a[i]))));
        if (right) continue;
        ++wrong;
        CAPTURE(i, a[i], b[i], a[i] / b[i], results[i].quotient, results[i].quotient_by_integers, std::sqrt(a[i]),
                results[i].root, results[i].root_by_integers);
        CHECK(right);
    }
}

}  // namespace

TEST_CASE("divide and square_root are IEEE's, natively and by integers, for special values", "[kernels][oclgrind]") {
    KernelFixture fixture;
    const std::vector<float> values = special_values();
    std::vector<float> a, b;
    for (float x : values)
        for (float y : values) {
            a.push_back(x);
            b.push_back(y);
        }
    check(fixture, a, b);
}

TEST_CASE("divide and square_root are IEEE's, natively and by integers, for random bits", "[kernels][oclgrind]") {
    KernelFixture fixture;
    RandomSource random(1);
    const std::size_t count = test_size(4'000'000, 2048);
    std::vector<float> a(count), b(count);
    for (std::size_t i = 0; i < count; ++i) {
        a[i] = random_operand(random, i % 4);
        b[i] = random_operand(random, i / 4 % 4);
    }
    check(fixture, a, b);
}

}  // namespace castor::test
