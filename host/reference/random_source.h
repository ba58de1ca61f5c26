#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <random>

namespace castor::reference {

/// Seeded random numbers that are the same with every standard library, as its distributions are not.
class RandomSource {
public:
    explicit RandomSource(std::uint64_t seed) : engine_(seed) {}

    std::uint32_t bits() { return static_cast<std::uint32_t>(engine_() >> 32); }
    std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(std::uint64_t{bits()} * count >> 32); }
    /// Returns any float, also NaN, infinities and denormals.
    float any_float() { return std::bit_cast<float>(bits()); }
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    float uniform_float(float low, float high) { return static_cast<float>(uniform(low, high)); }
    glm::vec3 in_box(float low, float high) {
        const float x = uniform_float(low, high), y = uniform_float(low, high);
        return {x, y, uniform_float(low, high)};
    }
    /// Returns a uniform point of the unit sphere (Archimedes: z is uniform).
    glm::vec3 direction() {
        const double z = uniform(-1.0, 1.0), angle = uniform(0.0, 6.283185307179586);
        const double r = std::sqrt(1.0 - z * z);
        return {static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)),
                static_cast<float>(z)};
    }

private:
    std::mt19937_64 engine_;
};

}  // namespace castor::reference
