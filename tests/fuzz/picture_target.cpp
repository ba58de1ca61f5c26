// Target for the readers of pictures, all formats. PNG's checksums are made right, since they would keep almost every
// changed file from being looked at.
#include <tinyexr.h>

#include "castor/error.h"
#include "fuzz/targets.h"
#include "image/decode.h"
#include "support/compressed_gltf.h"
#include "support/picture_bytes.h"

namespace castor::fuzz {

void run_picture(std::string_view input) {
    const bool is_png = input.starts_with("\x89PNG");
    const std::string bytes = is_png ? test::with_right_png_checksums(std::string(input)) : std::string(input);
    try {
        const Image image = is_exr(bytes) ? decode_exr(bytes) : decode_stb(bytes, true);
        require(image.bytes.empty() != image.floats.empty(), "a picture has either bytes or floats");
        require(image.bytes.size() + image.floats.size() == std::size_t{3} * image.width * image.height,
                "a picture has three values a texel");
        require_finite(image);
    } catch (const Error&) {
    }
}

std::vector<std::string> picture_seeds() {
    constexpr int kWidth = 9, kHeight = 5;
    std::vector<std::string> seeds;
    for (int channels = 1; channels <= 4; ++channels) {
        const std::vector<std::uint8_t> values = test::some_bytes(kWidth, kHeight, channels);
        seeds.push_back(test::png_bytes(kWidth, kHeight, channels, values));
        seeds.push_back(test::tga_bytes(kWidth, kHeight, channels, values, channels % 2 == 0));
        seeds.push_back(test::jpeg_bytes(kWidth, kHeight, channels, values));
        if (channels == 4 && test::has_webp()) seeds.push_back(test::webp_bytes(kWidth, kHeight, values));
        if (channels >= 3) seeds.push_back(test::bmp_bytes(kWidth, kHeight, channels, values));
    }
    seeds.push_back(test::stored_png_bytes(2, 2, 16, 6, std::string(34, '\0')));
    seeds.push_back(test::stored_png_bytes(9, 2, 1, 3, {0, 85, 0, 0, 85, 0}, {1, 2, 3, 4, 5, 6}));
    const std::vector<float> floats(kWidth * kHeight * 3, 0.75f);
    seeds.push_back(test::hdr_bytes(kWidth, kHeight, floats));
    for (const int compression :
         {TINYEXR_COMPRESSIONTYPE_NONE, TINYEXR_COMPRESSIONTYPE_RLE, TINYEXR_COMPRESSIONTYPE_ZIPS,
          TINYEXR_COMPRESSIONTYPE_ZIP, TINYEXR_COMPRESSIONTYPE_PIZ})
        seeds.push_back(test::exr_bytes(kWidth, kHeight, {"B", "G", "R"}, floats, compression,
                                        compression % 2 ? TINYEXR_PIXELTYPE_HALF : TINYEXR_PIXELTYPE_FLOAT));
    return seeds;
}

}  // namespace castor::fuzz
