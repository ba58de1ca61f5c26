// OpenEXR through tinyexr.
#include <fmt/format.h>
#include <tinyexr.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>

#include "castor/error.h"
#include "image/encode.h"

namespace castor {

namespace {

/// Returns one plane for each of `channels`, taken from interleaved values.
template <class T>
std::vector<std::vector<T>> separate(std::span<const T> values, const std::vector<std::size_t>& channels) {
    std::vector<std::vector<T>> planes;
    for (const std::size_t channel : channels) {
        std::vector<T>& plane = planes.emplace_back(values.size() / channels.size());
        for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = values[i * channels.size() + channel];
    }
    return planes;
}

/// Returns the order of channels in the file: the format sorts them by name.
std::vector<std::size_t> alphabetical(const std::vector<std::string>& names) {
    std::vector<std::size_t> order(names.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return names[a] < names[b]; });
    return order;
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

template <class T>
Bytes encode(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& names,
             std::span<const T> values, int pixel_type) {
    static_assert(sizeof(T) == 4);
    const std::vector<std::size_t> order = alphabetical(names);
    std::vector<std::vector<T>> planes = separate(values, order);

    std::vector<unsigned char*> images;
    std::vector<EXRChannelInfo> infos(names.size());
    std::vector<int> types(names.size(), pixel_type);
    for (std::size_t i = 0; i < names.size(); ++i) {
        images.push_back(reinterpret_cast<unsigned char*>(planes[i].data()));
        const std::string& name = names[order[i]];
        if (name.size() >= sizeof(infos[i].name))
            throw Error(fmt::format("the channel name \"{}\" is too long for EXR", name));
        std::memcpy(infos[i].name, name.c_str(), name.size() + 1);
    }
    EXRImage image;
    InitEXRImage(&image);
    image.images = images.data();
    image.width = static_cast<int>(width);
    image.height = static_cast<int>(height);
    image.num_channels = static_cast<int>(names.size());

    EXRHeader header;
    InitEXRHeader(&header);
    header.channels = infos.data();
    header.num_channels = image.num_channels;
    header.pixel_types = types.data();
    header.requested_pixel_types = types.data();
    header.compression_type = TINYEXR_COMPRESSIONTYPE_ZIP;
    return save(image, header);
}

}  // namespace

Bytes encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& channels,
                 std::span<const float> values) {
    return encode(width, height, channels, values, TINYEXR_PIXELTYPE_FLOAT);
}

Bytes encode_exr(std::uint32_t width, std::uint32_t height, const std::vector<std::string>& channels,
                 std::span<const std::uint32_t> values) {
    return encode(width, height, channels, values, TINYEXR_PIXELTYPE_UINT);
}

}  // namespace castor
