#include <tinyexr.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "castor/error.h"
#include "castor/image_io.h"
#include "support/catch.h"
#include "support/picture_bytes.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

constexpr int kWidth = 9, kHeight = 5;

const TemporaryDirectory& folder() {
    static const TemporaryDirectory kFolder;
    return kFolder;
}

Image read(const std::string& bytes, const std::string& name = "picture") {
    return read_image(folder().write(name, bytes));
}

std::string message_of(const std::string& bytes, const std::string& name = "picture") {
    const std::filesystem::path file = folder().write(name, bytes);
    try {
        read_image(file);
    } catch (const SceneError& error) {
        CHECK(error.file() == file.string());
        return error.reason();
    }
    return "nothing was thrown";
}

/// What a picture with `channels` a texel is in RGB: grey three times, and without alpha.
template <class T>
std::vector<T> rgb_of(const std::vector<T>& values, int channels) {
    std::vector<T> rgb;
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(channels))
        for (std::size_t c = 0; c < 3; ++c) rgb.push_back(values[i + (channels >= 3 ? c : 0)]);
    return rgb;
}

void check_size(const Image& image, int width = kWidth, int height = kHeight) {
    CHECK(image.width == static_cast<std::uint32_t>(width));
    CHECK(image.height == static_cast<std::uint32_t>(height));
}

std::string with(std::string bytes, std::size_t position, const std::string& replacement) {
    return bytes.replace(position, replacement.size(), replacement);
}

/// A smooth picture, which JPEG keeps almost as it is.
std::vector<std::uint8_t> smooth_bytes(int width, int height) {
    std::vector<std::uint8_t> values;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (const int value : {40 + 5 * x, 200 - 5 * y, 90 + 2 * x + 2 * y})
                values.push_back(static_cast<std::uint8_t>(value));
    return values;
}

}  // namespace

TEST_CASE("PNG, BMP and TGA are read exactly, row 0 on top, whatever their channels", "[read_image]") {
    for (int channels = 1; channels <= 4; ++channels) {
        CAPTURE(channels);
        const std::vector<std::uint8_t> values = some_bytes(kWidth, kHeight, channels);
        const std::vector<std::uint8_t> expected = rgb_of(values, channels);
        std::vector<Image> images{read(png_bytes(kWidth, kHeight, channels, values)),
                                  read(tga_bytes(kWidth, kHeight, channels, values, false), "a.tga"),
                                  read(tga_bytes(kWidth, kHeight, channels, values, true), "b.TGA")};
        if (channels >= 3) images.push_back(read(bmp_bytes(kWidth, kHeight, channels, values)));
        for (const Image& image : images) {
            CAPTURE(image.file);
            check_size(image);
            CHECK(image.bytes == expected);
            CHECK(image.floats.empty());
        }
    }
}

TEST_CASE("of 16 bits the upper 8 are kept, and a palette is looked up", "[read_image]") {
    const std::string row{0, 0x12, 0x34, char(0xff), 0, 1, 2, char(0xab), char(0xcd), 0, 0, 0x7f, char(0xff)};
    const Image deep = read(stored_png_bytes(2, 1, 16, 2, row));
    check_size(deep, 2, 1);
    CHECK(deep.bytes == std::vector<std::uint8_t>{0x12, 0xff, 1, 0xab, 0, 0x7f});

    const Image coloured =
        read(stored_png_bytes(9, 1, 1, 3, {0, char(0b10100000), char(0b10000000)}, {1, 2, 3, 4, 5, 6}));
    check_size(coloured, 9, 1);
    std::vector<std::uint8_t> expected;
    for (const int bit : {1, 0, 1, 0, 0, 0, 0, 0, 1})
        for (const int c : {0, 1, 2}) expected.push_back(static_cast<std::uint8_t>(1 + c + 3 * bit));
    CHECK(coloured.bytes == expected);
}

TEST_CASE("JPEG is read to its rounding", "[read_image]") {
    constexpr int kEdge = 24;
    const std::vector<std::uint8_t> values = smooth_bytes(kEdge, kEdge);
    const Image image = read(jpeg_bytes(kEdge, kEdge, 3, values));
    check_size(image, kEdge, kEdge);
    REQUIRE(image.bytes.size() == values.size());
    int worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i) worst = std::max(worst, std::abs(int{image.bytes[i]} - values[i]));
    CHECK(worst <= 3);
}

TEST_CASE("JPEG of half the resolution for colours is read to the bits of the usual library", "[read_image]") {
    // 19x13 texels with noise, and the checksum of what libjpeg-turbo 2.1 makes of them by default.
    constexpr const char* kHex =
        "ffd8ffe000104a46494600010100000100010000ffdb00430006040506050406060506070706080a100a0a09090a140e0f0c10171418"
        "18171416161a1d251f1a1b231c1616202c20232627292a29191f2d302d283025282928ffdb0043010707070a080a130a0a13281a161a"
        "2828282828282828282828282828282828282828282828282828282828282828282828282828282828282828282828282828ffc00011"
        "08000d001303012200021101031101ffc400160001010100000000000000000000000000060700ffc400241000010205040203000000"
        "0000000000000102110003040531061221812291a1b1d1ffc400160101010100000000000000000000000000050407ffc40020110001"
        "03020700000000000000000000000100021106a103040514212241ffda000c03010002110311003f0091db34a295b772545092ee7827"
        "8c13df0df8618da34b19a9da81b94c3c4bb8047c1ef10fed368a515024aa5a4909092a019c312dee1a59ac54ab3b80090c7090ecf87e"
        "86624c0ce9e119a0d50e112a794ba55a9e58599a9537204bc468b7d2d9a967534b98b4f9292096240fb8d08ef0fb365a236a77c0eb60"
        "bfffd9";
    std::string bytes;
    for (const char* at = kHex; *at != '\0'; at += 2)
        bytes += static_cast<char>(std::stoi(std::string(at, 2), nullptr, 16));
    const Image image = read(bytes);
    check_size(image, 19, 13);
    std::uint64_t checksum = 0xcbf29ce484222325u;  // FNV-1a
    for (const std::uint8_t value : image.bytes) checksum = (checksum ^ value) * 0x100000001b3u;
    CHECK(checksum == 0x135b1a0dfa658e42u);
}

TEST_CASE("HDR becomes linear floats, to its eight bits", "[read_image]") {
    std::vector<float> values;
    for (int i = 0; i < kWidth * kHeight * 3; ++i) values.push_back(std::ldexp(1.0f + 0.25f * float(i % 4), i % 3));
    const Image image = read(hdr_bytes(kWidth, kHeight, values));
    check_size(image);
    CHECK(image.bytes.empty());
    CHECK(image.floats == values);  // these need fewer bits than a shared exponent leaves
}

TEST_CASE("EXR is read exactly in every compression, with R, G and B found by their names", "[read_image]") {
    const std::vector<float> abgr = [] {
        std::vector<float> values;
        for (int i = 0; i < kWidth * kHeight; ++i)
            values.insert(values.end(), {0.5f, -1.0f - float(i), 2.0f * float(i), 1024.0f + float(i)});
        return values;
    }();
    std::vector<float> expected;
    for (std::size_t i = 0; i < abgr.size(); i += 4)
        expected.insert(expected.end(), {abgr[i + 3], abgr[i + 2], abgr[i + 1]});
    for (int compression = TINYEXR_COMPRESSIONTYPE_NONE; compression <= TINYEXR_COMPRESSIONTYPE_PIZ; ++compression)
        for (const int type : {TINYEXR_PIXELTYPE_HALF, TINYEXR_PIXELTYPE_FLOAT}) {
            CAPTURE(compression, type);
            const Image image = read(exr_bytes(kWidth, kHeight, {"A", "B", "G", "R"}, abgr, compression, type));
            check_size(image);
            CHECK(image.floats == expected);
        }
    const std::vector<float> grey(expected.begin(), expected.begin() + kWidth * kHeight);
    for (const char* name : {"Y", "depth"}) {
        const Image image = read(exr_bytes(kWidth, kHeight, {name}, grey, 0, TINYEXR_PIXELTYPE_FLOAT));
        CHECK(image.floats == rgb_of(grey, 1));
    }
    CHECK(message_of(exr_bytes(kWidth, kHeight, {"U", "V"}, std::vector<float>(kWidth * kHeight * 2), 0,
                               TINYEXR_PIXELTYPE_FLOAT))
              .find("has the channels \"U\", \"V\", expected floats R, G and B") != std::string::npos);
}

TEST_CASE("values that are not finite are refused with their place", "[read_image]") {
    for (const float value : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
        std::vector<float> values(kWidth * kHeight * 3, 1.0f);
        values[3 * (2 * kWidth + 7) + 1] = value;
        const std::string message = message_of(exr_bytes(kWidth, kHeight, {"B", "G", "R"}, values, 0, 2));
        CHECK(message.find("the texel in column 7, row 2 has the value") != std::string::npos);
    }
}

TEST_CASE("a picture that ends too early is refused wherever it ends", "[read_image]") {
    const std::vector<std::uint8_t> values = some_bytes(kWidth, kHeight, 3);
    const std::vector<float> floats(kWidth * kHeight * 3, 0.75f);
    const std::vector<std::pair<std::string, std::string>> pictures{
        {"a.png", png_bytes(kWidth, kHeight, 3, values)},
        {"a.jpg", jpeg_bytes(kWidth, kHeight, 3, values)},
        {"a.bmp", bmp_bytes(kWidth, kHeight, 3, values)},
        {"plain.tga", tga_bytes(kWidth, kHeight, 3, values, false)},
        {"runs.tga", tga_bytes(kWidth, kHeight, 3, values, true)},
        {"a.hdr", hdr_bytes(kWidth, kHeight, floats)},
        {"plain.exr", exr_bytes(kWidth, kHeight, {"B", "G", "R"}, floats, TINYEXR_COMPRESSIONTYPE_NONE, 2)},
        {"zip.exr", exr_bytes(kWidth, kHeight, {"B", "G", "R"}, floats, TINYEXR_COMPRESSIONTYPE_ZIP, 2)},
    };
    for (const auto& [name, bytes] : pictures) {
        REQUIRE_NOTHROW(read(bytes, name));
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            // BMP rounds its rows up to four bytes, and nobody needs the last of these.
            if (name == "a.bmp" && size + 1 >= bytes.size()) continue;
            CAPTURE(name, size, bytes.size());
            REQUIRE_THROWS_AS(read(bytes.substr(0, size), name), SceneError);
        }
        const std::string message = message_of(bytes.substr(0, bytes.size() - 4), name);
        CAPTURE(name, message);
        CHECK(message.find("ends before its picture does") != std::string::npos);
    }
    CHECK(message_of("") == "the file is empty, expected a picture");
}

TEST_CASE("what is no picture is refused with its first bytes", "[read_image]") {
    CHECK(message_of("<html>") ==
          "a picture in PNG, JPEG, WebP, BMP, HDR, EXR or TGA (named .tga) was expected, but the file begins with 3c "
          "68 74 6d");
    CHECK(message_of("GIF89a").find("begins with 47 49 46 38") != std::string::npos);
    CHECK(message_of("x").find("begins with 78") != std::string::npos);
    CHECK(message_of("no picture at all, whatever its name", "a.tga").find("begins with 6e 6f 20 70") !=
          std::string::npos);
    CHECK_THAT(message_of(std::string(40, '\0'), "a.tga"), Catch::StartsWith("the header of the TGA file is broken: "));
    CHECK_THROWS_AS(read_image(folder().path() / "missing.png"), SceneError);
    CHECK_THROWS_AS(read_image(folder().path()), SceneError);
}

TEST_CASE("a damaged PNG is refused", "[read_image]") {
    const std::string bytes = png_bytes(kWidth, kHeight, 3, some_bytes(kWidth, kHeight, 3));
    for (std::size_t i = 8; i < bytes.size(); ++i) {
        std::string damaged = bytes;
        damaged[i] = static_cast<char>(damaged[i] ^ 4);
        CAPTURE(i);
        CHECK_THROWS_AS(read(damaged), SceneError);
    }
    CHECK(message_of(with(bytes, 50, "x")) == "the PNG file is broken: the checksum of the chunk at byte 33 is wrong");
}

TEST_CASE("a JPEG with too large a Huffman table is refused", "[read_image]") {
    std::string bytes = jpeg_bytes(kWidth, kHeight, 3, some_bytes(kWidth, kHeight, 3));
    const std::size_t table = bytes.find("\xff\xc4");
    REQUIRE(table != std::string::npos);
    constexpr std::size_t kCountOfOneBit = 5, kCountOfTwoBits = 6;
    bytes[table + kCountOfOneBit] = bytes[table + kCountOfTwoBits] = '\xff';
    const std::string message = message_of(bytes);
    CAPTURE(message);
    CHECK(message.find("the JPEG file is broken: a Huffman table has 5") == 0);
}

TEST_CASE("a JPEG whose scan ends within a number is read or refused, each time alike", "[read_image]") {
    // Stripes have large coefficients: long codes and then many bits. Where a marker comes between, stb_image shifts by
    // the bits that are missing, which may be 32.
    constexpr int kEdge = 16;
    constexpr unsigned kStripes = 0x5A6D;
    std::vector<std::uint8_t> values;
    for (int i = 0; i < kEdge * kEdge; ++i) values.insert(values.end(), 3, kStripes >> i % kEdge & 1 ? 255 : 0);
    const std::string bytes = jpeg_bytes(kEdge, kEdge, 3, values);
    const std::size_t scan = bytes.rfind("\xff\xda");
    REQUIRE(scan != std::string::npos);
    constexpr std::size_t kHeaderOfScan = 14;
    const auto outcome = [](const std::string& broken) -> std::string {
        try {
            const Image image = read(broken);
            check_size(image, kEdge, kEdge);
            return {image.bytes.begin(), image.bytes.end()};
        } catch (const SceneError& error) {
            return error.reason();
        }
    };
    for (std::size_t size = scan + kHeaderOfScan; size < bytes.size(); ++size) {
        CAPTURE(size, bytes.size());
        const std::string broken = bytes.substr(0, size) + "\xff\xd9";
        CHECK(outcome(broken) == outcome(broken));
    }
}

TEST_CASE("huge sizes in small files are refused before memory is asked for", "[read_image]") {
    const std::string row(10, '\0');
    CHECK(message_of(stored_png_bytes(20000, 20000, 8, 0, row)) ==
          "the picture has 20000x20000 texels, and at most 134217728 in all are supported");
    CHECK(message_of(stored_png_bytes(10000, 10000, 8, 0, row))
              .find("the header says 10000x10000 texels, but a file of ") == 0);
    CHECK(message_of(stored_png_bytes(0, 4, 8, 0, row)) == "the picture has 0x4 texels, expected some");
    CHECK_THAT(message_of(stored_png_bytes(60000, 60000, 8, 0, row)),
               Catch::StartsWith("the picture has 60000x60000 texels, and"));
    const std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8000 +X 8000\n";
    CHECK(message_of(hdr).find("the header says 8000x8000 texels, but a file of 51 bytes has at most 6477") == 0);

    const std::string exr = exr_bytes(4, 4, {"B", "G", "R"}, std::vector<float>(48), 0, 2);
    const std::size_t window = exr.find("dataWindow") + std::strlen("dataWindow") + 1 + std::strlen("box2i") + 1 + 4;
    CHECK(message_of(with(exr, window + 8, "\xff\x0f\x00")).find("the header says 4096x4 texels, but") ==
          std::string::npos);
    CHECK(message_of(with(exr, window + 8, "\xff\xff\xff\x7f")).find("2147483648x4 texels, and at most 134217728") !=
          std::string::npos);
    CHECK(message_of(with(exr, window + 8, "\xff\xff\x0f")).find("the header says 1048576x4 texels, but") == 0);
}

TEST_CASE("an EXR file that tinyexr does not read says why", "[read_image]") {
    const std::string exr = exr_bytes(4, 4, {"B", "G", "R"}, std::vector<float>(48), 0, 2);
    CHECK(message_of(with(exr, 5, "\x02")) ==
          "the EXR file is tiled, deep or has several parts; expected one picture in lines");
    CHECK(message_of(with(exr, 4, "\x03")) == "the EXR file has version 3, expected 2");
    const std::size_t compression = exr.find("compression") + 2 * (std::strlen("compression") + 1) + 4;
    CHECK(message_of(with(exr, compression, "\x09")).find("is compressed by method 9") != std::string::npos);
    const std::size_t table = exr.size() - 4 * (4 * 12 + 8) - 4 * 8;
    CHECK(message_of(with(exr, table, std::string(8, '\0'))) == "the EXR file is broken: a chunk of lines is missing");
    CHECK(message_of(with(exr, table, exr.substr(table + 8, 8))).find("chunk 2 of lines begins with line 1 of 4") !=
          std::string::npos);
}

}  // namespace castor::test
