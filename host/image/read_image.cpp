#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/mapped_file.h"
#include "castor/error.h"
#include "castor/image_io.h"
#include "image/decode.h"

namespace castor {

namespace {

bool is_named_tga(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return extension == ".tga";
}

}  // namespace

Image decode_picture(std::string_view bytes, bool may_be_tga) {
    if (bytes.empty()) throw Error("the file is empty, expected a picture");
    Image image = is_exr(bytes)    ? decode_exr(bytes)
                  : is_webp(bytes) ? decode_webp(bytes)
                                   : decode_stb(bytes, may_be_tga);
    require_finite(image);
    return image;
}

void set_rgba(Image& image, std::span<const std::uint8_t> rgba) {
    const std::size_t count = rgba.size() / 4;
    image.bytes.resize(3 * count);
    bool is_opaque = true;
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t c = 0; c < 3; ++c) image.bytes[3 * i + c] = rgba[4 * i + c];
        is_opaque &= rgba[4 * i + 3] == 255;
    }
    if (is_opaque) return;
    image.alpha.resize(count);
    for (std::size_t i = 0; i < count; ++i) image.alpha[i] = rgba[4 * i + 3];
}

void require_plausible_size(std::uint64_t width, std::uint64_t height, std::size_t byte_count,
                            std::uint64_t most_texels_a_byte) {
    if (width == 0 || height == 0)
        throw Error(fmt::format("the picture has {}x{} texels, expected some", width, height));
    if (width > kMaxTexels / height)
        throw Error(fmt::format("the picture has {}x{} texels, and at most {} in all are supported", width, height,
                                kMaxTexels));
    if (width * height / most_texels_a_byte > byte_count)
        throw Error(fmt::format("the header says {}x{} texels, but a file of {} bytes has at most {}", width, height,
                                byte_count, byte_count * most_texels_a_byte));
}

std::string describe_value(const Image& image, std::size_t number) {
    const std::size_t texel = number / 3;
    return fmt::format("the texel in column {}, row {} has the value {}", texel % image.width, texel / image.width,
                       image.floats[number]);
}

void require_finite(const Image& image) {
    const auto found =
        std::find_if(image.floats.begin(), image.floats.end(), [](float value) { return !std::isfinite(value); });
    if (found == image.floats.end()) return;
    throw Error(describe_value(image, static_cast<std::size_t>(found - image.floats.begin())) +
                ", expected finite values");
}

Image read_image(const std::filesystem::path& file) {
    const MappedFile mapped(file);
    try {
        Image image = decode_picture(mapped.bytes(), is_named_tga(file));
        image.file = file.string();
        return image;
    } catch (const Error& error) {
        throw SceneError(file.string(), 0, error.what());
    } catch (const std::bad_alloc&) {
        throw SceneError(file.string(), 0, "there is not enough memory for the picture");
    }
}

}  // namespace castor
