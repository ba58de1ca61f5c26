#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "castor/tracer.h"

namespace castor::cli {

/// Reads rays: eight little-endian float32 each (origin xyz, t_min, direction xyz, t_max). An empty file has no rays.
/// Throws SceneError if the file cannot be read or its size is not a multiple of 32 bytes.
std::vector<Ray> read_rays(const std::filesystem::path& file);

/// Writes hits: twenty bytes each, little-endian (t, u, v as float32; primitive, instance as uint32). A miss has
/// t = +infinity and primitive = instance = 0xffffffff. An old file is replaced only by a complete one. Throws
/// FileError.
void write_hits(const std::filesystem::path& file, std::span<const Hit> hits);

}  // namespace castor::cli
