#pragma once

#include <filesystem>

#include "castor/api.h"
#include "castor/film.h"

namespace castor {

/// How a value becomes one of 256: both limit it to [0, 255]; NaN becomes 0.
enum class Quantization { round, truncate };

struct ImageOptions {
    Quantization quantization = Quantization::round;
};

/// Writes the film's pixels in the format that the extension names: .png (8 bits), .ppm (ASCII P3 as the course's; 8
/// bits), .pfm, .hdr, .exr (linear, the film's own values, unlimited; HDR stores 8-bit mantissas). Written to a
/// temporary file beside it and renamed, so that an existing file is lost only to a complete one. Throws UsageError for
/// another extension, FileError where writing fails.
CASTOR_API void write_image(const std::filesystem::path& file, const Film& film, const ImageOptions& options = {});

/// Throws UsageError (listing the extensions) unless write_image knows the extension. For checking before rendering.
CASTOR_API void check_image_extension(const std::filesystem::path& file);

/// Writes one plane: .exr (floats, or unsigned integers), .pfm (one or three channels of floats; integers are
/// converted, and refused where a float cannot hold one exactly). Throws UsageError, FileError.
CASTOR_API void write_plane(const std::filesystem::path& file, const Film& film, const FilmPlane& plane);

}  // namespace castor
