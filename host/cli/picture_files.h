#pragma once

#include <filesystem>
#include <string>

#include "castor/film.h"
#include "castor/renderer.h"
#include "picture_names.h"
#include "report.h"

namespace castor::cli {

/// Whether planes go to files of their own, STEM.NAME.exr beside the picture, or into the picture's.
enum class PlaneFiles { beside, layers };

/// Returns the file of a plane beside a picture: STEM.NAME.exr.
std::filesystem::path plane_file(const std::filesystem::path& picture, const std::string& plane);

/// What was written beside a picture, for --json.
struct FurtherFiles {
    Json tone_mapped = Json::array();  // the files
    Json planes = Json::array();       // names and files
};

/// Writes a picture, those of its tone maps, and its planes. The picture itself is linear, unless it is the first tone
/// map's. Throws FileError.
FurtherFiles write_picture(const Picture& picture, const Film& film, RuleSet rules, PlaneFiles planes);

}  // namespace castor::cli
