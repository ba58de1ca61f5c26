#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "castor/scene.h"

namespace castor::cli {

/// A camera by its place in the scene, counted from 1 as people do, and the file of its picture.
struct Picture {
    std::size_t camera_number = 1;
    std::filesystem::path file;
};

/// One picture for each of the cameras. `output` is what follows -o:
/// - empty or a folder (it exists as one, or ends with '/'): the camera's image name, without any folder that it names,
/// in that folder;
///   a camera without a usable name gets the scene's stem and .png, with its number if there are several cameras;
/// - a file: that one, with the camera's number before the extension if there are several.
/// Names that would be equal, or have equal stems if `stems_must_differ`, get the camera's number.
/// A name that is changed is told in a warning. Throws UsageError where `output` has no known extension.
std::vector<Picture> name_pictures(const Scene& scene, const std::vector<std::size_t>& camera_numbers,
                                   const std::string& output, bool stems_must_differ, std::vector<Warning>& warnings);

/// Whether `output` names a folder.
bool is_folder(const std::string& output);

}  // namespace castor::cli
