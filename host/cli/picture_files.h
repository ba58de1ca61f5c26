#pragma once

#include <filesystem>
#include <string>

#include "castor/film.h"
#include "castor/renderer.h"
#include "report.h"

namespace castor::cli {

/// Returns the file of a plane beside a picture: STEM.NAME.exr.
std::filesystem::path plane_file(const std::filesystem::path& picture, const std::string& plane);

/// Writes a picture and its planes. Returns the list of the planes' names and files. Throws FileError.
Json write_picture(const std::filesystem::path& picture, const Film& film, RuleSet rules);

}  // namespace castor::cli
