#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/scene.h"

namespace castor {

/// Scenes that are generated for measuring, each with its own difficulty.
enum class GeneratedKind {
    scan,       // a bumpy closed surface of even small triangles, as a scanner gives it
    interior,   // a hall with columns, beams and blinds: long thin triangles
    objects,    // many small separate objects
    spheres,    // spheres of different sizes
    instances,  // one scan, placed often
};

struct GeneratedScene {
    GeneratedKind kind = GeneratedKind::scan;
    std::uint32_t primitive_count = 0;  // about so many, of instances those of the scan; 0: the kind's own number
    std::uint32_t instance_count = 0;   // of instances alone; 0: their own number
};

/// "scan", "interior", "objects" or "spheres", with ":COUNT" or without, or "instances", with ":INSTANCES" or
/// ":INSTANCESxCOUNT" or without. Empty: not such a word. Throws UsageError where a count is no number from 100 to
/// 100000000, or that of instances none from 1 to 1000000.
std::optional<GeneratedScene> generated_scene_from_string(std::string_view word);

/// All kinds but instances, each with its own number of primitives, "KIND:COUNT". "standard" is for measuring, "small"
/// for trying. Throws UsageError for any other word.
std::vector<std::string> scene_set(std::string_view word);

/// The same arguments give the same scene on every machine, but for rounding in the library's sine and cosine.
Scene generate_scene(const GeneratedScene& generated);

/// Writes the scene's geometry for other programs: a mesh as a PLY file, spheres as XML, instances as XML beside the
/// PLY file of their mesh. Returns the scene file's name, which is `stem` with the extension. Primitives keep their
/// numbers and every coordinate its bits. Throws FileError.
std::filesystem::path save_generated_scene(const std::filesystem::path& stem, const Scene& scene);

}  // namespace castor
