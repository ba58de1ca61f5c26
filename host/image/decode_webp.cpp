// Decodes WebP with libwebp. Only this file includes that header.
#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "castor/error.h"
#include "image/decode.h"

#ifdef CASTOR_HAS_WEBP
#include <webp/decode.h>
#endif

namespace castor {

bool is_webp(std::string_view bytes) {
    return bytes.starts_with("RIFF") && bytes.size() >= 12 && bytes.substr(8, 4) == "WEBP";
}

#ifdef CASTOR_HAS_WEBP

bool decodes_webp() {
    return true;
}

Image decode_webp(std::string_view bytes) {
    const auto* const first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    WebPBitstreamFeatures features;
    if (const VP8StatusCode status = WebPGetFeatures(first, bytes.size(), &features); status != VP8_STATUS_OK)
        throw Error(fmt::format("the header of the WebP file is broken: code {} of libwebp", static_cast<int>(status)));
    if (features.has_animation != 0) throw Error("the WebP file is an animation, expected one picture");
    // A picture of one colour takes a few dozen bytes, whatever its size.
    constexpr std::uint64_t kMostTexelsAByte = 1 << 18;
    require_plausible_size(static_cast<std::uint64_t>(features.width), static_cast<std::uint64_t>(features.height),
                           bytes.size(), kMostTexelsAByte);
    Image image;
    image.width = static_cast<std::uint32_t>(features.width);
    image.height = static_cast<std::uint32_t>(features.height);
    std::vector<std::uint8_t> rgba(std::size_t{4} * image.width * image.height);
    if (WebPDecodeRGBAInto(first, bytes.size(), rgba.data(), rgba.size(), 4 * features.width) == nullptr)
        throw Error("the WebP file is broken, or ends before its picture does");
    set_rgba(image, rgba);
    return image;
}

#else

bool decodes_webp() {
    return false;
}

Image decode_webp(std::string_view) {
    throw Error("the picture is WebP, and this build has no libwebp");
}

#endif

}  // namespace castor
