#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "reference/random_source.h"
#include "reference/rays.h"
#include "reference/triangle_cases.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

using namespace triangle_cases;

namespace {

using glm::vec3;

void check_all(const std::vector<Case>& cases) {
    KernelFixture fixture;
    for (cl_uint function = 0; function < kFunctions.size(); ++function) {
        const auto answers = run(fixture, function, cases);
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < cases.size() && wrong < 3; ++i) {
            if (agrees(cases[i], answers[i])) continue;
            ++wrong;
            CAPTURE(kFunctions[function], i, describe(cases[i]), answers[i].t, answers[i].u, answers[i].v,
                    answers[i].from_behind);
            CHECK(agrees(cases[i], answers[i]));
        }
    }
}

}  // namespace

TEST_CASE("the three triangle tests find points made from barycentrics and t", "[kernels][oclgrind]") {
    RandomSource random(11);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(100'000); ++i) {
        const auto p = random_triangle(random);
        float u = random.uniform_float(0, 1), v = random.uniform_float(0, 1);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const vec3 direction = random.direction() * random.uniform_float(0.1f, 10.0f);
        const vec3 target = (1 - u - v) * p[0] + u * p[1] + v * p[2];
        cases.push_back({make_ray(target - random.uniform_float(0.01f, 5.0f) * direction, direction), p});
    }
    check_all(cases);
}

TEST_CASE("the three triangle tests agree with double precision on random rays", "[kernels][oclgrind]") {
    RandomSource random(12);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(200'000); ++i) cases.push_back(random_case(random, i));
    check_all(cases);
}

TEST_CASE("the three triangle tests settle the named edges alike", "[kernels][oclgrind]") {
    const std::vector<Named> named = named_cases();
    KernelFixture fixture;
    std::vector<Case> cases;
    for (const Named& one : named) cases.push_back(one.input);
    for (cl_uint function = 0; function < kFunctions.size(); ++function) {
        const auto answers = run(fixture, function, cases);
        for (std::size_t i = 0; i < named.size(); ++i) {
            CAPTURE(kFunctions[function], named[i].name, answers[i].t, answers[i].u, answers[i].v);
            CHECK(is_right(named[i], answers[i]));
        }
    }
}

}  // namespace castor::test
