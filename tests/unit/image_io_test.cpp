#include "castor/image_io.h"

#include <sys/resource.h>
#include <tinyexr.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <sstream>

#include "base/atomic_file.h"
#include "castor/error.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "support/temporary_directory.h"

#define STB_IMAGE_STATIC
#define STBIDEF [[maybe_unused]] static
#define STB_IMAGE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wshadow"
#include <stb_image.h>
#pragma GCC diagnostic pop

using namespace castor;
using castor::test::TemporaryDirectory;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Film make_film(std::uint32_t width, std::uint32_t height, std::uint64_t seed = 1) {
    castor::test::RandomSource random(seed);
    Film film;
    film.width = width;
    film.height = height;
    film.samples_per_pixel = 1;
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) film.pixels.push_back(random.in_box(-20.0f, 300.0f));
    film.done.assign(film.pixels.size(), 1);
    return film;
}

Film film_of(const std::vector<float>& reds) {
    Film film;
    film.width = static_cast<std::uint32_t>(reds.size());
    film.height = 1;
    for (const float red : reds) film.pixels.push_back({red, 0.0f, 255.0f});
    film.done.assign(reds.size(), 1);
    return film;
}

std::string contents(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(input), {}};
}

std::vector<int> read_ppm(const std::filesystem::path& file, int& width, int& height) {
    std::istringstream input(contents(file));
    std::string magic;
    int largest = 0;
    input >> magic >> width >> height >> largest;
    REQUIRE(magic == "P3");
    REQUIRE(largest == 255);
    return {std::istream_iterator<int>(input), {}};
}

std::vector<int> reds_of_ppm(const Film& film, Quantization quantization) {
    const TemporaryDirectory folder;
    const auto file = folder.path() / "a.ppm";
    write_image(file, film, {quantization});
    int width = 0, height = 0;
    const std::vector<int> values = read_ppm(file, width, height);
    std::vector<int> reds;
    for (std::size_t i = 0; i < values.size(); i += 3) reds.push_back(values[i]);
    return reds;
}

struct Pfm {
    std::string magic;
    int width = 0, height = 0;
    double scale = 0.0;
    std::vector<float> values;  // row 0 on top
};

Pfm read_pfm(const std::filesystem::path& file) {
    const std::string text = contents(file);
    std::istringstream input(text);
    Pfm pfm;
    input >> pfm.magic >> pfm.width >> pfm.height >> pfm.scale;
    input.get();  // the one white space that ends the header
    const std::size_t header = static_cast<std::size_t>(input.tellg());
    const std::size_t row = static_cast<std::size_t>(pfm.width) * (pfm.magic == "PF" ? 3 : 1);
    REQUIRE(text.size() == header + row * pfm.height * 4);
    pfm.values.resize(row * pfm.height);
    for (int y = 0; y < pfm.height; ++y)
        std::memcpy(&pfm.values[(pfm.height - 1 - y) * row], text.data() + header + y * row * 4, row * 4);
    return pfm;
}

struct Exr {
    int width = 0, height = 0;
    std::vector<std::string> channels;
    std::vector<int> types;
    std::vector<std::vector<std::uint32_t>> bits;  // a channel each
};

Exr read_exr(const std::filesystem::path& file) {
    EXRVersion version;
    REQUIRE(ParseEXRVersionFromFile(&version, file.c_str()) == TINYEXR_SUCCESS);
    EXRHeader header;
    InitEXRHeader(&header);
    const char* message = nullptr;
    REQUIRE(ParseEXRHeaderFromFile(&header, &version, file.c_str(), &message) == TINYEXR_SUCCESS);
    EXRImage image;
    InitEXRImage(&image);
    REQUIRE(LoadEXRImageFromFile(&image, &header, file.c_str(), &message) == TINYEXR_SUCCESS);
    Exr exr{image.width, image.height, {}, {}, {}};
    for (int i = 0; i < image.num_channels; ++i) {
        exr.channels.emplace_back(header.channels[i].name);
        exr.types.push_back(header.pixel_types[i]);
        const auto* values = reinterpret_cast<const std::uint32_t*>(image.images[i]);
        exr.bits.emplace_back(values, values + static_cast<std::size_t>(image.width) * image.height);
    }
    FreeEXRImage(&image);
    FreeEXRHeader(&header);
    return exr;
}

std::size_t entry_count(const std::filesystem::path& folder) {
    return std::distance(std::filesystem::directory_iterator(folder), {});
}

std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing was thrown";
}

/// Root may write anywhere, so tests of permissions act as somebody else for a while.
class AsNobody {
public:
    AsNobody() {
        if (::geteuid() == 0) changed_ = ::seteuid(65534) == 0;
    }
    ~AsNobody() {
        if (changed_ && ::seteuid(0) != 0) std::abort();
    }

private:
    bool changed_ = false;
};

/// Files cannot grow beyond `bytes`, as on a full disk.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        rlimit limit = before_;
        limit.rlim_cur = bytes;
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    void (*handler_)(int);
    rlimit before_{};
};

}  // namespace

TEST_CASE("quantisation rounds or truncates, limits, and makes NaN black", "[image_io]") {
    const std::vector<float> values = {0.0f,   -0.0f,  -1.0f,  -kInfinity, kNan,  kInfinity, 1e30f,       254.49f,
                                       254.5f, 254.9f, 255.0f, 255.4f,     0.5f,  1.5f,      0.49999997f, 126.5f,
                                       127.5f, 2.999f, 1e-40f, 256.0f,     0.51f, 1.0f,      127.499992f, 254.99998f};
    const std::vector<int> rounded = {0, 0, 0, 0,   0,   255, 255, 254, 255, 255, 255, 255,
                                      1, 2, 0, 127, 128, 3,   0,   255, 1,   1,   127, 255};
    const std::vector<int> truncated = {0, 0, 0, 0,   0,   255, 255, 254, 254, 254, 255, 255,
                                        0, 1, 0, 126, 127, 2,   0,   255, 0,   1,   127, 254};
    CHECK(reds_of_ppm(film_of(values), Quantization::round) == rounded);
    CHECK(reds_of_ppm(film_of(values), Quantization::truncate) == truncated);
}

TEST_CASE("a PNG and a PPM hold the quantised pixels, row 0 on top", "[image_io]") {
    const TemporaryDirectory folder;
    const Film film = make_film(37, 11);
    write_image(folder.path() / "a.png", film);
    write_image(folder.path() / "a.PPM", film);
    int width = 0, height = 0, channels = 0;
    unsigned char* png = stbi_load((folder.path() / "a.png").c_str(), &width, &height, &channels, 0);
    REQUIRE(png != nullptr);
    CHECK(width == 37);
    CHECK(height == 11);
    REQUIRE(channels == 3);
    int ppm_width = 0, ppm_height = 0;
    const std::vector<int> ppm = read_ppm(folder.path() / "a.PPM", ppm_width, ppm_height);
    CHECK(ppm_width == 37);
    CHECK(ppm_height == 11);
    std::vector<int> expected;
    for (const glm::vec3& pixel : film.pixels)
        for (int c = 0; c < 3; ++c)
            expected.push_back(static_cast<int>(std::floor(std::clamp(pixel[c], 0.0f, 255.0f) + 0.5)));
    CHECK(ppm == expected);
    CHECK(std::vector<int>(png, png + 37 * 11 * 3) == expected);
    stbi_image_free(png);
    std::istringstream lines(contents(folder.path() / "a.PPM"));
    for (std::string line; std::getline(lines, line);) CHECK(line.size() <= 70);
}

TEST_CASE("PFM and EXR hold every bit of the film, row 0 on top", "[image_io]") {
    const TemporaryDirectory folder;
    Film film = make_film(19, 23);
    film.pixels[0] = {kInfinity, -kInfinity, -0.0f};
    film.pixels[1] = {1e-42f, 3e38f, 1e6f};
    write_image(folder.path() / "a.pfm", film);
    write_image(folder.path() / "a.exr", film);
    const Pfm pfm = read_pfm(folder.path() / "a.pfm");
    CHECK(pfm.magic == "PF");
    CHECK(pfm.width == 19);
    CHECK(pfm.height == 23);
    CHECK(pfm.scale == -1.0);
    const Exr exr = read_exr(folder.path() / "a.exr");
    CHECK(exr.width == 19);
    CHECK(exr.height == 23);
    REQUIRE(exr.channels == std::vector<std::string>{"B", "G", "R"});
    CHECK(exr.types == std::vector<int>(3, TINYEXR_PIXELTYPE_FLOAT));
    CHECK(std::memcmp(pfm.values.data(), film.pixels.data(), pfm.values.size() * 4) == 0);
    for (std::size_t i = 0; i < film.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            CAPTURE(i, c);
            REQUIRE(exr.bits[2 - c][i] == std::bit_cast<std::uint32_t>(film.pixels[i][c]));
        }
}

TEST_CASE("HDR holds the pixels to its eight bits, and limits what it cannot say", "[image_io]") {
    const TemporaryDirectory folder;
    Film film = make_film(16, 9);
    film.pixels[0] = {kNan, 5.0f, -3.0f};
    film.pixels[1] = {kInfinity, 1.0f, 0.0f};
    film.pixels[2] = {3e38f, 3e38f, 3e38f};
    write_image(folder.path() / "a.hdr", film);
    int width = 0, height = 0, channels = 0;
    float* values = stbi_loadf((folder.path() / "a.hdr").c_str(), &width, &height, &channels, 3);
    REQUIRE(values != nullptr);
    CHECK(width == 16);
    CHECK(height == 9);
    CHECK(values[0] == 0.0f);
    CHECK(values[1] == Approx(5.0f).epsilon(0.01));
    CHECK(values[2] == 0.0f);
    CHECK(values[3] > 1e38f);
    CHECK(values[6] > 1e38f);
    for (std::size_t i = 3; i < film.pixels.size(); ++i) {
        const glm::vec3 pixel = glm::max(film.pixels[i], glm::vec3(0.0f));
        const float largest = std::max({pixel.x, pixel.y, pixel.z});
        for (int c = 0; c < 3; ++c) {
            CAPTURE(i, c, pixel[c], largest);
            // The largest component has at least 7 bits, and the others share its exponent.
            REQUIRE(std::abs(values[3 * i + c] - pixel[c]) <= largest / 128);
        }
    }
    stbi_image_free(values);
}

TEST_CASE("planes are written with their channels, floats as floats and integers as integers", "[image_io]") {
    const TemporaryDirectory folder;
    const Film film = make_film(5, 3);
    FilmPlane normal{"normal", {"X", "Y", "Z"}, {}, {}};
    for (int i = 0; i < 45; ++i) normal.values.push_back(0.25f * static_cast<float>(i) - 3.0f);
    FilmPlane primitive{"primitive", {"primitive"}, {}, {}};
    for (std::uint32_t i = 0; i < 15; ++i) primitive.indices.push_back(i * 0x01234567u);
    primitive.indices[7] = 0xffffffffu;

    write_plane(folder.path() / "normal.exr", film, normal);
    const Exr exr = read_exr(folder.path() / "normal.exr");
    CHECK(exr.channels == normal.channels);
    for (int i = 0; i < 45; ++i) REQUIRE(exr.bits[i % 3][i / 3] == std::bit_cast<std::uint32_t>(normal.values[i]));
    write_plane(folder.path() / "normal.pfm", film, normal);
    CHECK(read_pfm(folder.path() / "normal.pfm").values == normal.values);

    write_plane(folder.path() / "primitive.exr", film, primitive);
    const Exr indices = read_exr(folder.path() / "primitive.exr");
    CHECK(indices.types == std::vector<int>{TINYEXR_PIXELTYPE_UINT});
    CHECK(indices.bits.at(0) == primitive.indices);

    // 2^24 + 1 is the first integer that a float cannot hold.
    CHECK_THROWS_AS(write_plane(folder.path() / "primitive.pfm", film, primitive), UsageError);
    primitive.indices.assign(15, 1u << 24);
    write_plane(folder.path() / "primitive.pfm", film, primitive);
    CHECK(read_pfm(folder.path() / "primitive.pfm").magic == "Pf");
    CHECK(read_pfm(folder.path() / "primitive.pfm").values == std::vector<float>(15, 16777216.0f));
    primitive.indices[14] = (1u << 24) + 1;
    CHECK_THROWS_AS(write_plane(folder.path() / "primitive.pfm", film, primitive), UsageError);
}

TEST_CASE("a picture and its planes are layers of one file", "[image_io]") {
    const TemporaryDirectory folder;
    Film film = make_film(5, 3);
    FilmPlane normal{"normal", {"X", "Y", "Z"}, {}, {}}, primitive{"primitive", {"primitive"}, {}, {}};
    for (int i = 0; i < 45; ++i) normal.values.push_back(0.25f * static_cast<float>(i) - 3.0f);
    for (std::uint32_t i = 0; i < 15; ++i) primitive.indices.push_back(i * 0x11234567u);
    film.planes = {primitive, normal, {"depth", {"Z"}, std::vector<float>(15, kInfinity), {}}};
    const auto file = folder.path() / "all.exr";
    write_layers(file, film);
    const Exr exr = read_exr(file);
    const std::vector<std::string> names = {"B", "G", "R", "depth.Z", "normal.X", "normal.Y", "normal.Z", "primitive"};
    CHECK(exr.channels == names);
    REQUIRE(exr.bits.size() == names.size());
    for (int i = 0; i < 15; ++i) {
        CAPTURE(i);
        for (int c = 0; c < 3; ++c) {
            REQUIRE(exr.bits[2 - c][i] == std::bit_cast<std::uint32_t>(film.pixels[i][c]));
            REQUIRE(exr.bits[4 + c][i] == std::bit_cast<std::uint32_t>(normal.values[3 * i + c]));
        }
        REQUIRE(exr.bits[3][i] == std::bit_cast<std::uint32_t>(kInfinity));
        REQUIRE(exr.bits[7][i] == primitive.indices[i]);
        REQUIRE(exr.types[7] == TINYEXR_PIXELTYPE_UINT);
    }
    // The picture is what programs that know no layers read.
    CHECK(read_image(file).floats.size() == 45);

    CHECK_THROWS_AS(write_layers(folder.path() / "all.png", film), UsageError);
    CHECK_THROWS_AS(check_layers_extension("all.pfm"), UsageError);
    CHECK_NOTHROW(check_layers_extension("all.EXR"));
    film.planes.push_back(normal);
    CHECK(message_of([&] { write_layers(file, film); }).find("two channels have the name \"normal.X\"") !=
          std::string::npos);
    film.planes = {{"normal", {"X"}, std::vector<float>(14), {}}};
    CHECK_THROWS_AS(write_layers(file, film), UsageError);
    CHECK(entry_count(folder.path()) == 1);
}

TEST_CASE("what cannot be a picture or a plane is refused", "[image_io]") {
    const TemporaryDirectory folder;
    Film film = make_film(4, 4);
    for (const char* name : {"a", "a.jpg", "a.png.", ".png", "a.exr2"}) {
        CAPTURE(name);
        CHECK_THROWS_AS(check_image_extension(name), UsageError);
        CHECK_THROWS_AS(write_image(folder.path() / name, film), UsageError);
    }
    for (const char* name : {"a.png", "a.PNG", "a.ppm", "a.pfm", "a.hdr", "b/a.exr"})
        CHECK_NOTHROW(check_image_extension(name));
    CHECK(message_of([] { check_image_extension("a.jpg"); }).find(".png, .ppm, .pfm, .hdr and .exr") !=
          std::string::npos);

    FilmPlane two{"barycentric", {"U", "V"}, std::vector<float>(32), {}};
    CHECK_THROWS_AS(write_plane(folder.path() / "a.pfm", film, two), UsageError);
    CHECK_THROWS_AS(write_plane(folder.path() / "a.png", film, two), UsageError);
    two.values.pop_back();
    CHECK_THROWS_AS(write_plane(folder.path() / "a.exr", film, two), UsageError);
    film.pixels.pop_back();
    CHECK_THROWS_AS(write_image(folder.path() / "a.png", film), UsageError);
    CHECK_THROWS_AS(write_image(folder.path() / "a.png", Film{}), UsageError);
    CHECK(entry_count(folder.path()) == 0);
}

TEST_CASE("a film is complete when every pixel is done", "[image_io]") {
    Film film = make_film(3, 2);
    CHECK(film.complete());
    film.done[5] = 0;
    CHECK_FALSE(film.complete());
    film.done.clear();
    CHECK_FALSE(film.complete());
    CHECK(Film{}.complete());
}

TEST_CASE("a failed write keeps the old file and leaves nothing behind", "[image_io]") {
    const TemporaryDirectory folder;
    const auto file = folder.write("a.pfm", "precious");
    {
        const FileSizeLimit limit(1000);
        const std::string message = message_of([&] { write_image(file, make_film(64, 64)); });
        CAPTURE(message);
        CHECK(message.find(file.string()) == 0);
        CHECK(message.find("File too large") != std::string::npos);
        CHECK_THROWS_AS(write_image(file, make_film(64, 64)), FileError);
    }
    CHECK(contents(file) == "precious");
    CHECK(entry_count(folder.path()) == 1);
    write_image(file, make_film(64, 64));
    CHECK(read_pfm(file).width == 64);
    CHECK(entry_count(folder.path()) == 1);
}

TEST_CASE("places that cannot be written are named with the reason", "[image_io]") {
    const TemporaryDirectory folder;
    const auto plain = folder.write("plain", "");
    std::filesystem::create_directory(folder.path() / "folder.png");
    const Film film = make_film(8, 8);
    const auto expect = [&](const std::filesystem::path& file, const std::string& reason) {
        for (const std::string& message :
             {message_of([&] { check_writable(file); }), message_of([&] { write_image(file, film); })}) {
            CAPTURE(message);
            CHECK(message.find(file.string() + ": ") == 0);
            CHECK(message.find(reason) != std::string::npos);
        }
    };
    expect(folder.path() / "missing" / "a.png", "No such file or directory");
    expect(plain / "a.png", "Not a directory");
    expect(folder.path() / "folder.png", "Is a directory");
    expect(folder.path() / (std::string(300, 'x') + ".png"), "File name too long");

    const auto read_only = folder.write("read_only.png", "kept");
    std::filesystem::permissions(read_only, std::filesystem::perms(0444));
    std::filesystem::permissions(folder.path(), std::filesystem::perms(0777));
    std::filesystem::create_directory(folder.path() / "closed");
    std::filesystem::permissions(folder.path() / "closed", std::filesystem::perms(0555));
    {
        const AsNobody nobody;
        expect(read_only, "Permission denied");
        expect(folder.path() / "closed" / "a.png", "Permission denied");
    }
    CHECK(contents(read_only) == "kept");
    CHECK(entry_count(folder.path()) == 4);
    CHECK(entry_count(folder.path() / "closed") == 0);
}

TEST_CASE("a full device is an error, and links and modes are kept", "[image_io]") {
    const TemporaryDirectory folder;
    if (std::filesystem::exists("/dev/full")) {
        std::filesystem::create_symlink("/dev/full", folder.path() / "full.png");
        const std::string message = message_of([&] { write_image(folder.path() / "full.png", make_film(8, 8)); });
        CAPTURE(message);
        CHECK(message.find("No space left on device") != std::string::npos);
        CHECK(std::filesystem::is_character_file("/dev/full"));
    } else {
        std::cerr << "skipped: there is no /dev/full\n";
    }
    const auto file = folder.write("a.ppm", "old");
    std::filesystem::permissions(file, std::filesystem::perms(0640));
    std::filesystem::create_symlink(file, folder.path() / "link.ppm");
    write_image(folder.path() / "link.ppm", make_film(2, 2));
    CHECK(std::filesystem::is_symlink(folder.path() / "link.ppm"));
    CHECK(contents(file).substr(0, 2) == "P3");
    CHECK(std::filesystem::status(file).permissions() == std::filesystem::perms(0640));
}
