#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "castor/scene.h"
#include "reference/random_source.h"
#include "render/camera.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec2;
using glm::vec3;

struct Result {
    vec3 direction;
    float unused;
    vec2 offset;
    vec2 also_unused;
};

std::vector<Result> run(KernelFixture& fixture, const Camera& camera, cl_uint filter, const std::vector<vec2>& points) {
    const std::vector<shared::Camera> cameras{make_camera(camera, "test")};
    return fixture.run<Result>("generate_rays_test", points.size(), filter, cameras, points);
}

/// d = s - e of the lecture, in double precision: m = e - w distance, q = m + l u + t v, s = q + s_u u - s_v v.
dvec3 lecture_direction(const Camera& camera, double x, double y) {
    const dvec3 w = -glm::normalize(dvec3(camera.gaze));
    const dvec3 u = glm::normalize(glm::cross(dvec3(camera.up), w)), v = glm::cross(w, u);
    const double s_u = x * (double(camera.right) - camera.left) / camera.width;
    const double s_v = y * (double(camera.top) - camera.bottom) / camera.height;
    return -w * double(camera.distance) + u * (camera.left + s_u) + v * (camera.top - s_v);
}

}  // namespace

TEST_CASE("the lecture's worked example gives its direction", "[kernels][oclgrind]") {
    KernelFixture fixture;
    Camera camera;  // at the origin, towards -z, window -1, 1, -1, 1 at distance 1
    camera.width = 1024;
    camera.height = 768;
    const auto found = run(fixture, camera, CASTOR_FILTER_BOX, {vec2(256.5f, 192.5f)});
    CHECK(std::fabs(found[0].direction.x - (-0.5 + 1.0 / 1024)) <= 0x1p-24);
    CHECK(std::fabs(found[0].direction.y - (0.5 - 1.0 / 768)) <= 0x1p-24);
    CHECK(found[0].direction.z == -1.0f);
}

TEST_CASE("eye rays follow the lecture's formula for any camera", "[kernels][oclgrind]") {
    KernelFixture fixture;
    RandomSource random(81);
    for (int trial = 0; trial < 20; ++trial) {
        Camera camera;
        camera.position = random.in_box(-10, 10);
        camera.gaze = random.direction() * random.uniform_float(0.1f, 10.0f);
        camera.up = random.direction();
        camera.left = random.uniform_float(-2, 0), camera.right = random.uniform_float(0.1f, 2);
        camera.bottom = random.uniform_float(-2, 0), camera.top = random.uniform_float(0.1f, 2);
        camera.distance = random.uniform_float(0.1f, 5);
        camera.width = 1 + random.below(2000), camera.height = 1 + random.below(2000);
        std::vector<vec2> points;
        for (std::size_t i = 0; i < test_size(100, 4); ++i)
            points.emplace_back(random.uniform_float(0, 1) * static_cast<float>(camera.width),
                                random.uniform_float(0, 1) * static_cast<float>(camera.height));
        const auto found = run(fixture, camera, CASTOR_FILTER_BOX, points);
        for (std::size_t i = 0; i < points.size(); ++i) {
            const dvec3 expected = lecture_direction(camera, points[i].x, points[i].y);
            CAPTURE(trial, points[i].x, points[i].y);
            // Rounded corner and steps, and two sums of numbers of at most about 10.
            REQUIRE(glm::length(dvec3(found[i].direction) - expected) < 1e-5);
        }
    }
}

TEST_CASE("filter offsets have the filters' supports and moments", "[kernels][oclgrind]") {
    struct Filter {
        cl_uint number;
        double largest, variance;  // of one coordinate
    };
    KernelFixture fixture;
    // Box of width 1; tent of half width 1; Gaussian of sigma 1/2 cut at radius 2.
    for (const Filter& filter :
         {Filter{CASTOR_FILTER_BOX, 0.5, 1.0 / 12}, Filter{CASTOR_FILTER_TENT, 1.0, 1.0 / 6},
          Filter{CASTOR_FILTER_GAUSSIAN, 2.0, 0.25 * (1 - 8 * std::exp(-8.0) / (1 - std::exp(-8.0)))}}) {
        const int n = std::getenv("CASTOR_TEST_SMALL") ? 16 : 256;
        std::vector<vec2> points;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) points.push_back((vec2(i, j) + 0.5f) / static_cast<float>(n));
        const auto found = run(fixture, Camera{}, filter.number, points);
        double largest = 0, mean = 0, variance = 0;
        for (const Result& result : found) {
            largest = std::max({largest, std::fabs(double(result.offset.x)), std::fabs(double(result.offset.y))});
            mean += result.offset.x + result.offset.y;
            variance += double(result.offset.x) * result.offset.x + double(result.offset.y) * result.offset.y;
        }
        CAPTURE(filter.number, n);
        CHECK(largest <= filter.largest);
        CHECK(std::fabs(mean / static_cast<double>(2 * found.size())) < 1e-3);
        CHECK(variance / static_cast<double>(2 * found.size()) == Approx(filter.variance).epsilon(4.0 / n));
    }
}

}  // namespace castor::test
