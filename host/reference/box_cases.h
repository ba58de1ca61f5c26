#pragma once

// Cases of rays and boxes, and their judge.
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <string>
#include <vector>

#include "reference/intersect.h"
#include "reference/kernel_runner.h"
#include "reference/random_source.h"
#include "reference/rays.h"

namespace castor::reference::box_cases {

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
    std::vector<vec2> run(KernelRunner& fixture, float largest_coordinate) const {
        return fixture.run<vec2>("doctor/intersect_box_test", rays.size(), largest_coordinate, rays, lower, upper);
    }

    /// Returns whether the interval contains the exact one, and lies within the interval of the box with the largest
    /// enlargement that the comments of ray.cl allow.
    bool agrees(std::size_t i, vec2 found) const {
        const glm::dvec3 o(origin_of(rays[i])), d(direction_of(rays[i])), low(lower[i]), high(upper[i]);
        const double most = 1.5 * 0x1p-18 * (largest + 3.0);
        const auto exact = reference::intersect_box(o, d, low, high);
        const auto enlarged = reference::intersect_box(o, d, low - most, high + most);
        const bool meets = exact.entry <= exact.exit;
        const bool contains = !meets || (found.x <= exact.entry && found.y >= exact.exit);
        const bool tight = found.x > found.y || (enlarged.entry <= found.x && enlarged.exit >= found.y);
        return contains && tight;
    }
    std::string describe(std::size_t i) const {
        return to_text(rays[i]) + " at the box from " + to_text(lower[i]) + " to " + to_text(upper[i]);
    }
};

/// Makes rays of all octants, also along axes and in axis planes, for boxes near and far, flat and thick.
inline Ray random_ray(RandomSource& random) {
    vec3 direction = random.direction();
    for (int k = 0; k < 3; ++k)
        if (random.below(6) == 0) direction[k] = random.below(2) ? 0.0f : -0.0f;
    if (direction == vec3(0.0f)) direction.x = 1.0f;
    return make_ray(random.in_box(-3, 3), direction);
}

inline vec3 random_corner(RandomSource& random, vec3 other) {
    vec3 corner = random.in_box(-1, 1);
    for (int k = 0; k < 3; ++k)
        if (random.below(6) == 0) corner[k] = other[k];
    return corner;
}

}  // namespace castor::reference::box_cases
