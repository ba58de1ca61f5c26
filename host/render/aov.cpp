#include "render/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>

#include "castor/error.h"
#include "castor/renderer.h"
#include "render/denoise.h"
#include "render/light_planes.h"

namespace castor {

namespace {

/// Where a plane's values come from.
enum class Origin {
    eye_rays,  // columns of WaveAovs
    sums,      // rows of Wave::sums, divided by the number of samples
    group,     // likewise, after all others: a row for each of these planes, in their order
    variance,  // w of the sums
    samples,   // the number of samples
};

/// The place of a plane's values: a column of four values a pixel, from value `first` on.
struct PlaneSource {
    std::string_view name;
    std::vector<float> WaveAovs::*floats;  // null for planes of indices, and where the origin is not eye_rays
    std::size_t first;                     // where the origin is sums: the row
    std::vector<std::string> channels;
    float nothing;  // value of a miss in a plane of floats, and where there is no sample
    Origin origin = Origin::eye_rays;
};

const std::vector<PlaneSource>& plane_sources() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    static const std::vector<PlaneSource> sources = {
        {"depth", &WaveAovs::position_depth, 3, {"Z"}, kInfinity},
        {"position", &WaveAovs::position_depth, 0, {"X", "Y", "Z"}, 0.0f},
        {"normal", &WaveAovs::normal, 0, {"X", "Y", "Z"}, 0.0f},
        {"barycentric", &WaveAovs::barycentric_t, 0, {"U", "V"}, 0.0f},
        {"t", &WaveAovs::barycentric_t, 2, {"T"}, kInfinity},
        {"primitive", nullptr, 0, {"primitive"}, 0.0f},
        {"instance", nullptr, 1, {"instance"}, 0.0f},
        {"material", nullptr, 2, {"material"}, 0.0f},
        {"albedo", &WaveAovs::albedo, 0, {"R", "G", "B"}, 0.0f},
        {"uv", &WaveAovs::uv, 0, {"U", "V"}, 0.0f},
        {"variance", nullptr, 0, {"Y"}, kInfinity, Origin::variance},
        {"samples", nullptr, 0, {"samples"}, 0.0f, Origin::samples},
        {"mean-albedo", nullptr, 1 + CASTOR_FEATURE_ALBEDO, {"R", "G", "B", "A"}, 0.0f, Origin::sums},
        {"mean-normal", nullptr, 1 + CASTOR_FEATURE_NORMAL, {"X", "Y", "Z"}, 0.0f, Origin::sums},
        {"mean-position", nullptr, 1 + CASTOR_FEATURE_POSITION, {"X", "Y", "Z"}, 0.0f, Origin::sums},
    };
    return sources;
}

const PlaneSource& source_of(std::string_view name) {
    static const PlaneSource group{kGroupPlane, nullptr, 0, {"R", "G", "B"}, 0.0f, Origin::group};
    if (name.starts_with(kGroupPlane)) return group;
    const auto& sources = plane_sources();
    const auto found =
        std::find_if(sources.begin(), sources.end(), [&](const PlaneSource& s) { return s.name == name; });
    if (found != sources.end()) return *found;
    throw UsageError(fmt::format("there is no plane \"{}\"; there are {}", name, fmt::join(aov_names(), ", ")));
}

bool holds_indices(const PlaneSource& source) {
    return source.origin == Origin::samples || (source.origin == Origin::eye_rays && !source.floats);
}

bool any_of(const std::vector<FilmPlane>& planes, std::initializer_list<Origin> origins) {
    return std::any_of(planes.begin(), planes.end(), [&](const FilmPlane& plane) {
        return std::count(origins.begin(), origins.end(), source_of(plane.name).origin) > 0;
    });
}

/// Returns the variance of the mean of some samples: infinite where there are too few to know.
float variance_of_mean(float squared_deviations, std::uint32_t samples) {
    if (samples < 2) return std::numeric_limits<float>::infinity();
    return squared_deviations / static_cast<float>(samples - 1) / static_cast<float>(samples);
}

template <class Value>
void copy_column(std::vector<Value>& plane, std::size_t channels, const PixelBlocks& blocks,
                 std::span<const std::uint32_t> numbers, const std::vector<Value>& column, std::size_t first) {
    for (std::size_t place = 0; place < numbers.size(); ++place)
        blocks.for_each_row(numbers[place], place, [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
            for (std::size_t i = 0; i < count; ++i)
                std::copy_n(column.begin() + 4 * (slot + i) + first, channels, plane.begin() + channels * (pixel + i));
        });
}

}  // namespace

const std::vector<std::string>& aov_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const PlaneSource& source : plane_sources()) all.emplace_back(source.name);
        all.emplace_back(kNoisyPlane);
        all.emplace_back(kLightPlanes);
        return all;
    }();
    return names;
}

std::vector<FilmPlane> make_planes(const std::vector<std::string>& names, std::uint32_t width, std::uint32_t height) {
    std::vector<FilmPlane> planes;
    for (const std::string& name : names) {
        if (std::count(names.begin(), names.end(), name) > 1)
            throw UsageError(fmt::format("the plane \"{}\" is asked for twice", name));
        if (name == kLightPlanes) continue;
        const PlaneSource& source = source_of(name);
        FilmPlane& plane = planes.emplace_back(FilmPlane{name, source.channels, {}, {}});
        const std::size_t count = source.channels.size() * width * height;
        if (holds_indices(source))
            plane.indices.assign(count, source.origin == Origin::samples ? 0 : CASTOR_INVALID_INDEX);
        else
            plane.values.assign(count, source.nothing);
    }
    return planes;
}

void store_aovs(Film& film, const PixelBlocks& blocks, std::span<const std::uint32_t> numbers, const WaveAovs& aovs) {
    for (FilmPlane& plane : film.planes) {
        const PlaneSource& source = source_of(plane.name);
        if (source.origin != Origin::eye_rays) continue;
        if (source.floats)
            copy_column(plane.values, source.channels.size(), blocks, numbers, aovs.*source.floats, source.first);
        else
            copy_column(plane.indices, source.channels.size(), blocks, numbers, aovs.primitive_instance_material,
                        source.first);
    }
}

bool has_planes_of_eye_rays(const std::vector<FilmPlane>& planes) {
    return any_of(planes, {Origin::eye_rays});
}

bool has_planes_of_sums(const std::vector<FilmPlane>& planes) {
    return any_of(planes, {Origin::sums, Origin::variance, Origin::group});
}

namespace {

/// Returns the row of sums of the first group.
std::uint32_t first_group_row(const std::vector<FilmPlane>& planes) {
    return any_of(planes, {Origin::sums}) ? 1 + CASTOR_FEATURES : 1;
}

}  // namespace

std::uint32_t rows_of_sums(const std::vector<FilmPlane>& planes) {
    return first_group_row(planes) +
           static_cast<std::uint32_t>(std::count_if(planes.begin(), planes.end(), [](const FilmPlane& plane) {
               return source_of(plane.name).origin == Origin::group;
           }));
}

void store_sums(Film& film, const PixelBlocks& blocks, std::uint32_t block, std::uint32_t samples,
                std::span<const glm::vec4> sums) {
    std::size_t group_row = first_group_row(film.planes);
    for (FilmPlane& plane : film.planes) {
        const PlaneSource& source = source_of(plane.name);
        const std::size_t channels = source.channels.size();
        if (source.origin == Origin::eye_rays) continue;
        const std::size_t row = source.origin == Origin::group ? group_row++ : source.first;
        blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
            for (std::size_t i = 0; i < count; ++i) {
                if (source.origin == Origin::samples) {
                    plane.indices[pixel + i] = samples;
                    continue;
                }
                const glm::vec4& sum = sums[row * PixelBlocks::kPixels + slot + i];
                float* const values = plane.values.data() + channels * (pixel + i);
                if (source.origin == Origin::variance)
                    *values = variance_of_mean(sum.w, samples);
                else
                    for (std::size_t c = 0; c < channels; ++c)
                        values[c] = sum[static_cast<int>(c)] / static_cast<float>(samples);
            }
        });
    }
}

}  // namespace castor
