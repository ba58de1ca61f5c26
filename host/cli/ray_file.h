#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "castor/tracer.h"

namespace castor::cli {

/// Little-endian float32, eight a ray: origin xyz, t_min, direction xyz, t_max. An empty file has no rays.
/// Throws SceneError if the file cannot be read or is no multiple of 32 bytes long.
std::vector<Ray> read_rays(const std::filesystem::path& file);

/// Twenty bytes a ray: t, u, v as float32, primitive, instance as uint32, little-endian. A miss has t = +infinity and
/// primitive = instance = 0xffffffff. Throws FileError; an old file is lost only to a complete one.
void write_hits(const std::filesystem::path& file, std::span<const Hit> hits);

}  // namespace castor::cli
