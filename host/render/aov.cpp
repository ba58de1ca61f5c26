#include "render/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "castor/error.h"
#include "castor/renderer.h"
#include "render/light_planes.h"

namespace castor {

namespace {

/// The place of a plane's values in WaveAovs: a column of four values a pixel, from value `first` on.
struct PlaneSource {
    std::string_view name;
    std::vector<float> WaveAovs::*floats;  // null for planes of indices
    std::size_t first;
    std::vector<std::string> channels;
    float nothing;  // value of a miss in a plane of floats
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
    };
    return sources;
}

const PlaneSource& source_of(std::string_view name) {
    const auto& sources = plane_sources();
    const auto found =
        std::find_if(sources.begin(), sources.end(), [&](const PlaneSource& s) { return s.name == name; });
    if (found != sources.end()) return *found;
    throw UsageError(fmt::format("there is no plane \"{}\"; there are {}", name, fmt::join(aov_names(), ", ")));
}

template <class Value>
void copy_column(std::vector<Value>& plane, std::size_t channels, const PixelBlocks& blocks, const Range& numbers,
                 const std::vector<Value>& column, std::size_t first) {
    for (std::uint64_t number = numbers.begin; number < numbers.end; ++number)
        blocks.for_each_row(static_cast<std::uint32_t>(number), number - numbers.begin,
                            [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
                                for (std::size_t i = 0; i < count; ++i)
                                    std::copy_n(column.begin() + 4 * (slot + i) + first, channels,
                                                plane.begin() + channels * (pixel + i));
                            });
}

}  // namespace

const std::vector<std::string>& aov_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const PlaneSource& source : plane_sources()) all.emplace_back(source.name);
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
        if (source.floats)
            plane.values.assign(count, source.nothing);
        else
            plane.indices.assign(count, CASTOR_INVALID_INDEX);
    }
    return planes;
}

void store_aovs(Film& film, const PixelBlocks& blocks, const Range& numbers, const WaveAovs& aovs) {
    for (FilmPlane& plane : film.planes) {
        const PlaneSource& source = source_of(plane.name);
        if (source.floats)
            copy_column(plane.values, source.channels.size(), blocks, numbers, aovs.*source.floats, source.first);
        else
            copy_column(plane.indices, source.channels.size(), blocks, numbers, aovs.primitive_instance_material,
                        source.first);
    }
}

}  // namespace castor
