#pragma once

#include <cstddef>
#include <string>

#include "castor/film.h"
#include "castor/renderer.h"

namespace castor {

/// Compares all bits of pixels of two films of one picture.
class FilmComparison {
public:
    /// `first`, which must stay, is one of the films.
    explicit FilmComparison(const Film& first) : first_(first) {}

    /// Compares one pixel with that of another film. `first_maker` and `second_maker`: who made them, for people.
    void compare(const Film& second, std::size_t pixel, const std::string& first_maker,
                 const std::string& second_maker);
    /// What was found so far; without a gap.
    const Verification& result() const { return result_; }

private:
    const Film& first_;
    Verification result_;
};

/// Returns "(x, y), R: 0.1 from a, 0.2 from b, 3 units in the last place apart".
std::string describe(const PixelDifference& difference);

}  // namespace castor
