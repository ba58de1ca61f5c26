#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "castor/scene.h"
#include "scene/texture_columns.h"

namespace castor::reference {

/// Returns the texel at column x and row y, which may lie outside of the picture.
inline glm::dvec3 texel(const Image& image, std::int64_t x, std::int64_t y, TextureWrap wrap) {
    const std::int64_t width = image.width, height = image.height;
    if (wrap == TextureWrap::clamp) {
        x = std::clamp<std::int64_t>(x, 0, width - 1);
        y = std::clamp<std::int64_t>(y, 0, height - 1);
    }
    const auto i = static_cast<std::size_t>(3 * (y % height * width + x % width));
    if (image.floats.empty()) return {image.bytes[i], image.bytes[i + 1], image.bytes[i + 2]};
    return {image.floats[i], image.floats[i + 1], image.floats[i + 2]};
}

inline double wrapped(double u, TextureWrap wrap) {
    if (wrap == TextureWrap::clamp) return std::clamp(u, 0.0, 1.0);
    return u - std::floor(u);
}

inline glm::dvec3 nearest_texel(const Image& image, double u, double v, TextureWrap wrap) {
    return texel(image, static_cast<std::int64_t>(std::floor(wrapped(u, wrap) * image.width)),
                 static_cast<std::int64_t>(std::floor(wrapped(v, wrap) * image.height)), wrap);
}

inline glm::dvec3 bilinear_texel(const Image& image, double u, double v, TextureWrap wrap) {
    const double x = wrapped(u, wrap) * image.width, y = wrapped(v, wrap) * image.height;
    const auto p = static_cast<std::int64_t>(std::floor(x)), q = static_cast<std::int64_t>(std::floor(y));
    const double dx = x - static_cast<double>(p), dy = y - static_cast<double>(q);
    return (1 - dx) * (1 - dy) * texel(image, p, q, wrap) + dx * (1 - dy) * texel(image, p + 1, q, wrap) +
           (1 - dx) * dy * texel(image, p, q + 1, wrap) + dx * dy * texel(image, p + 1, q + 1, wrap);
}

/// `levels`: see levels_of.
inline glm::dvec3 trilinear_texel(const std::vector<Image>& levels, double u, double v, double level,
                                  TextureWrap wrap) {
    const double limited = std::clamp(level, 0.0, static_cast<double>(levels.size() - 1));
    const auto finer = static_cast<std::size_t>(limited);
    const std::size_t coarser = std::min(finer + 1, levels.size() - 1);
    const double rest = limited - static_cast<double>(finer);
    return (1 - rest) * bilinear_texel(levels[finer], u, v, wrap) + rest * bilinear_texel(levels[coarser], u, v, wrap);
}

/// Returns the picture and all smaller ones.
inline std::vector<Image> levels_of(const Image& image) {
    std::vector<Image> levels{image};
    while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(half_size(levels.back()));
    return levels;
}

/// Returns whether rounding may move a coordinate over the border between two of so many texels.
inline bool is_near_border(double u, std::uint32_t size) {
    const double x = (u - std::floor(u)) * size;
    return std::abs(x - std::round(x)) < 0x1p-20 * size;
}

/// Returns how much a texel may differ from that of these functions, where texels lie within [0, white]: neighbours
/// differ by `white` at most, and a coordinate is rounded by its texels times 2^-24.
inline double texel_tolerance(const Image& image, double white) {
    return 16 * 0x1p-24 * white * std::max(image.width, image.height);
}

}  // namespace castor::reference
