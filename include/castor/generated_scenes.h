#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/api.h"
#include "castor/scene.h"

namespace castor {

/// Kinds of scenes that are generated for measuring, each with its own difficulty.
enum class GeneratedKind {
    scan,       // a bumpy closed surface of even small triangles, as a scanner gives it
    interior,   // a hall with columns, beams and blinds: long thin triangles
    objects,    // many small separate objects
    spheres,    // spheres of different sizes
    instances,  // one scan, placed often
};

struct GeneratedScene {
    GeneratedKind kind = GeneratedKind::scan;
    std::uint32_t primitive_count = 0;  // approximate; for `instances`, of the scan; 0: the kind's default
    std::uint32_t instance_count = 0;   // for `instances` alone; 0: the default
};

/// Parses "scan", "interior", "objects" or "spheres", each with ":COUNT" or without, or "instances", with ":INSTANCES"
/// or ":INSTANCESxCOUNT" or without. Returns nullopt for any other word. Throws UsageError unless a count is a number
/// from 100 to 100000000, and the number of instances one from 1 to 1000000.
CASTOR_API std::optional<GeneratedScene> generated_scene_from_string(std::string_view word);

/// Returns "KIND:COUNT" for all kinds but `instances`, with the counts of the set: "standard" is for measuring, "small"
/// for trying. Throws UsageError for any other word.
CASTOR_API std::vector<std::string> scene_set(std::string_view word);

/// Generates a scene. The same arguments give the same scene on every machine, except for rounding in the standard
/// library's sine and cosine.
CASTOR_API Scene generate_scene(const GeneratedScene& generated);

/// Writes the scene's geometry for other programs: a mesh as a PLY file, spheres as XML, instances as XML beside the
/// PLY file of their mesh. Returns the scene file's name: `stem` with an extension. Primitives keep their numbers, and
/// coordinates their bits. Throws FileError.
CASTOR_API std::filesystem::path save_generated_scene(const std::filesystem::path& stem, const Scene& scene);

}  // namespace castor
