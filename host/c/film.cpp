#include "castor/film.h"

#include <algorithm>

#include "c/handle.h"
#include "castor/image_io.h"
#include "castor/tone_map.h"

using namespace castor;
using namespace castor::c;

castor_film::castor_film(Film of) : film(std::move(of)) {
    for (const FilmPlane& plane : film.planes) channels.push_back(fmt::format("{}", fmt::join(plane.channels, ",")));
}

namespace {

const FilmPlane& plane_of(const Film& film, const char* name) {
    const std::string_view wanted = &require(name, "name");
    std::string names;
    for (const FilmPlane& plane : film.planes) {
        if (plane.name == wanted) return plane;
        names += (names.empty() ? "" : ", ") + plane.name;
    }
    throw UsageError(fmt::format("the film has no plane \"{}\"; it has {}", wanted, names.empty() ? "none" : names));
}

void tell(const castor_film& film, std::size_t i, castor_film_plane* plane) {
    const FilmPlane& found = film.film.planes[position(i, film.film.planes.size(), "the planes")];
    castor_film_plane told{};
    told.name = found.name.c_str();
    told.channels = film.channels[i].c_str();
    told.channel_count = found.channels.size();
    told.values = found.values.empty() ? nullptr : found.values.data();
    told.indices = found.indices.empty() ? nullptr : found.indices.data();
    write_struct(plane, told, "plane");
}

ToneMap tone_map_of(const castor_tone_map* tone_map) {
    static_assert(static_cast<int>(ToneOperator::agx) == CASTOR_TONE_OPERATOR_AGX);
    ToneMap map;
    if (!tone_map) return map;
    const castor_tone_map given = read_options(tone_map);
    map.tone_operator = enumerator<ToneOperator>(given.tone_operator, 5, "tone_operator");
    map.is_srgb = flag(given.srgb, "srgb");
    if (given.key != 0.0f) map.key = given.key;
    map.burn_percent = given.burn_percent;
    map.saturation = given.saturation;
    if (given.gamma != 0.0f) map.gamma = given.gamma;
    return map;
}

}  // namespace

void castor_film_retain(castor_film* film) {
    retain(film);
}
void castor_film_release(castor_film* film) {
    release(film);
}

castor_status castor_film_get_info(const castor_film* film, castor_film_info* info) {
    return guarded([&] {
        const Film& found = require(film, "film").film;
        castor_film_info told{};
        told.width = found.width;
        told.height = found.height;
        told.samples_per_pixel = found.samples_per_pixel;
        told.complete = found.complete();
        told.pixels = reinterpret_cast<const float*>(found.pixels.data());
        told.done = found.done.data();
        told.plane_count = found.planes.size();
        write_struct(info, told, "info");
    });
}

castor_status castor_film_get_plane(const castor_film* film, size_t i, castor_film_plane* plane) {
    return guarded([&] { tell(require(film, "film"), i, plane); });
}

castor_status castor_film_find_plane(const castor_film* film, const char* name, castor_film_plane* plane) {
    return guarded([&] {
        const castor_film& asked = require(film, "film");
        tell(asked, static_cast<std::size_t>(&plane_of(asked.film, name) - asked.film.planes.data()), plane);
    });
}

castor_status castor_film_write_image(const castor_film* film, const char* path, const castor_image_options* options) {
    return guarded([&] {
        static_assert(static_cast<int>(Quantization::truncate) == CASTOR_QUANTIZATION_TRUNCATE);
        const Film& written = require(film, "film").film;
        const castor_image_options given = read_options(options);
        require_zero(given.reserved);
        write_image(&require(path, "path"), written, {enumerator<Quantization>(given.quantization, 2, "quantization")});
    });
}

castor_status castor_film_apply_tone_map(const castor_film* film, const castor_tone_map* tone_map, uint8_t* rgb) {
    return guarded([&] {
        const Film& mapped = require(film, "film").film;
        std::uint8_t* const target = &require(rgb, "rgb");
        const Image image = apply_tone_map(mapped, tone_map_of(tone_map));
        std::copy(image.bytes.begin(), image.bytes.end(), target);
    });
}

castor_status castor_film_write_tone_mapped(const castor_film* film, const char* path,
                                            const castor_tone_map* tone_map) {
    return guarded([&] {
        const Film& mapped = require(film, "film").film;
        const std::filesystem::path file = &require(path, "path");
        write_image(file, apply_tone_map(mapped, tone_map_of(tone_map)));
    });
}

castor_status castor_film_write_plane(const castor_film* film, const char* name, const char* path) {
    return guarded([&] {
        const Film& written = require(film, "film").film;
        const FilmPlane& plane = plane_of(written, name);
        write_plane(&require(path, "path"), written, plane);
    });
}

castor_status castor_film_write_layers(const castor_film* film, const char* path) {
    return guarded([&] { write_layers(&require(path, "path"), require(film, "film").film); });
}

castor_status castor_check_image_extension(const char* path) {
    return guarded([&] { check_image_extension(&require(path, "path")); });
}
