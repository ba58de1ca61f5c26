#pragma once

#include <cmath>
#include <glm/vec3.hpp>

#include "castor/film.h"
#include "support/catch.h"

namespace castor::test {

struct Estimate {
    double mean = 0.0, standard_error = 0.0;
};

/// Estimates the red channel from pixels that see the same: their samples are independent.
inline Estimate estimate_of(const Film& film) {
    const auto count = static_cast<double>(film.pixels.size());
    double sum = 0.0, squares = 0.0;
    for (const glm::vec3& pixel : film.pixels) sum += pixel.x;
    for (const glm::vec3& pixel : film.pixels) squares += std::pow(pixel.x - sum / count, 2.0);
    return {sum / count, std::sqrt(squares / (count - 1.0) / count)};
}

/// Student's t for some hundred pixels: four standard errors. The rounding of floats comes on top.
inline void check_mean(const Estimate& found, double expected) {
    CAPTURE(found.mean, found.standard_error, expected, (found.mean - expected) / found.standard_error);
    CHECK(std::abs(found.mean - expected) <= 4.0 * found.standard_error + 1e-5 * expected);
    CHECK(found.standard_error <= 0.01 * expected);
}

}  // namespace castor::test
