#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "base/box.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/reference.h"

namespace castor::test {

/// Returns a coordinate: usually of the size of `scale`, sometimes zero of either sign, denormal, the smallest normal,
/// huge, or `other` or its neighbour.
inline float nasty_coordinate(RandomSource& random, float scale, float other) {
    switch (random.below(24)) {
        case 0:
            return random.below(2) ? 0.0f : -0.0f;
        case 1:
            return random.uniform_float(-1, 1) * std::numeric_limits<float>::min();
        case 2:
            return (random.below(2) ? 1.0f : -1.0f) * std::numeric_limits<float>::min();
        case 3:
            return random.uniform_float(-1e12f, 1e12f);
        case 4:
            return random.below(2) ? 1e12f : -1e12f;
        case 5:
            return std::nextafter(other, random.below(2) ? 1e12f : -1e12f);
        case 6:
            return other;
        default:
            return random.uniform_float(-1, 1) * scale;
    }
}

/// Returns one to eight boxes of children at random places, the others empty: of all sizes, now and then far away or
/// flat, some with nasty coordinates.
inline std::array<Box, 8> random_children(RandomSource& random) {
    std::array<Box, 8> boxes;
    const float scale = std::exp2(random.uniform_float(-140, 38));
    const bool is_nasty = random.below(2) != 0;
    const glm::vec3 offset =
        random.below(3) ? glm::vec3(0) : random.in_box(-1, 1) * std::exp2(random.uniform_float(-20, 39));
    const std::uint32_t certain = random.below(8);
    for (std::uint32_t place = 0; place < 8; ++place) {
        if (place != certain && random.below(4) == 0) continue;
        const glm::vec3 a = offset + random.in_box(-1, 1) * scale;
        const glm::vec3 b = random.below(4) ? offset + random.in_box(-1, 1) * scale : a;
        for (int axis = 0; axis < 3; ++axis) {
            const float p = is_nasty ? nasty_coordinate(random, scale, b[axis]) : a[axis];
            const float q = is_nasty && random.below(4) == 0 ? p : b[axis];
            boxes[place].lower[axis] = std::min(p, q);
            boxes[place].upper[axis] = std::max(p, q);
        }
    }
    return boxes;
}

inline bool is_empty(const Box& box) {
    return box.lower[0] > box.upper[0];
}

using reference::to_text;

inline std::string to_text(const Box& box) {
    return to_text(glm::vec3(box.lower[0], box.lower[1], box.lower[2])) + " to " +
           to_text(glm::vec3(box.upper[0], box.upper[1], box.upper[2]));
}

}  // namespace castor::test
