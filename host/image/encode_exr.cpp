// OpenEXR through tinyexr.
#include <fmt/format.h>
#include <tinyexr.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "castor/error.h"
#include "image/encode.h"

namespace castor {

namespace {

/// Returns the bytes of a channel's values, one after another.
std::vector<unsigned char> gathered(const ExrChannel& channel, std::size_t count) {
    std::vector<unsigned char> bytes(4 * count);
    const auto* first = channel.integers.empty() ? reinterpret_cast<const unsigned char*>(channel.floats.data())
                                                 : reinterpret_cast<const unsigned char*>(channel.integers.data());
    for (std::size_t i = 0; i < count; ++i) std::memcpy(&bytes[4 * i], first + 4 * i * channel.stride, 4);
    return bytes;
}

std::string take_message(const char* message) {
    const std::string text = message ? message : "unknown reason";
    FreeEXRErrorMessage(message);
    return text;
}

Bytes save(const EXRImage& image, const EXRHeader& header) {
    unsigned char* memory = nullptr;
    const char* message = nullptr;
    const std::size_t size = SaveEXRImageToMemory(&image, &header, &memory, &message);
    if (size == 0) throw Error("the picture cannot be written as EXR: " + take_message(message));
    const std::unique_ptr<unsigned char, decltype(&std::free)> owner(memory, &std::free);
    const auto* first = reinterpret_cast<const std::byte*>(memory);
    return Bytes(first, first + size);
}

}  // namespace

Bytes encode_exr(std::uint32_t width, std::uint32_t height, std::vector<ExrChannel> channels) {
    // The format sorts channels by name.
    std::sort(channels.begin(), channels.end(),
              [](const ExrChannel& a, const ExrChannel& b) { return a.name < b.name; });
    const std::size_t count = std::size_t{width} * height;
    std::vector<std::vector<unsigned char>> planes;
    std::vector<unsigned char*> images;
    std::vector<EXRChannelInfo> infos(channels.size());
    std::vector<int> types;
    for (std::size_t i = 0; i < channels.size(); ++i) {
        const std::string& name = channels[i].name;
        if (name.size() >= sizeof(infos[i].name))
            throw Error(fmt::format("the channel name \"{}\" is too long for EXR", name));
        if (i > 0 && name == channels[i - 1].name) throw Error(fmt::format("two channels have the name \"{}\"", name));
        std::memcpy(infos[i].name, name.c_str(), name.size() + 1);
        images.push_back(planes.emplace_back(gathered(channels[i], count)).data());
        types.push_back(channels[i].integers.empty() ? TINYEXR_PIXELTYPE_FLOAT : TINYEXR_PIXELTYPE_UINT);
    }
    EXRImage image;
    InitEXRImage(&image);
    image.images = images.data();
    image.width = static_cast<int>(width);
    image.height = static_cast<int>(height);
    image.num_channels = static_cast<int>(channels.size());

    EXRHeader header;
    InitEXRHeader(&header);
    header.channels = infos.data();
    header.num_channels = image.num_channels;
    header.pixel_types = types.data();
    header.requested_pixel_types = types.data();
    header.compression_type = TINYEXR_COMPRESSIONTYPE_ZIP;
    header.long_name = std::any_of(channels.begin(), channels.end(), [](const ExrChannel& c) {
        return c.name.size() > 31;  // what files may have without the mark
    });
    return save(image, header);
}

}  // namespace castor
