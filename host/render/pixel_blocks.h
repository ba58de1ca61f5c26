#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "castor/shared/constants.h"

namespace castor {

/// A picture cut into squares of CASTOR_PIXEL_BLOCK pixels, which are numbered so that those with neighbouring numbers
/// are neighbours in the picture: by squares of 16 x 16 blocks, row by row, and so within each of these.
class PixelBlocks {
public:
    static constexpr std::uint32_t kPixels = CASTOR_PIXEL_BLOCK * CASTOR_PIXEL_BLOCK;  // of a block

    PixelBlocks(std::uint32_t width, std::uint32_t height);

    std::uint32_t count() const { return across_ * down_; }
    /// The left upper pixel of a block; and that as devices read it (see CASTOR_PIXEL_BLOCK).
    glm::uvec2 corner(std::uint32_t number) const;
    std::uint32_t code(std::uint32_t number) const {
        const glm::uvec2 pixel = corner(number);
        return pixel.y << 16 | pixel.x;
    }

    /// Returns where in its block the pixel lies whose slots are the `place`-th of the block: along its Z curve (see
    /// slots.cl).
    static glm::uvec2 on_curve(std::uint32_t place) {
        glm::uvec2 at(0);
        for (std::uint32_t bit = 0; 1u << bit < CASTOR_PIXEL_BLOCK; ++bit) {
            at.x |= (place >> 2 * bit & 1) << bit;
            at.y |= (place >> (2 * bit + 1) & 1) << bit;
        }
        return at;
    }

    /// Calls copy(first pixel of the picture, first pixel of the wave, pixels) for each row of pixels of a block that
    /// is the `place`-th of a wave. The pixels of both are numbered row by row, the latter 64 a block.
    template <class Copy>
    void for_each_row(std::uint32_t number, std::size_t place, const Copy& copy) const {
        const glm::uvec2 first = corner(number);
        const std::uint32_t columns = std::min<std::uint32_t>(CASTOR_PIXEL_BLOCK, width_ - first.x);
        const std::uint32_t rows = std::min<std::uint32_t>(CASTOR_PIXEL_BLOCK, height_ - first.y);
        for (std::uint32_t row = 0; row < rows; ++row)
            copy(std::size_t{first.y + row} * width_ + first.x, place * kPixels + row * CASTOR_PIXEL_BLOCK, columns);
    }
    /// Pixels of a block that lie in the picture.
    std::uint32_t pixels_in_picture(std::uint32_t number) const {
        const glm::uvec2 first = corner(number);
        return std::min<std::uint32_t>(CASTOR_PIXEL_BLOCK, width_ - first.x) *
               std::min<std::uint32_t>(CASTOR_PIXEL_BLOCK, height_ - first.y);
    }

private:
    std::uint32_t width_, height_;
    std::uint32_t across_, down_;  // in blocks
};

}  // namespace castor
