#pragma once

#include <filesystem>

#include "castor/api.h"
#include "castor/film.h"

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

/// Throws UsageError, listing the extensions, unless write_image knows the extension. Programs call it before
/// rendering.
CASTOR_API void check_image_extension(const std::filesystem::path& file);

/// Writes one plane of the film: .exr (floats or unsigned integers) or .pfm (one or three channels of floats). For
/// .pfm, integers are converted; one that no float holds exactly is refused. Throws UsageError, FileError.
CASTOR_API void write_plane(const std::filesystem::path& file, const Film& film, const FilmPlane& plane);

}  // namespace castor
