#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "castor/scene.h"

namespace castor {

// One function for each library that decodes. Each takes a whole file, and throws Error with a reason, but without a
// file name, for bytes that are not such a picture. None trusts the bytes: sizes are checked before memory is asked
// for.

/// Decodes a file of any format that read_image knows.
Image decode_picture(std::string_view bytes, bool may_be_tga);

/// Whether this build has the library.
bool decodes_webp();
/// Whether the file begins as WebP does.
bool is_webp(std::string_view bytes);
Image decode_webp(std::string_view bytes);

/// Sets a picture's bytes, and its alpha unless all of it is 255, from four values a texel.
void set_rgba(Image& image, std::span<const std::uint8_t> rgba);

/// Decodes PNG, JPEG, BMP and Radiance HDR, by the first bytes; TGA, which has no such mark, where `may_be_tga`.
Image decode_stb(std::string_view bytes, bool may_be_tga);

/// Whether the file begins as OpenEXR does.
bool is_exr(std::string_view bytes);
Image decode_exr(std::string_view bytes);

/// Throws Error for a size that no picture may have, or that `byte_count` bytes cannot hold, where one byte holds at
/// most `most_texels_a_byte`: such a file would ask for memory out of all proportion.
void require_plausible_size(std::uint64_t width, std::uint64_t height, std::size_t byte_count,
                            std::uint64_t most_texels_a_byte);

/// Returns "the texel in column 7, row 2 has the value -1" of the value with this number.
std::string describe_value(const Image& image, std::size_t number);
/// Throws Error that names the first value that is not finite.
void require_finite(const Image& image);

}  // namespace castor
