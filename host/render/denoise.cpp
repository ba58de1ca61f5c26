#include "render/denoise.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "base/range.h"
#include "castor/error.h"
#include "castor/shared/denoise_planes.h"
#include "opencl/device_context.h"
#include "render/light_planes.h"

namespace castor {

namespace {

constexpr std::array<std::string_view, 2> kDenoiserNames{"castor", "oidn"};

constexpr std::uint32_t kLevels = 5;
constexpr std::uint64_t kMargin = CASTOR_DENOISE_MARGIN;
static_assert(kMargin == 2u << (kLevels - 1));
constexpr std::uint64_t kReach = 2 * ((1u << kLevels) - 1);  // rows of pixels that a pixel depends on, to each side
constexpr std::uint64_t kLanes = 16;                         // of the widest kernel

// Planes of the light: red, green, blue and variance.
constexpr std::size_t kVariance = 3, kLightPlanes = 4;

// Pixels that are filtered at a time, of which a device has the planes: 76 bytes a pixel.
constexpr std::uint64_t kMostPixels = 1u << 21;

// The albedo that surfaces without any count as having, so that what mirrors show can be divided by it.
constexpr float kLeastAlbedo = 1.0f / 32.0f;
constexpr float kLargestLight = 1e15f, kLargestVariance = 1e30f;

// Factor of the squared difference of two mean normals: e^-x of it is about cos^128 of the angle between them. It is
// the smaller, the more the normals within a pixel differ.
constexpr float kNormalFactor = 64.0f;

/// The planes of a film, by denoiser_planes().
struct Inputs {
    const float* variance;
    const float* albedo;  // R, G, B, A
    const float* normal;
    const float* position;
};

Inputs inputs_of(const Film& film) {
    const auto values_of = [&](const char* name, std::size_t channels) {
        return denoiser_plane(film, Denoiser::castor, name, channels);
    };
    return {values_of("variance", 1), values_of("mean-albedo", 4), values_of("mean-normal", 3),
            values_of("mean-position", 3)};
}

glm::vec3 albedo_at(const Inputs& inputs, std::size_t pixel) {
    glm::vec3 albedo;
    for (int c = 0; c < 3; ++c) {
        const float value = inputs.albedo[4 * pixel + static_cast<std::size_t>(c)];
        albedo[c] = value > kLeastAlbedo ? value : kLeastAlbedo;
    }
    return albedo;
}

float luminance(const glm::vec3& rgb) {
    return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}

/// Some rows of a picture as denoise_level has them, with margins around them.
class Region {
public:
    /// `rows`: of the film.
    Region(const Film& film, const Inputs& inputs, const Range& rows)
        : film_(film),
          inputs_(inputs),
          rows_(rows),
          row_length_((film.width + kLanes - 1) / kLanes * kLanes + 2 * kMargin),
          plane_length_(row_length_ * (rows.size() + 2 * kMargin)),
          features_(plane_length_ * CASTOR_DENOISE_FEATURES),
          light_(plane_length_ * kLightPlanes) {
        std::fill_n(light_.begin() + static_cast<std::ptrdiff_t>(kVariance * plane_length_), plane_length_, -1.0f);
        tbb::parallel_for(rows.begin, rows.end, [&](std::uint64_t y) {
            for (std::uint32_t x = 0; x < film_.width; ++x) fill(x, static_cast<std::uint32_t>(y));
        });
    }

    /// Filters on the device: `light` has the result.
    void filter(DeviceContext& context) {
        const std::uint32_t lanes = context.quirks().lanes;
        cl::Kernel kernel = context.kernel_of(fmt::format("denoise_level.x{}", lanes),
                                              "denoise_level" + (lanes > 1 ? std::to_string(lanes) : std::string()));
        const std::size_t items = rows_.size() * ((film_.width + lanes - 1) / lanes);
        const auto upload = [&](const std::vector<float>& values, const char* what) {
            cl::Buffer buffer = context.make_buffer(values.size() * sizeof(float), what);
            context.write(buffer, values.data(), values.size() * sizeof(float));
            return buffer;
        };
        const cl::Buffer features = upload(features_, "features of pixels");
        cl::Buffer before = upload(light_, "light of pixels"), after = upload(light_, "light of pixels");
        for (std::uint32_t level = 0; level < kLevels; ++level) {
            context.enqueue(kernel, items, cl_uint{film_.width}, static_cast<cl_uint>(rows_.size()),
                            static_cast<cl_uint>(row_length_), static_cast<cl_uint>(plane_length_),
                            cl_uint{1u << level}, features, before, after);
            std::swap(before, after);
        }
        context.read(before, light_.data(), light_.size() * sizeof(float));
    }

    /// Returns a pixel of the film's without noise. `x` and `y`: of the film.
    glm::vec3 pixel(std::uint32_t x, std::uint32_t y) const {
        const std::size_t number = std::size_t{y} * film_.width + x, place = place_of(x, y);
        const glm::vec3 albedo = albedo_at(inputs_, number), noisy = film_.pixels[number];
        if (light_[kVariance * plane_length_ + place] < 0.0f) return noisy;
        glm::vec3 clean;
        for (int c = 0; c < 3; ++c) {
            const float light = light_[static_cast<std::size_t>(c) * plane_length_ + place];
            clean[c] = light == noisy[c] / albedo[c] ? noisy[c] : light * albedo[c];
        }
        return clean;
    }

private:
    std::size_t place_of(std::uint32_t x, std::uint32_t y) const {
        return (y - rows_.begin + kMargin) * row_length_ + kMargin + x;
    }

    glm::vec3 mean_at(const float* plane, std::size_t pixel) const {
        return {plane[3 * pixel], plane[3 * pixel + 1], plane[3 * pixel + 2]};
    }

    /// Returns the square of the distance to the neighbour that is the second nearest of four, about that of the
    /// pixels' footprints on the surface; 0: there is none.
    float squared_footprint(std::uint32_t x, std::uint32_t y) const {
        constexpr std::array<std::array<int, 2>, 4> kSteps{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
        const glm::vec3 here = mean_at(inputs_.position, std::size_t{y} * film_.width + x);
        std::array<float, 4> squares;
        std::size_t count = 0;
        for (const auto& [dx, dy] : kSteps) {
            const std::int64_t nx = std::int64_t{x} + dx, ny = std::int64_t{y} + dy;
            if (nx < 0 || ny < 0 || nx >= film_.width || ny >= film_.height) continue;
            const auto neighbour = static_cast<std::size_t>(ny * film_.width + nx);
            const glm::vec3 way = mean_at(inputs_.position, neighbour) - here;
            squares[count++] = way.x * way.x + way.y * way.y + way.z * way.z;
        }
        if (count == 0) return 0.0f;
        std::sort(squares.begin(), squares.begin() + static_cast<std::ptrdiff_t>(count));
        return squares[std::min<std::size_t>(1, count - 1)];
    }

    void fill(std::uint32_t x, std::uint32_t y) {
        const std::size_t number = std::size_t{y} * film_.width + x, place = place_of(x, y);
        const glm::vec3 albedo = albedo_at(inputs_, number);
        const glm::vec3 normal = mean_at(inputs_.normal, number), position = mean_at(inputs_.position, number);
        const auto feature = [&](std::size_t plane) -> float& { return features_[plane * plane_length_ + place]; };
        const auto light = [&](std::size_t plane) -> float& { return light_[plane * plane_length_ + place]; };
        for (int c = 0; c < 3; ++c) {
            const auto channel = static_cast<std::size_t>(c);
            feature(CASTOR_DENOISE_NORMAL + channel) = normal[c];
            feature(CASTOR_DENOISE_POSITION + channel) = position[c];
            feature(CASTOR_DENOISE_ALBEDO_RGB + channel) = albedo[c];
        }
        // The variance of the normals within the pixel: those of the samples have length 1, or 0 where nothing is met.
        const float length2 = normal.x * normal.x + normal.y * normal.y + normal.z * normal.z;
        const float spread = std::max(inputs_.albedo[4 * number + 3] - length2, 0.0f);
        feature(CASTOR_DENOISE_NORMAL_FACTOR) = kNormalFactor / (1.0f + kNormalFactor * spread);
        const float footprint = squared_footprint(x, y);
        feature(CASTOR_DENOISE_DISTANCE_FACTOR) = footprint > 1e-30f ? 1.0f / footprint : 0.0f;

        glm::vec3 rgb = film_.pixels[number] / albedo;
        const auto is_usable = [](float value) { return std::abs(value) < kLargestLight; };  // not NaN
        if (!is_usable(rgb.x) || !is_usable(rgb.y) || !is_usable(rgb.z)) return;
        for (int c = 0; c < 3; ++c) light(static_cast<std::size_t>(c)) = rgb[c];
        const float of_albedo = luminance(albedo), variance = inputs_.variance[number] / (of_albedo * of_albedo);
        light(kVariance) = variance < kLargestVariance ? std::max(variance, 0.0f) : kLargestVariance;
    }

    const Film& film_;
    const Inputs& inputs_;
    Range rows_;
    std::uint64_t row_length_, plane_length_;
    std::vector<float> features_, light_;
};

}  // namespace

std::string_view to_string(Denoiser denoiser) {
    return kDenoiserNames[static_cast<std::size_t>(denoiser)];
}

Denoiser denoiser_from_string(std::string_view word) {
    const auto found = std::find(kDenoiserNames.begin(), kDenoiserNames.end(), word);
    if (found == kDenoiserNames.end())
        throw UsageError(
            fmt::format("there is no denoiser \"{}\"; there are {}", word, fmt::join(kDenoiserNames, ", ")));
    return static_cast<Denoiser>(found - kDenoiserNames.begin());
}

const std::vector<std::string>& denoiser_planes(Denoiser denoiser) {
    static const std::vector<std::string> names = {"variance", "mean-albedo", "mean-normal", "mean-position"};
    static const std::vector<std::string> names_for_oidn = {"mean-albedo", "mean-normal"};
    return denoiser == Denoiser::oidn ? names_for_oidn : names;
}

const float* denoiser_plane(const Film& film, Denoiser denoiser, std::string_view name, std::size_t channels) {
    if (film.pixels.empty() || film.pixels.size() != std::size_t{film.width} * film.height)
        throw UsageError(fmt::format("the film to denoise has {}x{} pixels, and values of {}", film.width, film.height,
                                     film.pixels.size()));
    const auto plane =
        std::find_if(film.planes.begin(), film.planes.end(), [&](const FilmPlane& p) { return p.name == name; });
    if (plane == film.planes.end())
        throw UsageError(fmt::format("denoising takes the planes {}, and the film has no plane \"{}\"",
                                     fmt::join(denoiser_planes(denoiser), ", "), name));
    const std::size_t expected = channels * film.width * film.height;
    if (plane->values.size() != expected)
        throw UsageError(fmt::format("the film's plane \"{}\" has {} floats, expected {}: {} a pixel", name,
                                     plane->values.size(), expected, channels));
    return plane->values.data();
}

std::vector<std::string> rendered_aovs(const RenderOptions& options) {
    std::vector<std::string> names;
    std::copy_if(options.aovs.begin(), options.aovs.end(), std::back_inserter(names),
                 [](const std::string& name) { return name != kNoisyPlane; });
    for (const std::string& name : denoiser_planes(options.denoiser))
        if (options.denoise && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    for (std::string& name : light_group_planes(options.light_groups)) names.push_back(std::move(name));
    return names;
}

void denoise(Film& film, DeviceContext& context) {
    const Inputs inputs = inputs_of(film);
    const std::uint64_t floats = context.device().max_allocation_bytes / sizeof(float) / CASTOR_DENOISE_FEATURES;
    const std::uint64_t row = film.width + kLanes + 2 * kMargin;
    const std::uint64_t most_rows = std::min(kMostPixels, floats) / row;
    const std::uint64_t around = 2 * (kReach + kMargin);  // rows that are there for those that are filtered
    const std::uint64_t rows = most_rows > around ? most_rows - around : 1;
    std::vector<glm::vec3> pixels(film.pixels.size());
    for (std::uint64_t begin = 0; begin < film.height; begin += rows) {
        const std::uint64_t end = std::min<std::uint64_t>(begin + rows, film.height);
        Region region(film, inputs,
                      {begin - std::min(begin, kReach), std::min<std::uint64_t>(end + kReach, film.height)});
        region.filter(context);
        tbb::parallel_for(begin, end, [&](std::uint64_t y) {
            for (std::uint32_t x = 0; x < film.width; ++x)
                pixels[y * film.width + x] = region.pixel(x, static_cast<std::uint32_t>(y));
        });
    }
    film.pixels = std::move(pixels);
}

void denoise(Film& film, const std::vector<Device>& devices) {
    if (devices.empty()) throw UsageError("there is no device to denoise with");
    inputs_of(film);  // or it throws
    for (std::size_t i = 0;; ++i) {
        try {
            DeviceContext context(devices[i]);
            return denoise(film, context);
        } catch (const DeviceError&) {
            if (i + 1 == devices.size()) throw;
        }
    }
}

void finish_denoised(Film& film, const std::vector<std::string>& aovs, const std::function<void(Film&)>& remove_noise) {
    std::optional<FilmPlane> noisy;
    if (std::find(aovs.begin(), aovs.end(), kNoisyPlane) != aovs.end()) {
        noisy = FilmPlane{kNoisyPlane, {"R", "G", "B"}, {}, {}};
        for (const glm::vec3& pixel : film.pixels)
            noisy->values.insert(noisy->values.end(), {pixel.x, pixel.y, pixel.z});
    }
    if (film.complete()) remove_noise(film);
    std::vector<FilmPlane> planes;
    for (const std::string& name : aovs) {
        if (name == kNoisyPlane) planes.push_back(std::move(*noisy));
        for (FilmPlane& plane : film.planes)
            if (plane.name == name) planes.push_back(std::move(plane));
    }
    for (FilmPlane& plane : film.planes)
        if (plane.name.starts_with("light-") || plane.name.starts_with(kGroupPlane)) planes.push_back(std::move(plane));
    film.planes = std::move(planes);
}

}  // namespace castor
