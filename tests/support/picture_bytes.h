#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace castor::test {

// Whole files of pictures, made by other means than Castor's own. `values` has `channels` a texel, row 0 on top.

std::string png_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values);
std::string bmp_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values);
std::string tga_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values, bool compressed);
std::string jpeg_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values);
std::string hdr_bytes(int width, int height, const std::vector<float>& rgb);

/// A PNG without compression: `rows` is the data of all rows, each behind its filter's number.
std::string stored_png_bytes(std::uint32_t width, std::uint32_t height, int bits, int colour_type,
                             const std::string& rows, const std::string& palette = {});

/// Returns a PNG file, which may be damaged otherwise, with the checksums that its chunks should have.
std::string with_right_png_checksums(std::string bytes);

/// An EXR file; `compression` and `pixel_type` are tinyexr's numbers. Channels are in the order of their names.
std::string exr_bytes(int width, int height, const std::vector<std::string>& channels, const std::vector<float>& values,
                      int compression, int pixel_type);

/// Texels that all differ a little: (7 i + 3 c) mod 256 for value c of texel i.
std::vector<std::uint8_t> some_bytes(int width, int height, int channels);

}  // namespace castor::test
