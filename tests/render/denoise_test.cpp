// What castor::denoise promises, on films that are made here: nothing is rendered.
#include "castor/denoise.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <vector>

#include "castor/error.h"
#include "opencl/device_context.h"
#include "reference/random_source.h"
#include "render/denoise.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

namespace {

using glm::dvec3;
using glm::vec3;

constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

enum Plane { variance, albedo, normal, position };

/// A film that looks straight at a wall of this albedo, a unit before the eye.
Film wall(std::uint32_t width, std::uint32_t height, const vec3& rgb, const vec3& of_albedo, float of_variance) {
    Film film;
    film.width = width;
    film.height = height;
    film.samples_per_pixel = 16;
    const std::size_t pixels = std::size_t{width} * height;
    film.pixels.assign(pixels, rgb);
    film.done.assign(pixels, 1);
    film.planes = {{"variance", {"Y"}, std::vector<float>(pixels, of_variance), {}},
                   {"mean-albedo", {"R", "G", "B", "A"}, {}, {}},
                   {"mean-normal", {"X", "Y", "Z"}, {}, {}},
                   {"mean-position", {"X", "Y", "Z"}, {}, {}}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            auto& of_pixel = film.planes;
            of_pixel[albedo].values.insert(of_pixel[albedo].values.end(), {of_albedo.x, of_albedo.y, of_albedo.z, 1});
            of_pixel[normal].values.insert(of_pixel[normal].values.end(), {0, 0, 1});
            of_pixel[position].values.insert(of_pixel[position].values.end(),
                                             {0.01f * static_cast<float>(x), -0.01f * static_cast<float>(y), -1});
        }
    return film;
}

void set(Film& film, Plane plane, std::size_t pixel, const std::vector<float>& values) {
    const std::size_t channels = film.planes[plane].channels.size();
    std::copy(values.begin(), values.end(),
              film.planes[plane].values.begin() + static_cast<std::ptrdiff_t>(channels * pixel));
}

/// Adds noise of this standard deviation, relative to the pixels, and tells its variance.
void add_noise(Film& film, double deviation) {
    RandomSource random(11);
    for (std::size_t i = 0; i < film.pixels.size(); ++i) {
        // A sum of twelve uniform numbers is nearly normal, with variance 1.
        double normal_number = -6.0;
        for (int k = 0; k < 12; ++k) normal_number += random.uniform(0.0, 1.0);
        const vec3 pixel = film.pixels[i];
        const double grey = 0.2126 * pixel.x + 0.7152 * pixel.y + 0.0722 * pixel.z;
        film.pixels[i] = pixel * static_cast<float>(std::max(0.0, 1.0 + deviation * normal_number));
        film.planes[variance].values[i] = static_cast<float>(deviation * deviation * grey * grey);
    }
}

/// A film with all kinds of pixels: surfaces of several sorts, noise, edges, misses, NaN and infinities.
Film mixed_film(std::uint32_t width, std::uint32_t height) {
    Film film = wall(width, height, vec3(20.0f), vec3(0.5f), 1.0f);
    RandomSource random(5);
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            const std::size_t i = std::size_t{y} * width + x;
            const auto drawn = [&](float lower, float upper) {
                return static_cast<float>(random.uniform(lower, upper));
            };
            film.pixels[i] = {drawn(0, 60), drawn(0, 40), drawn(0, 20)};
            film.planes[variance].values[i] = drawn(0, 300);
            if (x * 3 > width) set(film, albedo, i, {0.9f, drawn(0, 0.3f), 0.0f, 1.0f});
            if (y * 2 > height) {
                const float angle = 0.02f * static_cast<float>(x);
                set(film, normal, i, {std::sin(angle), 0.0f, std::cos(angle)});
                set(film, position, i, {std::sin(angle), 0.02f * static_cast<float>(y), std::cos(angle)});
            }
            if (x + y < 9) {
                for (const Plane plane : {normal, position}) set(film, plane, i, {0, 0, 0});
                set(film, albedo, i, {0, 0, 0, 0});
            }
            if (i % 41 == 0) film.pixels[i].y = kNan;
            if (i % 43 == 0) film.pixels[i].x = kInfinity;
            if (i % 47 == 0) film.planes[variance].values[i] = i % 2 ? kNan : kInfinity;
            if (i % 53 == 0) film.planes[variance].values[i] = 0.0f;
        }
    return film;
}

bool same_pixels(const Film& a, const Film& b) {
    return a.pixels.size() == b.pixels.size() &&
           std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec3)) == 0;
}

Film denoised(Film film) {
    denoise(film, {test_device()});
    return film;
}

// The filter again, in double precision and as the papers write it, each pixel for itself.

struct ReferencePixel {
    dvec3 light{}, surface_albedo{}, surface_normal{}, place{};
    double light_variance = -1.0, normal_factor = 0.0, distance_factor = 0.0;
};

double grey_of(const dvec3& rgb) {
    return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z;
}

std::vector<ReferencePixel> reference_pixels(const Film& film) {
    std::vector<ReferencePixel> pixels(film.pixels.size());
    const auto three = [&](Plane plane, std::size_t i) {
        const std::size_t channels = film.planes[plane].channels.size();
        const float* const values = &film.planes[plane].values[channels * i];
        return dvec3(values[0], values[1], values[2]);
    };
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        ReferencePixel& pixel = pixels[i];
        pixel.surface_albedo = glm::max(three(albedo, i), dvec3(1.0 / 32.0));
        pixel.surface_normal = three(normal, i);
        pixel.place = three(position, i);
        const double spread =
            std::max(0.0, film.planes[albedo].values[4 * i + 3] - glm::dot(pixel.surface_normal, pixel.surface_normal));
        pixel.normal_factor = 64.0 / (1.0 + 64.0 * spread);
        std::vector<double> squares;
        const auto x = static_cast<int>(i % film.width), y = static_cast<int>(i / film.width);
        for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
            if (x + dx < 0 || y + dy < 0 || x + dx >= int(film.width) || y + dy >= int(film.height)) continue;
            const dvec3 way =
                three(position, static_cast<std::size_t>((y + dy) * int(film.width) + x + dx)) - pixel.place;
            squares.push_back(glm::dot(way, way));
        }
        std::sort(squares.begin(), squares.end());
        if (!squares.empty()) {
            const double footprint = squares[std::min<std::size_t>(1, squares.size() - 1)];
            pixel.distance_factor = footprint > 0.0 ? 1.0 / footprint : 0.0;
        }
        pixel.light = dvec3(film.pixels[i]) / pixel.surface_albedo;
        if (!(glm::length(pixel.light) < 1e15)) {
            pixel.light = dvec3(0.0);
            continue;
        }
        const double grey = grey_of(pixel.surface_albedo), told = film.planes[variance].values[i];
        pixel.light_variance = told < 1e30 ? told / (grey * grey) : 1e30;
    }
    return pixels;
}

std::vector<ReferencePixel> reference_level(const Film& film, const std::vector<ReferencePixel>& before, int step) {
    std::vector<ReferencePixel> after = before;
    const int width = static_cast<int>(film.width), height = static_cast<int>(film.height);
    const auto at = [&](int x, int y) -> const ReferencePixel* {
        if (x < 0 || y < 0 || x >= width || y >= height) return nullptr;
        const ReferencePixel& pixel = before[static_cast<std::size_t>(y * width + x)];
        return pixel.light_variance >= 0.0 ? &pixel : nullptr;
    };
    const double spline[] = {3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const ReferencePixel& own = before[static_cast<std::size_t>(y * width + x)];
            double mean_variance = 0.0, counted = 0.0;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx)
                    if (const ReferencePixel* const other = at(x + dx, y + dy)) {
                        const double weight = (2 - std::abs(dx)) * (2 - std::abs(dy));
                        mean_variance += weight * other->light_variance;
                        counted += weight;
                    }
            mean_variance = std::max(counted > 0.0 ? mean_variance / counted : 0.0, own.light_variance);
            const double own_grey = grey_of(own.light);
            const double allowed = 16.0 * mean_variance + 1e-8 * own_grey * own_grey + 1e-20;
            dvec3 sum(0.0);
            double weights = 0.0, squares = 0.0;
            for (int dy = -2; dy <= 2; ++dy)
                for (int dx = -2; dx <= 2; ++dx) {
                    const ReferencePixel* const other = at(x + dx * step, y + dy * step);
                    if (!other) continue;
                    const dvec3 turned = other->surface_normal - own.surface_normal,
                                coloured = other->surface_albedo - own.surface_albedo;
                    const double above = glm::dot(own.surface_normal, other->place - own.place);
                    double distance = own.normal_factor * glm::dot(turned, turned) +
                                      own.distance_factor * above * above + 4.0 * glm::dot(coloured, coloured);
                    if (own.light_variance >= 0.0) distance += std::pow(grey_of(other->light) - own_grey, 2) / allowed;
                    const double base = 1.0 - distance / 16.0;
                    if (base <= 0.125) continue;
                    const double weight = std::pow(base, 16) * spline[std::abs(dx)] * spline[std::abs(dy)];
                    sum += weight * other->light;
                    weights += weight;
                    squares += weight * weight * other->light_variance;
                }
            ReferencePixel& result = after[static_cast<std::size_t>(y * width + x)];
            if (weights == 0.0) continue;
            result.light = sum / weights;
            result.light_variance = squares / (weights * weights);
        }
    return after;
}

}  // namespace

TEST_CASE("denoising is its formula in double precision", "[denoise]") {
    Film film = mixed_film(37, 29);
    std::vector<ReferencePixel> pixels = reference_pixels(film);
    for (const int step : {1, 2, 4, 8, 16}) pixels = reference_level(film, pixels, step);
    const Film clean = denoised(film);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const dvec3 expected = pixels[i].light * pixels[i].surface_albedo;
        CAPTURE(i, clean.pixels[i].x, expected.x, clean.pixels[i].y, expected.y);
        // Weights near the end of their range are the worst: (1 - x/16)^16 with a relative error of 16 ulp / (1 -
        // x/16).
        for (int c = 0; c < 3; ++c) REQUIRE(std::abs(clean.pixels[i][c] - expected[c]) <= 1e-3 * (1.0 + expected[c]));
    }
}

TEST_CASE("denoising gives the same bytes for one lane and for sixteen, and on parts of a device",
          "[denoise][oclgrind_vectors]") {
    const auto rows = [](std::size_t full, std::size_t few) {
        return static_cast<std::uint32_t>(test_size(full, few));
    };
    for (const auto& [width, height] :
         {std::pair{1u, 1u}, {3u, 2u}, {16u, 5u}, {33u, rows(40, 3)}, {1u, rows(70, 20)}}) {
        CAPTURE(width, height);
        const Film film = mixed_film(width, height);
        Film by_one = film, by_sixteen = film;
        DeviceContext context(test_device());
        context.set_lanes(1);
        denoise(by_one, context);
        context.set_lanes(16);
        denoise(by_sixteen, context);
        CHECK(same_pixels(by_one, by_sixteen));
        CHECK(same_pixels(by_one, denoised(film)));
        for (std::size_t plane = 0; plane < film.planes.size(); ++plane)
            CHECK(std::memcmp(by_one.planes[plane].values.data(), film.planes[plane].values.data(),
                              film.planes[plane].values.size() * sizeof(float)) == 0);
    }
}

TEST_CASE("denoising does not show where a large picture is cut", "[denoise]") {
    // So wide that a device has some sixty rows of it at a time. Pixels depend on those within 62, and their footprints
    // on the neighbours of these.
    constexpr std::uint32_t kWidth = 8192, kHeight = 130, kSize = 192, kFirst = 4000, kReach = 63;
    const auto cut = [&](const Film& film) {
        Film part = wall(kSize, kHeight, vec3(0.0f), vec3(0.5f), 1.0f);
        for (std::uint32_t y = 0; y < kHeight; ++y)
            for (std::uint32_t x = 0; x < kSize; ++x) {
                const std::size_t from = std::size_t{y} * kWidth + kFirst + x, to = std::size_t{y} * kSize + x;
                part.pixels[to] = film.pixels[from];
                for (std::size_t plane = 0; plane < film.planes.size(); ++plane) {
                    const std::size_t channels = film.planes[plane].channels.size();
                    std::copy_n(film.planes[plane].values.begin() + static_cast<std::ptrdiff_t>(channels * from),
                                channels,
                                part.planes[plane].values.begin() + static_cast<std::ptrdiff_t>(channels * to));
                }
            }
        return part;
    };
    const Film film = mixed_film(kWidth, kHeight);
    const Film whole = cut(denoised(film)), part = denoised(cut(film));
    std::size_t differing = 0;
    for (std::uint32_t y = 0; y < kHeight; ++y)
        for (std::uint32_t x = kReach; x < kSize - kReach; ++x)
            differing += std::memcmp(&whole.pixels[y * kSize + x], &part.pixels[y * kSize + x], sizeof(vec3)) != 0;
    CHECK(differing == 0);
}

TEST_CASE("what has no noise stays as it is", "[denoise]") {
    for (const float of_variance : {0.0f, 5.0f, kInfinity}) {
        CAPTURE(of_variance);
        const Film film = wall(40, 30, {13.7f, 0.0f, 91.3f}, {0.37f, 0.0f, 0.71f}, of_variance);
        CHECK(same_pixels(denoised(film), film));
    }
    // A step of light alone, where nothing varies: a shadow.
    Film shadow = wall(40, 30, vec3(50.0f), vec3(0.6f), 0.0f);
    for (std::size_t i = 0; i < shadow.pixels.size(); ++i)
        if (i % 40 < 17) shadow.pixels[i] = vec3(3.0f);
    CHECK(same_pixels(denoised(shadow), shadow));
}

TEST_CASE("noise goes and edges stay", "[denoise]") {
    constexpr std::uint32_t kWidth = 64, kHeight = 48, kEdge = 29;
    struct Side {
        vec3 rgb, of_albedo, of_normal;
        float depth;
    };
    struct Case {
        const char* name;
        Side left, right;
    };
    const vec3 front(0, 0, 1), grey(0.5f);
    for (const Case& edge :
         {Case{"albedo", {{40, 4, 4}, {0.8f, 0.08f, 0.08f}, front, -1}, {{5, 5, 40}, {0.1f, 0.1f, 0.8f}, front, -1}},
          Case{"normal", {vec3(20.0f), grey, front, -1}, {vec3(30.0f), grey, {1, 0, 0}, -1}},
          Case{"depth", {vec3(20.0f), grey, front, -1}, {vec3(30.0f), grey, front, -2}},
          Case{"light", {vec3(20.0f), grey, front, -1}, {vec3(200.0f), grey, front, -1}}}) {
        CAPTURE(edge.name);
        Film film = wall(kWidth, kHeight, vec3(0.0f), grey, 0.0f);
        for (std::uint32_t y = 0; y < kHeight; ++y)
            for (std::uint32_t x = 0; x < kWidth; ++x) {
                const std::size_t i = std::size_t{y} * kWidth + x;
                const Side& side = x < kEdge ? edge.left : edge.right;
                film.pixels[i] = side.rgb;
                set(film, albedo, i, {side.of_albedo.x, side.of_albedo.y, side.of_albedo.z});
                set(film, normal, i, {side.of_normal.x, side.of_normal.y, side.of_normal.z});
                film.planes[position].values[3 * i + 2] = side.depth;
            }
        const Film exact = film;
        add_noise(film, 0.2);
        const Film clean = denoised(film);
        const auto error = [&](const Film& of, std::uint32_t first, std::uint32_t end) {
            double sum = 0.0;
            for (std::uint32_t y = 0; y < kHeight; ++y)
                for (std::uint32_t x = first; x < end; ++x) {
                    const std::size_t i = std::size_t{y} * kWidth + x;
                    const double expected = exact.pixels[i].x;
                    sum += std::pow((of.pixels[i].x - expected) / expected, 2) / (kHeight * (end - first));
                }
            return std::sqrt(sum);
        };
        CAPTURE(error(film, 0, kWidth), error(clean, 0, kWidth), error(clean, kEdge - 2, kEdge + 2));
        CHECK(error(film, 0, kWidth) > 0.15);
        CHECK(error(clean, 0, kWidth) < 0.05);
        CHECK(error(clean, kEdge - 2, kEdge + 2) < 0.08);  // next to the edge, too
    }
}

TEST_CASE("pixels that are no numbers become like their surface, and spoil no other", "[denoise]") {
    Film film = wall(24, 20, vec3(10.0f), vec3(0.5f), 4.0f);
    film.pixels[5 * 24 + 7] = {kNan, 1.0f, 2.0f};
    film.pixels[5 * 24 + 8] = vec3(kInfinity);
    film.pixels[0] = vec3(1e20f);
    film.pixels[19 * 24 + 23].z = -kInfinity;
    for (const vec3& pixel : denoised(film).pixels) CHECK(glm::length(pixel - vec3(10.0f)) < 1e-4f);
    // Where nothing is known, nothing changes.
    Film unknown = wall(5, 4, vec3(kNan), vec3(0.5f), kNan);
    CHECK(same_pixels(denoised(unknown), unknown));
    // A pixel of another surface than all others.
    Film alone = film;
    set(alone, normal, 5 * 24 + 7, {1, 0, 0});
    CHECK(std::isnan(denoised(alone).pixels[5 * 24 + 7].x));
}

TEST_CASE("films that cannot be denoised are refused", "[denoise]") {
    const Film good = wall(4, 3, vec3(1.0f), vec3(0.5f), 0.0f);
    const auto refusal_of = [](Film film, const std::vector<Device>& devices) -> std::string {
        try {
            denoise(film, devices);
        } catch (const UsageError& error) {
            return error.what();
        }
        return "";
    };
    CHECK(refusal_of(good, {test_device()}).empty());
    CHECK(refusal_of(good, {}) == "there is no device to denoise with");
    Film bad = good;
    bad.planes.erase(bad.planes.begin());
    CHECK(refusal_of(bad, {test_device()}).find("has no plane \"variance\"") != std::string::npos);
    bad = good;
    bad.planes[normal].values.pop_back();
    CHECK(refusal_of(bad, {test_device()}).find("has 35 floats, expected 36") != std::string::npos);
    CHECK(refusal_of(Film{}, {test_device()}).find("0x0 pixels") != std::string::npos);
}

}  // namespace castor::test
