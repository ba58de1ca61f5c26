#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <random>

namespace castor {

/// Random numbers that are the same everywhere: the standard library's distributions differ between implementations,
/// its generator does not.
class Random {
public:
    explicit Random(std::uint32_t seed) : generator_(seed) {}

    /// Returns a number in [0, 1) with 24 bits.
    double uniform() { return static_cast<double>(generator_() >> 8) * 0x1p-24; }
    double between(double least, double most) { return least + (most - least) * uniform(); }
    glm::dvec3 in_box(const glm::dvec3& lower, const glm::dvec3& upper) {
        glm::dvec3 point;
        for (int axis = 0; axis < 3; ++axis) point[axis] = between(lower[axis], upper[axis]);
        return point;
    }

private:
    std::mt19937 generator_;
};

}  // namespace castor
