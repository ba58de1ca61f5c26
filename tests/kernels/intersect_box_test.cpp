#include <cmath>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "reference/box_cases.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

using namespace box_cases;

TEST_CASE("box_interval contains the exact interval, and little more", "[kernels][oclgrind]") {
    RandomSource random(41);
    Boxes boxes;
    for (std::size_t i = 0; i < test_size(200'000); ++i) {
        const vec3 corner = random.in_box(-1, 1);
        boxes.add(random_ray(random), corner, random_corner(random, corner));
    }
    KernelFixture fixture;
    const auto found = boxes.run(fixture, boxes.largest);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < found.size() && wrong < 3; ++i) {
        if (boxes.agrees(i, found[i])) continue;
        ++wrong;
        CAPTURE(i, boxes.describe(i), found[i].x, found[i].y);
        CHECK(boxes.agrees(i, found[i]));
    }
}

TEST_CASE("box_interval of a box contains that of every box within, exactly", "[kernels][oclgrind]") {
    RandomSource random(42);
    Boxes inner, outer;
    for (std::size_t i = 0; i < test_size(400'000, 512); ++i) {
        const Ray ray = random_ray(random);
        const vec3 a = random.in_box(-1, 1), b = random_corner(random, a);
        vec3 growth_low = random.in_box(0, 1e-6f), growth_high = random.in_box(0, 1e-6f);
        if (random.below(3) == 0) growth_low *= 1e5f;
        if (random.below(3) == 0) growth_high.x = 0.0f;
        inner.add(ray, a, b);
        outer.add(ray, glm::min(a, b) - growth_low, glm::max(a, b) + growth_high);
    }
    KernelFixture fixture;
    const auto found_inner = inner.run(fixture, outer.largest), found_outer = outer.run(fixture, outer.largest);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < found_inner.size() && wrong < 3; ++i) {
        if (found_outer[i].x <= found_inner[i].x && found_outer[i].y >= found_inner[i].y) continue;
        ++wrong;
        CAPTURE(i, to_text(inner.rays[i]), to_text(inner.lower[i]), to_text(inner.upper[i]), to_text(outer.lower[i]),
                to_text(outer.upper[i]), found_inner[i].x, found_inner[i].y, found_outer[i].x, found_outer[i].y);
        CHECK(false);
    }
}

}  // namespace castor::test
