#include "render/aov.h"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>

#include "castor/error.h"
#include "castor/renderer.h"

namespace castor {

namespace {

/// Where a plane's values stand in TileAovs: a column of four values a pixel, from `first` on.
struct PlaneSource {
    std::string_view name;
    std::vector<float> TileAovs::*floats;           // null: indices
    std::size_t first;
    std::vector<std::string> channels;
    float nothing;  // of a float plane
};

const std::vector<PlaneSource>& plane_sources() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    static const std::vector<PlaneSource> sources = {
        {"depth", &TileAovs::position_depth, 3, {"Z"}, kInfinity},
        {"position", &TileAovs::position_depth, 0, {"X", "Y", "Z"}, 0.0f},
        {"normal", &TileAovs::normal, 0, {"X", "Y", "Z"}, 0.0f},
        {"barycentric", &TileAovs::barycentric_t, 0, {"U", "V"}, 0.0f},
        {"t", &TileAovs::barycentric_t, 2, {"T"}, kInfinity},
        {"primitive", nullptr, 0, {"primitive"}, 0.0f},
        {"instance", nullptr, 1, {"instance"}, 0.0f},
        {"material", nullptr, 2, {"material"}, 0.0f},
    };
    return sources;
}

const PlaneSource& source_of(std::string_view name) {
    const auto& sources = plane_sources();
    const auto found = std::find_if(sources.begin(), sources.end(), [&](const PlaneSource& s) { return s.name == name; });
    if (found != sources.end()) return *found;
    throw UsageError(fmt::format("there is no plane \"{}\"; there are {}", name, fmt::join(aov_names(), ", ")));
}

template <class Value>
void copy_tile(std::vector<Value>& plane, std::uint32_t film_width, const Tile& tile, const std::vector<Value>& column,
               std::size_t first, std::size_t channels) {
    for (std::size_t y = 0; y < tile.height; ++y)
        for (std::size_t x = 0; x < tile.width; ++x) {
            const auto source = column.begin() + 4 * (y * tile.width + x) + first;
            std::copy_n(source, channels, plane.begin() + channels * ((tile.y + y) * film_width + tile.x + x));
        }
}

}  // namespace

const std::vector<std::string>& aov_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const PlaneSource& source : plane_sources()) all.emplace_back(source.name);
        return all;
    }();
    return names;
}

std::vector<FilmPlane> make_planes(const std::vector<std::string>& names, std::uint32_t width, std::uint32_t height) {
    std::vector<FilmPlane> planes;
    for (const std::string& name : names) {
        const PlaneSource& source = source_of(name);
        if (std::any_of(planes.begin(), planes.end(), [&](const FilmPlane& plane) { return plane.name == name; }))
            throw UsageError(fmt::format("the plane \"{}\" is asked for twice", name));
        FilmPlane& plane = planes.emplace_back(FilmPlane{name, source.channels, {}, {}});
        const std::size_t count = source.channels.size() * width * height;
        if (source.floats)
            plane.values.assign(count, source.nothing);
        else
            plane.indices.assign(count, CASTOR_INVALID_INDEX);
    }
    return planes;
}

void store_tile(Film& film, const Tile& tile, const TileAovs& aovs) {
    for (FilmPlane& plane : film.planes) {
        const PlaneSource& source = source_of(plane.name);
        if (source.floats)
            copy_tile(plane.values, film.width, tile, aovs.*source.floats, source.first, source.channels.size());
        else
            copy_tile(plane.indices, film.width, tile, aovs.primitive_instance_material, source.first, source.channels.size());
    }
}

}  // namespace castor
