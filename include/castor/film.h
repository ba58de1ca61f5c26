#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "castor/api.h"

namespace castor {

/// A further plane of the picture, such as depth: what the eye ray through each pixel's centre meets; or a light's
/// share of the picture. Row-major, row 0 on top, `channels.size()` values a pixel, as floats or as integers.
struct FilmPlane {
    std::string name;                    // "depth", "normal", "primitive", ...
    std::vector<std::string> channels;   // e.g. {"X", "Y", "Z"}
    std::vector<float> values;           // empty if the plane holds integers
    std::vector<std::uint32_t> indices;  // empty if the plane holds floats
};

/// A picture as linear, unlimited RGB means (255 is white in an 8-bit image), row-major, row 0 on top.
struct CASTOR_API Film {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t samples_per_pixel = 0;
    std::vector<glm::vec3> pixels;   // width * height; the mean of the samples taken, (0,0,0) without any
    std::vector<std::uint8_t> done;  // width * height; 1 where all samples were taken
    std::vector<FilmPlane> planes;

    /// Returns whether every pixel is done.
    bool complete() const;
};

}  // namespace castor
