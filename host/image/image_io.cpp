#include "castor/image_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string>

#include "base/atomic_file.h"
#include "castor/error.h"
#include "image/encode.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "pixels are read as floats");

std::uint8_t quantize(float value, Quantization quantization) {
    if (!(value > 0.0f)) return 0;  // NaN too
    if (value >= 255.0f) return 255;
    // In double precision, where adding a half is exact.
    const double shifted = quantization == Quantization::round ? double{value} + 0.5 : double{value};
    return static_cast<std::uint8_t>(shifted);
}

std::span<const float> linear_values(const Film& film) {
    return {reinterpret_cast<const float*>(film.pixels.data()), film.pixels.size() * 3};
}

std::vector<std::uint8_t> quantized_values(const Film& film, const ImageOptions& options) {
    const std::span<const float> values = linear_values(film);
    std::vector<std::uint8_t> result(values.size());
    std::transform(values.begin(), values.end(), result.begin(),
                   [&](float value) { return quantize(value, options.quantization); });
    return result;
}

std::vector<ExrChannel> channels_of_picture(const Film& film) {
    const std::span<const float> values = linear_values(film);
    return {{"R", values, {}, 3}, {"G", values.subspan(1), {}, 3}, {"B", values.subspan(2), {}, 3}};
}

/// Returns the channels of a plane. Of a layer, they are named by the plane and themselves, such as "normal.X", but
/// where both names are the same.
std::vector<ExrChannel> channels_of(const FilmPlane& plane, bool is_layer) {
    std::vector<ExrChannel> channels;
    const std::size_t stride = plane.channels.size();
    for (std::size_t i = 0; i < stride; ++i) {
        const std::string& name = plane.channels[i];
        ExrChannel& channel = channels.emplace_back(
            ExrChannel{is_layer && name != plane.name ? plane.name + "." + name : name, {}, {}, stride});
        if (plane.indices.empty())
            channel.floats = std::span(plane.values).subspan(i);
        else
            channel.integers = std::span(plane.indices).subspan(i);
    }
    return channels;
}

struct Format {
    std::string_view extension;
    Bytes (*encode)(const Film& film, const ImageOptions& options);
};

constexpr std::array<Format, 5> kFormats = {{
    {".png",
     [](const Film& film, const ImageOptions& options) {
         return encode_png(film.width, film.height, quantized_values(film, options));
     }},
    {".ppm",
     [](const Film& film, const ImageOptions& options) {
         return encode_ppm(film.width, film.height, quantized_values(film, options));
     }},
    {".pfm",
     [](const Film& film, const ImageOptions&) { return encode_pfm(film.width, film.height, 3, linear_values(film)); }},
    {".hdr",
     [](const Film& film, const ImageOptions&) { return encode_hdr(film.width, film.height, linear_values(film)); }},
    {".exr", [](const Film& film,
                const ImageOptions&) { return encode_exr(film.width, film.height, channels_of_picture(film)); }},
}};

std::string extension_of(const fs::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return extension;
}

[[noreturn]] void refuse_extension(const fs::path& file, std::string_view what, std::string_view known) {
    throw UsageError(fmt::format("{}: {} cannot be written with the extension \"{}\"; there are {}", file.string(),
                                 what, file.extension().string(), known));
}

const Format& format_of(const fs::path& file) {
    const std::string extension = extension_of(file);
    const auto found =
        std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& f) { return f.extension == extension; });
    if (found == kFormats.end()) refuse_extension(file, "a picture", ".png, .ppm, .pfm, .hdr and .exr");
    return *found;
}

/// Throws UsageError unless the condition holds: films may come from the caller's program.
void require(bool condition, const fs::path& file, const std::string& reason) {
    if (!condition) throw UsageError(fmt::format("{}: {}", file.string(), reason));
}

void require_size(const fs::path& file, const Film& film, std::size_t count, std::size_t channel_count,
                  std::string_view what) {
    require(film.width > 0 && film.height > 0, file, "a picture without pixels cannot be written");
    const std::size_t wanted = std::size_t{film.width} * film.height * channel_count;
    require(count == wanted, file,
            fmt::format("{} has {} values, but {}x{} pixels with {} channels have {}", what, count, film.width,
                        film.height, channel_count, wanted));
}

template <class Encode>
void write_encoded(const fs::path& file, Encode&& encode) {
    Bytes bytes;
    try {
        bytes = encode();
    } catch (const Error& error) {
        throw FileError(file.string(), error.what());
    }
    write_file_atomically(file, bytes);
}

std::vector<float> as_floats(const fs::path& file, const FilmPlane& plane) {
    std::vector<float> values;
    values.reserve(plane.indices.size());
    for (const std::uint32_t index : plane.indices) {
        values.push_back(static_cast<float>(index));
        require(static_cast<double>(values.back()) == static_cast<double>(index), file,
                fmt::format("plane \"{}\" has the value {}, which a float cannot hold exactly; .exr can hold it",
                            plane.name, index));
    }
    return values;
}

void require_plane(const fs::path& file, const Film& film, const FilmPlane& plane) {
    require(!plane.channels.empty(), file, fmt::format("plane \"{}\" has no channels", plane.name));
    require(plane.values.empty() || plane.indices.empty(), file,
            fmt::format("plane \"{}\" holds both floats and integers", plane.name));
    require_size(file, film, std::max(plane.values.size(), plane.indices.size()), plane.channels.size(),
                 fmt::format("plane \"{}\"", plane.name));
}

}  // namespace

void check_image_extension(const fs::path& file) {
    format_of(file);
}

void write_image(const fs::path& file, const Film& film, const ImageOptions& options) {
    const Format& format = format_of(file);
    require_size(file, film, film.pixels.size() * 3, 3, "the picture");
    write_encoded(file, [&] { return format.encode(film, options); });
}

void write_image(const fs::path& file, const Image& image) {
    const std::string extension = extension_of(file);
    if (extension != ".png" && extension != ".ppm") refuse_extension(file, "an image of bytes", ".png and .ppm");
    require(image.width > 0 && image.height > 0, file, "a picture without pixels cannot be written");
    require(image.bytes.size() == std::size_t{3} * image.width * image.height, file,
            fmt::format("the image has {} bytes, but {}x{} pixels have {}", image.bytes.size(), image.width,
                        image.height, std::size_t{3} * image.width * image.height));
    write_encoded(
        file, [&] { return (extension == ".png" ? encode_png : encode_ppm)(image.width, image.height, image.bytes); });
}

void check_layers_extension(const fs::path& file) {
    if (extension_of(file) != ".exr") refuse_extension(file, "a picture with layers", ".exr");
}

void write_layers(const fs::path& file, const Film& film) {
    check_layers_extension(file);
    require_size(file, film, film.pixels.size() * 3, 3, "the picture");
    std::vector<ExrChannel> channels = channels_of_picture(film);
    for (const FilmPlane& plane : film.planes) {
        require_plane(file, film, plane);
        std::vector<ExrChannel> of_plane = channels_of(plane, true);
        channels.insert(channels.end(), of_plane.begin(), of_plane.end());
    }
    write_encoded(file, [&] { return encode_exr(film.width, film.height, std::move(channels)); });
}

void write_plane(const fs::path& file, const Film& film, const FilmPlane& plane) {
    const std::string extension = extension_of(file);
    if (extension != ".exr" && extension != ".pfm") refuse_extension(file, "a plane", ".exr and .pfm");
    require_plane(file, film, plane);
    if (extension == ".exr")
        return write_encoded(file, [&] { return encode_exr(film.width, film.height, channels_of(plane, false)); });

    const std::size_t channel_count = plane.channels.size();
    require(channel_count == 1 || channel_count == 3, file,
            fmt::format("plane \"{}\" has {} channels, and .pfm files have one or three; .exr has any number",
                        plane.name, channel_count));
    const std::vector<float> converted = as_floats(file, plane);
    const std::span<const float> values = plane.indices.empty() ? plane.values : converted;
    write_encoded(file, [&] { return encode_pfm(film.width, film.height, channel_count, values); });
}

}  // namespace castor
