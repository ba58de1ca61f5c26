#pragma once

#include <cstdint>
#include <filesystem>

#include "castor/api.h"
#include "castor/film.h"
#include "castor/scene.h"

namespace castor {

/// How a value becomes one of 256 integers. Both ways clamp it to [0, 255]; NaN becomes 0.
enum class Quantization { round, truncate };

struct ImageOptions {
    Quantization quantization = Quantization::round;
};

/// Writes the film's pixels in the format that the extension names: .png and .ppm (ASCII P3) with 8 bits, .pfm, .hdr
/// and .exr with the film's own linear, unlimited values (HDR stores 8-bit mantissas). Writes a temporary file beside
/// the target and renames it, so that only a complete file replaces an existing one. Throws UsageError for another
/// extension, and FileError if writing fails.
CASTOR_API void write_image(const std::filesystem::path& file, const Film& film, const ImageOptions& options = {});

/// Writes an image of bytes, such as apply_tone_map returns, as .png or .ppm; otherwise the same.
CASTOR_API void write_image(const std::filesystem::path& file, const Image& image);

/// Throws UsageError, listing the extensions, unless write_image knows the extension. Programs call it before
/// rendering.
CASTOR_API void check_image_extension(const std::filesystem::path& file);

/// Writes one plane of the film: .exr (floats or unsigned integers) or .pfm (one or three channels of floats). For
/// .pfm, integers are converted; one that no float holds exactly is refused. Throws UsageError, FileError.
CASTOR_API void write_plane(const std::filesystem::path& file, const Film& film, const FilmPlane& plane);

/// Writes the film's linear values and all of its planes into one .exr, as layers: the channels R, G and B, and those
/// of each plane after its name and a dot, such as normal.X; or primitive alone, where both are the same. Otherwise as
/// write_image.
CASTOR_API void write_layers(const std::filesystem::path& file, const Film& film);

/// Throws UsageError unless write_layers knows the extension.
CASTOR_API void check_layers_extension(const std::filesystem::path& file);

/// The texels that a picture may have which is read: 16384 x 8192.
constexpr std::uint64_t kMaxTexels = std::uint64_t{1} << 27;

/// Reads a picture: PNG, JPEG, WebP, BMP and TGA become `Image::bytes`, Radiance HDR and OpenEXR `Image::floats`. The
/// first bytes tell the format, not the name; TGA, which has no mark, must be named .tga. Grey becomes three equal
/// values, alpha is kept where it is not 255 everywhere, and of 16 bits the upper 8 are kept. WebP: one picture, where
/// the build has libwebp. OpenEXR: one picture in lines, not tiled, with R, G and B, or Y, or one channel alone. Throws
/// SceneError for a file that is missing, broken, ends too early, has more than kMaxTexels texels, or has values that
/// are not finite.
CASTOR_API Image read_image(const std::filesystem::path& file);

}  // namespace castor
