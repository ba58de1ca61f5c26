// Pictures of the course's own renderer, where they are at hand: Castor's must match them as closely as rounding
// allows.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wshadow"
#include <stb_image.h>
#pragma GCC diagnostic pop

#include "castor/image_io.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/shared_folder.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> bytes;  // 3 a pixel
};

Picture read_png(const std::filesystem::path& file) {
    Picture picture;
    int channels = 0;
    const std::unique_ptr<stbi_uc, void (*)(void*)> data(
        stbi_load(file.c_str(), &picture.width, &picture.height, &channels, 3), stbi_image_free);
    INFO(file.string());
    REQUIRE(data);
    picture.bytes.assign(data.get(), data.get() + std::size_t{3} * picture.width * picture.height);
    return picture;
}

struct Difference {
    std::size_t pixels = 0;
    std::size_t off_by_one = 0;   // by 1 of 255 in some channel, by more in none
    std::size_t off_by_more = 0;  // in some channel
    int largest = 0;
    Film film;  // of the differences
};

Difference compare(const Picture& a, const Picture& b) {
    Difference difference;
    difference.pixels = a.bytes.size() / 3;
    difference.film.width = a.width;
    difference.film.height = a.height;
    difference.film.pixels.resize(difference.pixels);
    for (std::size_t i = 0; i < difference.pixels; ++i) {
        int worst = 0;
        for (int channel = 0; channel < 3; ++channel) {
            const int apart = std::abs(int{a.bytes[3 * i + channel]} - int{b.bytes[3 * i + channel]});
            difference.film.pixels[i][channel] = static_cast<float>(apart);
            worst = std::max(worst, apart);
        }
        difference.off_by_one += worst == 1;
        difference.off_by_more += worst > 1;
        difference.largest = std::max(difference.largest, worst);
    }
    return difference;
}

/// The peak signal-to-noise ratio in dB, and how many channels of blocks of 32 x 32 pixels differ in their means by
/// more than chance and quantising explain: three standard errors and half a step.
struct Likeness {
    double decibels = 0.0;
    std::size_t biased_blocks = 0;
};

Likeness likeness(const Picture& a, const Picture& b) {
    constexpr int kEdge = 32;
    Likeness result;
    double squares = 0.0;
    for (int top = 0; top < a.height; top += kEdge) {
        for (int left = 0; left < a.width; left += kEdge) {
            for (int channel = 0; channel < 3; ++channel) {
                double sum = 0.0, sum_of_squares = 0.0, count = 0.0;
                for (int y = top; y < std::min(top + kEdge, a.height); ++y) {
                    for (int x = left; x < std::min(left + kEdge, a.width); ++x) {
                        const std::size_t i = 3 * (std::size_t(y) * a.width + x) + channel;
                        const int apart = int{a.bytes[i]} - int{b.bytes[i]};
                        sum += apart;
                        sum_of_squares += double(apart) * apart;
                        count += 1.0;
                    }
                }
                squares += sum_of_squares;
                const double mean = sum / count;
                const double error = std::sqrt(std::max(0.0, sum_of_squares / count - mean * mean) / count);
                result.biased_blocks += std::abs(mean) > 3 * error + 0.5;
            }
        }
    }
    result.decibels = 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.bytes.size()) / squares);
    return result;
}

/// Leaves picture, reference and difference where a person can look at them, and says where.
void keep_pictures(const std::string& name, const std::filesystem::path& picture,
                   const std::filesystem::path& reference, const Film& difference) {
    const std::filesystem::path folder = std::filesystem::temp_directory_path() / "castor-reference-failures";
    std::filesystem::create_directories(folder);
    const auto overwrite = std::filesystem::copy_options::overwrite_existing;
    std::filesystem::copy_file(picture, folder / (name + ".png"), overwrite);
    std::filesystem::copy_file(reference, folder / (name + "-reference.png"), overwrite);
    write_image(folder / (name + "-difference.png"), difference);
    std::printf("%s: picture, reference and difference are in %s\n", name.c_str(), folder.c_str());
}

}  // namespace

TEST_CASE("the reference pictures are matched", "[reference]") {
    const std::filesystem::path folder = shared_folder() / "scenes" / "ceng477";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference pictures in %s\n", folder.c_str());
        return;
    }
    const TemporaryDirectory output;
    for (const std::string name : {"bunny", "simple", "simple_reflectance"}) {
        CAPTURE(name);
        const std::filesystem::path picture_file = output.path() / (name + ".png");
        const std::filesystem::path reference_file = folder / (name + ".png");
        const Scene scene = load_scene(folder / (name + ".xml"));
        write_image(picture_file, Renderer(scene, {test_device()}).render(scene.cameras.at(0)));

        const Picture picture = read_png(picture_file), reference = read_png(reference_file);
        REQUIRE(picture.width == reference.width);
        REQUIRE(picture.height == reference.height);
        const Difference difference = compare(picture, reference);
        std::printf("%s: of %zu pixels %zu are off by more than 1 of 255, %zu by 1; the largest difference is %d\n",
                    name.c_str(), difference.pixels, difference.off_by_more, difference.off_by_one, difference.largest);
        const bool matches = difference.off_by_more <= difference.pixels * 0.002;
        if (!matches) keep_pictures(name, picture_file, reference_file, difference.film);
        CHECK(matches);
    }
}

TEST_CASE("the reference picture of a scene in JSON is matched", "[reference]") {
    const std::filesystem::path folder = shared_folder() / "scenes" / "ceng795";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference pictures in %s\n", folder.c_str());
        return;
    }
    const TemporaryDirectory output;
    const std::filesystem::path picture_file = output.path() / "ellipsoids.png",
                                reference_file = folder / "ellipsoids.png";
    const Scene scene = load_scene(folder / "ellipsoids.json");
    RenderOptions options;
    options.rules = RuleSet::r795;
    write_image(picture_file, Renderer(scene, {test_device()}).render(scene.cameras.at(0), options),
                {.quantization = quantization(options.rules)});

    const Picture picture = read_png(picture_file), reference = read_png(reference_file);
    REQUIRE(picture.width == reference.width);
    REQUIRE(picture.height == reference.height);
    const Difference difference = compare(picture, reference);
    std::printf("ellipsoids: of %zu pixels %zu are off by more than 1 of 255, %zu by 1; the largest difference is %d\n",
                difference.pixels, difference.off_by_more, difference.off_by_one, difference.largest);
    // What two pixels at the edge of a shadow may differ by keeps the ratio of signal to noise above 70 dB.
    const bool matches = difference.off_by_more <= 4 && difference.off_by_one <= 100;
    if (!matches) keep_pictures("ellipsoids", picture_file, reference_file, difference.film);
    CHECK(matches);
}

TEST_CASE("reference pictures of glass, rough metal and microfacets are matched", "[reference]") {
    const std::filesystem::path folder = shared_folder() / "scenes" / "ceng795";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference pictures in %s\n", folder.c_str());
        return;
    }
    struct Wanted {
        std::string name;
        double decibels;
        std::size_t biased_blocks;  // at most
    };
    const TemporaryDirectory output;
    // The microfacets of the reference differ in a spot where both lights are grazing.
    for (const Wanted& wanted : {Wanted{"metal_glass_plates", 40.0, 0}, Wanted{"brdf_torrancesparrow", 60.0, 9}}) {
        CAPTURE(wanted.name);
        const Scene scene = load_scene(folder / (wanted.name + ".xml"));
        RenderOptions options;
        options.rules = RuleSet::r795;
        const std::filesystem::path file = output.path() / (wanted.name + ".png");
        write_image(file, Renderer(scene, {test_device()}).render(scene.cameras.at(0), options),
                    {.quantization = quantization(options.rules)});
        const Picture picture = read_png(file), reference = read_png(folder / (wanted.name + ".png"));
        REQUIRE(picture.bytes.size() == reference.bytes.size());
        const Likeness found = likeness(picture, reference);
        std::printf("%s: %.1f dB, %zu blocks are biased\n", wanted.name.c_str(), found.decibels, found.biased_blocks);
        CHECK(found.decibels >= wanted.decibels);
        CHECK(found.biased_blocks <= wanted.biased_blocks);
    }
}

/// How blocks of 32 x 32 pixels of two noisy linear pictures of one scene differ: their means, in standard errors that
/// come from the differences of the block's pixels.
struct BlockDifference {
    double mean_ratio = 0.0;   // of the pictures
    double largest = 0.0;      // standard errors
    double mean_square = 0.0;  // of them; 1 where pictures differ by noise alone
};

BlockDifference block_difference(const Film& film, const Image& reference) {
    constexpr std::uint32_t kEdge = 32;
    BlockDifference result;
    double sum = 0.0, sum_of_reference = 0.0, blocks = 0.0;
    for (std::uint32_t top = 0; top < film.height; top += kEdge) {
        for (std::uint32_t left = 0; left < film.width; left += kEdge) {
            double apart = 0.0, squares = 0.0;
            for (std::uint32_t y = top; y < top + kEdge; ++y) {
                for (std::uint32_t x = left; x < left + kEdge; ++x) {
                    const std::size_t i = std::size_t{y} * film.width + x;
                    const double ours = double{film.pixels[i].x} + film.pixels[i].y + film.pixels[i].z;
                    const double theirs =
                        double{reference.floats[3 * i]} + reference.floats[3 * i + 1] + reference.floats[3 * i + 2];
                    sum += ours;
                    sum_of_reference += theirs;
                    apart += ours - theirs;
                    squares += (ours - theirs) * (ours - theirs);
                }
            }
            constexpr double kCount = kEdge * kEdge;
            const double mean = apart / kCount;
            const double error = std::sqrt((squares / kCount - mean * mean) / kCount);
            REQUIRE(error > 0.0);
            result.largest = std::max(result.largest, std::abs(mean) / error);
            result.mean_square += (mean / error) * (mean / error);
            blocks += 1.0;
        }
    }
    result.mean_ratio = sum / sum_of_reference;
    result.mean_square /= blocks;
    return result;
}

TEST_CASE("path traced reference pictures differ by noise alone", "[reference][path]") {
    const std::filesystem::path folder = shared_folder() / "scenes" / "ceng795";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference pictures in %s\n", folder.c_str());
        return;
    }
    struct Wanted {
        std::string name;
        std::size_t camera;
        double ratio;  // of the means, at most so far from 1; ten seeds of the first are within 0.014
    };
    const Scene scene = load_scene(folder / "cornellbox_jaroslav_path_diffuse.xml");
    for (const Wanted& wanted : {Wanted{"diffuse_next", 0, 0.02}, Wanted{"diffuse", 4, 0.03}}) {
        CAPTURE(wanted.name);
        RenderOptions options;
        options.rules = RuleSet::r795;
        options.samples_per_pixel = 2;
        const Film film = Renderer(scene, {test_device()}).render(scene.cameras.at(wanted.camera), options);
        const Image reference = read_image(folder / (wanted.name + ".exr"));
        REQUIRE(film.width % 32 == 0);
        REQUIRE(film.height % 32 == 0);
        REQUIRE(reference.floats.size() == 3 * film.pixels.size());
        const BlockDifference found = block_difference(film, reference);
        std::printf("%s: ratio of means %.4f, blocks differ by at most %.2f standard errors, mean square %.3f\n",
                    wanted.name.c_str(), found.mean_ratio, found.largest, found.mean_square);
        CHECK(std::abs(found.mean_ratio - 1.0) <= wanted.ratio);
        // The noise of so few samples has long tails.
        CHECK(found.largest <= 6.0);
        CHECK(found.mean_square <= 2.5);
    }
}

/// The means of blocks of 32 x 32 pixels, all channels together, where no channel of a pixel counts more than 3.
std::vector<double> limited_blocks(const std::vector<double>& channels, std::uint32_t width, std::uint32_t height) {
    constexpr std::uint32_t kEdge = 32;
    std::vector<double> blocks(std::size_t{width / kEdge} * (height / kEdge));
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            for (std::size_t channel = 0; channel < 3; ++channel)
                blocks[std::size_t{y / kEdge} * (width / kEdge) + x / kEdge] +=
                    std::min(channels[3 * (std::size_t{y} * width + x) + channel], 3.0) / (3.0 * kEdge * kEdge);
    return blocks;
}

/// How one picture's blocks differ from those of others.
struct Scatter {
    double mean_square = 0.0;  // of standard deviations of one such picture
    std::size_t beyond = 0;    // blocks that differ by more than 5 %
    double worst = 0.0;        // relative difference
    double ratio = 0.0;        // of the sums
};

Scatter scatter_of(const std::vector<double>& one, const std::vector<std::vector<double>>& others) {
    const auto count = static_cast<double>(others.size());
    Scatter result;
    double sum = 0.0, sum_of_others = 0.0;
    for (std::size_t block = 0; block < one.size(); ++block) {
        double mean = 0.0, squares = 0.0;
        for (const std::vector<double>& other : others) mean += other[block] / count;
        for (const std::vector<double>& other : others) squares += (other[block] - mean) * (other[block] - mean);
        const double apart = one[block] - mean, variance = squares / (count - 1.0) * (1.0 + 1.0 / count);
        if (variance == 0.0 && apart == 0.0) continue;  // nothing is seen
        REQUIRE(variance > 0.0);
        // Student's t has squares of this mean.
        result.mean_square += apart * apart / variance * (count - 3.0) / (count - 1.0) / double(one.size());
        result.beyond += std::abs(apart) > 0.05 * mean;
        result.worst = std::max(result.worst, std::abs(apart) / mean);
        sum += one[block];
        sum_of_others += mean;
    }
    result.ratio = sum / sum_of_others;
    return result;
}

TEST_CASE("a path traced reference picture is like one of many of Castor's", "[.][reference_noise]") {
    // The reference's samples are independent, and limited after their mean: so are these. With next event estimation
    // it would not do, since the reference draws points of lamps otherwise, with other noise.
    constexpr std::size_t kPictures = 12;
    constexpr std::uint32_t kSamples = 100, kTogether = 2;  // one alone would go through the pixel's centre
    const std::filesystem::path folder = shared_folder() / "scenes" / "ceng795";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference pictures in %s\n", folder.c_str());
        return;
    }
    const Scene scene = load_scene(folder / "cornellbox_jaroslav_path_diffuse.xml");
    Renderer renderer(scene, {test_device()});
    const Image image = read_image(folder / "diffuse.exr");
    const std::vector<double> reference =
        limited_blocks({image.floats.begin(), image.floats.end()}, image.width, image.height);
    std::vector<std::vector<double>> pictures;
    RenderOptions options;
    options.rules = RuleSet::r795;
    options.samples_per_pixel = kTogether;
    options.filter = ReconstructionFilter::box;
    while (pictures.size() < kPictures) {
        std::vector<double> sums(image.floats.size());
        for (std::uint32_t sample = 0; sample < kSamples; sample += kTogether, ++options.seed) {
            const Film film = renderer.render(scene.cameras.at(4), options);
            REQUIRE(sums.size() == 3 * film.pixels.size());
            for (std::size_t i = 0; i < sums.size(); ++i)
                sums[i] += double{film.pixels[i / 3][static_cast<int>(i % 3)]} * kTogether / kSamples;
        }
        pictures.push_back(limited_blocks(sums, image.width, image.height));
    }
    const auto print = [&](const char* what, const Scatter& one) {
        std::printf("%s: %zu of %zu blocks beyond 5 %%, worst %.1f %%, mean square %.3f, ratio of means %.4f\n", what,
                    one.beyond, reference.size(), 100.0 * one.worst, one.mean_square, one.ratio);
    };
    const Scatter found = scatter_of(reference, pictures);
    print("the reference", found);
    Scatter most;
    double squares_of_ratio = 0.0;
    for (std::size_t i = 0; i < kPictures; ++i) {
        std::vector<std::vector<double>> others = pictures;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
        const Scatter own = scatter_of(pictures[i], others);
        print("one of Castor", own);
        most.beyond = std::max(most.beyond, own.beyond);
        most.worst = std::max(most.worst, own.worst);
        most.mean_square = std::max(most.mean_square, own.mean_square);
        squares_of_ratio += (own.ratio - 1.0) * (own.ratio - 1.0) / kPictures;
    }
    CHECK(found.beyond <= most.beyond + most.beyond / 2);
    CHECK(found.worst <= 1.5 * most.worst);
    CHECK(found.mean_square <= 1.3 * most.mean_square);
    CHECK(std::abs(found.ratio - 1.0) <= 4.0 * std::sqrt(squares_of_ratio));
}

}  // namespace castor::test
