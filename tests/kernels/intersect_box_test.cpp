#include <cmath>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "reference/intersect.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/random_source.h"
#include "support/rays.h"

namespace castor::test {
namespace {

using glm::vec2;
using glm::vec3;
using shared::Ray;

struct Boxes {
    std::vector<Ray> rays;
    std::vector<vec3> lower, upper;
    float largest = 0.0f;

    void add(const Ray& ray, vec3 a, vec3 b) {
        rays.push_back(ray);
        lower.push_back(glm::min(a, b));
        upper.push_back(glm::max(a, b));
        for (int k = 0; k < 3; ++k) largest = std::fmax(largest, std::fmax(std::fabs(a[k]), std::fabs(b[k])));
    }
    std::vector<vec2> run(KernelFixture& fixture, float largest_coordinate) const {
        return fixture.run<vec2>("intersect_box_test", rays.size(), largest_coordinate, rays, lower, upper);
    }
};

// Rays of all octants, along axes and in axis planes too, with boxes near and far, flat and thick.
Ray random_ray(RandomSource& random) {
    vec3 direction = random.direction();
    for (int k = 0; k < 3; ++k)
        if (random.below(6) == 0) direction[k] = random.below(2) ? 0.0f : -0.0f;
    if (direction == vec3(0.0f)) direction.x = 1.0f;
    return make_ray(random.in_box(-3, 3), direction);
}

vec3 random_corner(RandomSource& random, vec3 other) {
    vec3 corner = random.in_box(-1, 1);
    for (int k = 0; k < 3; ++k)
        if (random.below(6) == 0) corner[k] = other[k];
    return corner;
}

}  // namespace

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
        const glm::dvec3 o(origin_of(boxes.rays[i])), d(direction_of(boxes.rays[i])), lower(boxes.lower[i]),
            upper(boxes.upper[i]);
        // The box enlarged by the most that the documentation of ray.cl allows.
        const double most = 1.5 * 0x1p-18 * (boxes.largest + 3.0);
        const auto exact = reference::intersect_box(o, d, lower, upper);
        const auto enlarged = reference::intersect_box(o, d, lower - most, upper + most);
        const bool meets = exact.entry <= exact.exit;
        const bool contains = !meets || (found[i].x <= exact.entry && found[i].y >= exact.exit);
        const bool tight = found[i].x > found[i].y || (enlarged.entry <= found[i].x && enlarged.exit >= found[i].y);
        if (contains && tight) continue;
        ++wrong;
        CAPTURE(i, to_text(boxes.rays[i]), to_text(boxes.lower[i]), to_text(boxes.upper[i]), found[i].x, found[i].y,
                exact.entry, exact.exit, contains, tight);
        CHECK((contains && tight));
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
