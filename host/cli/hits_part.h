#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "castor/tracer.h"
#include "ray_file.h"

namespace castor::cli {

/// The answers to some of a file's rays, one after another, equally many of each ray.
struct HitsPart {
    std::string description;      // all that the answers depend on, a line each: its name, a blank, its value
    std::uint64_t ray_count = 0;  // of the whole file
    std::uint64_t first_ray = 0;
    std::uint64_t rays = 0;  // of the part
    RayAnswers answers;

    std::uint64_t hits_per_ray() const { return rays == 0 ? 0 : answers.hits.size() / rays; }
    bool counts() const { return !answers.counts.empty(); }
};

/// Returns HitsPart::description of rays in a scene with this fingerprint.
std::string describe_batch(std::uint64_t scene_fingerprint, std::span<const Ray> rays, const std::string& query,
                           bool cull_back_faces);

/// Writes a file of sections (see base/section_file.h), replaced in one step. Throws FileError.
void save_hits_part(const std::filesystem::path& file, const HitsPart& part);
/// Throws SceneError where the file is missing, damaged, or of another kind or version.
HitsPart load_hits_part(const std::filesystem::path& file);
/// Returns whether a file begins as one that save_hits_part wrote.
bool is_hits_part(const std::filesystem::path& file);

/// Joins parts that have each ray once at least to the part that has all. Throws SceneError where one is of another
/// batch of rays than the first or rays are in none, DeviceError where two have other answers for one ray.
HitsPart merge_hits(const std::vector<std::filesystem::path>& files);

}  // namespace castor::cli
