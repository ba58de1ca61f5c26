#include <vector>

#include "reference/plane_cases.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

using namespace plane_cases;

TEST_CASE("intersect_plane agrees with double precision", "[kernels][oclgrind]") {
    RandomSource random(31);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(200'000); ++i) cases.push_back(random_case(random, i));
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < cases.size() && wrong < 3; ++i) {
        if (agrees(cases[i], found[i])) continue;
        ++wrong;
        CAPTURE(i, describe(cases[i]), found[i]);
        CHECK(agrees(cases[i], found[i]));
    }
}

TEST_CASE("intersect_plane settles the named cases", "[kernels][oclgrind]") {
    const std::vector<Named> named = named_cases();
    KernelFixture fixture;
    std::vector<Case> cases;
    for (const Named& one : named) cases.push_back(one.input);
    const auto found = run(fixture, cases);
    for (std::size_t i = 0; i < named.size(); ++i) {
        CAPTURE(named[i].name, found[i], named[i].t);
        CHECK(is_right(named[i], found[i]));
    }
}

}  // namespace castor::test
