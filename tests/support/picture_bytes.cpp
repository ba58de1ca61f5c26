#include "support/picture_bytes.h"

#include <tinyexr.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>

#define STBIWDEF [[maybe_unused]] static
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wunused-variable"
#include <stb_image_write.h>
#pragma GCC diagnostic pop

namespace castor::test {

namespace {

void append(void* file, void* data, int size) {
    static_cast<std::string*>(file)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

std::string big_endian(std::uint32_t number) {
    return {static_cast<char>(number >> 24), static_cast<char>(number >> 16), static_cast<char>(number >> 8),
            static_cast<char>(number)};
}

/// The checksum of PNG's chunks (ISO/IEC 15948, annex D).
std::uint32_t crc(std::string_view bytes) {
    std::uint32_t sum = 0xffffffffu;
    for (const char c : bytes) {
        sum ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ (sum & 1 ? 0xedb88320u : 0);
    }
    return ~sum;
}

std::string chunk(const std::string& type, const std::string& data) {
    return big_endian(static_cast<std::uint32_t>(data.size())) + type + data + big_endian(crc(type + data));
}

/// A zlib stream of one stored block.
std::string stored(const std::string& data) {
    if (data.size() > 0xffff) throw std::logic_error("a stored block has at most 65535 bytes");
    const auto size = static_cast<std::uint16_t>(data.size());
    const auto low_first = [](std::uint16_t n) {
        return std::string{static_cast<char>(n & 0xff), static_cast<char>(n >> 8)};
    };
    std::uint32_t a = 1, b = 0;
    for (const char c : data) {
        a = (a + static_cast<unsigned char>(c)) % 65521;
        b = (b + a) % 65521;
    }
    return "\x78\x01\x01" + low_first(size) + low_first(static_cast<std::uint16_t>(~size)) + data +
           big_endian(b << 16 | a);
}

}  // namespace

std::string png_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values) {
    std::string file;
    stbi_write_png_to_func(append, &file, width, height, channels, values.data(), width * channels);
    return file;
}

std::string bmp_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values) {
    std::string file;
    stbi_write_bmp_to_func(append, &file, width, height, channels, values.data());
    return file;
}

std::string tga_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values, bool compressed) {
    std::string file;
    stbi_write_tga_with_rle = compressed;
    stbi_write_tga_to_func(append, &file, width, height, channels, values.data());
    return file;
}

std::string jpeg_bytes(int width, int height, int channels, const std::vector<std::uint8_t>& values) {
    constexpr int kBest = 100;
    std::string file;
    stbi_write_jpg_to_func(append, &file, width, height, channels, values.data(), kBest);
    return file;
}

std::string hdr_bytes(int width, int height, const std::vector<float>& rgb) {
    std::string file;
    stbi_write_hdr_to_func(append, &file, width, height, 3, rgb.data());
    return file;
}

std::string stored_png_bytes(std::uint32_t width, std::uint32_t height, int bits, int colour_type,
                             const std::string& rows, const std::string& palette) {
    const std::string header = big_endian(width) + big_endian(height) + static_cast<char>(bits) +
                               static_cast<char>(colour_type) + std::string(3, '\0');
    return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + (palette.empty() ? "" : chunk("PLTE", palette)) +
           chunk("IDAT", stored(rows)) + chunk("IEND", "");
}

std::string with_right_png_checksums(std::string bytes) {
    constexpr std::size_t kMagic = 8, kFrame = 12;
    for (std::size_t i = kMagic; i + kFrame <= bytes.size();) {
        std::size_t length = 0;
        for (std::size_t k = 0; k < 4; ++k) length = length << 8 | static_cast<unsigned char>(bytes[i + k]);
        if (length > bytes.size() - i - kFrame) break;
        bytes.replace(i + 8 + length, 4, big_endian(crc(std::string_view(bytes).substr(i + 4, 4 + length))));
        i += kFrame + length;
    }
    return bytes;
}

std::string exr_bytes(int width, int height, const std::vector<std::string>& channels, const std::vector<float>& values,
                      int compression, int pixel_type) {
    const std::size_t count = channels.size();
    std::vector<std::vector<float>> planes(count);
    for (std::size_t i = 0; i < values.size(); ++i) planes[i % count].push_back(values[i]);
    std::vector<EXRChannelInfo> infos(count);
    std::vector<unsigned char*> images;
    for (std::size_t c = 0; c < count; ++c) {
        std::strncpy(infos[c].name, channels[c].c_str(), sizeof(infos[c].name) - 1);
        images.push_back(reinterpret_cast<unsigned char*>(planes[c].data()));
    }
    std::vector<int> given(count, TINYEXR_PIXELTYPE_FLOAT), wanted(count, pixel_type);
    EXRHeader header;
    InitEXRHeader(&header);
    header.channels = infos.data();
    header.num_channels = static_cast<int>(count);
    header.pixel_types = given.data();
    header.requested_pixel_types = wanted.data();
    header.compression_type = compression;
    EXRImage image;
    InitEXRImage(&image);
    image.images = images.data();
    image.num_channels = static_cast<int>(count);
    image.width = width;
    image.height = height;
    unsigned char* memory = nullptr;
    const char* message = nullptr;
    const std::size_t size = SaveEXRImageToMemory(&image, &header, &memory, &message);
    if (size == 0) throw std::logic_error(message);
    const std::unique_ptr<unsigned char, decltype(&std::free)> owner(memory, &std::free);
    return {reinterpret_cast<const char*>(memory), size};
}

std::vector<std::uint8_t> some_bytes(int width, int height, int channels) {
    std::vector<std::uint8_t> values;
    for (int i = 0; i < width * height; ++i)
        for (int c = 0; c < channels; ++c) values.push_back(static_cast<std::uint8_t>(7 * i + 3 * c));
    return values;
}

}  // namespace castor::test
