#include "castor/film.h"

#include <algorithm>

namespace castor {

bool Film::complete() const {
    return done.size() == std::size_t{width} * height &&
           std::all_of(done.begin(), done.end(), [](std::uint8_t is_done) { return is_done != 0; });
}

}  // namespace castor
