#include "render/pixel_blocks.h"

namespace castor {

namespace {

constexpr std::uint32_t kSquare = 16;  // blocks

std::uint32_t in_blocks(std::uint32_t pixels) {
    return (pixels + CASTOR_PIXEL_BLOCK - 1) / CASTOR_PIXEL_BLOCK;
}

}  // namespace

PixelBlocks::PixelBlocks(std::uint32_t width, std::uint32_t height)
    : width_(width), height_(height), across_(in_blocks(width)), down_(in_blocks(height)) {}

glm::uvec2 PixelBlocks::corner(std::uint32_t number) const {
    const std::uint32_t row_of_squares = number / (across_ * kSquare);
    const std::uint32_t square_height = std::min(kSquare, down_ - row_of_squares * kSquare);
    const std::uint32_t in_row = number - row_of_squares * across_ * kSquare;
    const std::uint32_t square = in_row / (kSquare * square_height);
    const std::uint32_t square_width = std::min(kSquare, across_ - square * kSquare);
    const std::uint32_t in_square = in_row - square * kSquare * square_height;
    return {(square * kSquare + in_square % square_width) * CASTOR_PIXEL_BLOCK,
            (row_of_squares * kSquare + in_square / square_width) * CASTOR_PIXEL_BLOCK};
}

}  // namespace castor
