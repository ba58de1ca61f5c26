#include <glm/vec4.hpp>
#include <vector>

#include "reference/intersect.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "reference/sphere_cases.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

using namespace sphere_cases;

namespace {

using glm::vec3;
using glm::vec4;

void check_all(const std::vector<Case>& cases) {
    KernelFixture fixture;
    const auto found = run(fixture, cases);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < cases.size() && wrong < 3; ++i) {
        if (agrees(cases[i], found[i])) continue;
        ++wrong;
        const auto exact = reference::intersect_sphere(origin_of(cases[i].ray), direction_of(cases[i].ray),
                                                       vec3(cases[i].sphere), cases[i].sphere.w);
        CAPTURE(i, to_text(cases[i].ray), to_text(vec3(cases[i].sphere)), cases[i].sphere.w, found[i], exact.near_t,
                exact.far_t, exact.grazing);
        CHECK(agrees(cases[i], found[i]));
    }
}

}  // namespace

TEST_CASE("intersect_sphere finds points of spheres of all sizes and distances", "[kernels][oclgrind]") {
    RandomSource random(21);
    for (float distance : {1.0f, 1e3f, 1e6f}) {
        for (float radius : {1e-3f, 1.0f, 1e3f, 1e6f}) {
            CAPTURE(distance, radius);
            std::vector<Case> cases;
            for (std::size_t i = 0; i < test_size(20'000, 64); ++i) {
                const vec3 center = random.in_box(-1, 1) * radius;
                const vec3 target = center + random.direction() * radius;
                const vec3 origin = target + random.direction() * distance;
                const vec3 direction = (target - origin) * (i % 2 ? 1.0f : random.uniform_float(1e-3f, 1e3f));
                cases.push_back({make_ray(origin, direction), vec4(center, radius)});
            }
            check_all(cases);
        }
    }
}

TEST_CASE("intersect_sphere agrees with extended precision on random rays", "[kernels][oclgrind]") {
    RandomSource random(22);
    std::vector<Case> cases;
    for (std::size_t i = 0; i < test_size(200'000); ++i) cases.push_back(random_case(random, i));
    check_all(cases);
}

TEST_CASE("intersect_sphere settles the named cases", "[kernels][oclgrind]") {
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
