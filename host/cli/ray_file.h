#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "castor/tracer.h"

namespace castor::cli {

/// Reads rays: eight little-endian float32 each (origin xyz, t_min, direction xyz, t_max). An empty file has no rays.
/// Throws SceneError if the file cannot be read or its size is not a multiple of 32 bytes.
std::vector<Ray> read_rays(const std::filesystem::path& file);

/// What a query gives for rays, ray by ray.
struct RayAnswers {
    std::vector<std::uint32_t> counts;  // of crossings; empty where the query does not count them
    std::vector<Hit> hits;              // one a ray, the first crossings, or all of them
};

/// Writes the counts, four bytes each, then the hits: twenty bytes each, little-endian (t, u, v as float32; primitive,
/// instance as uint32). A miss has t = +infinity and primitive = instance = 0xffffffff. An old file is replaced only by
/// a complete one. Throws FileError.
void write_answers(const std::filesystem::path& file, const RayAnswers& answers);

}  // namespace castor::cli
