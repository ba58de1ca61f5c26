#pragma once

#include <filesystem>
#include <string>

#include "castor/scene.h"

namespace castor {

/// Returns whether a path leads out of a folder by its text; links are not followed. A scene from elsewhere should not
/// make Castor read other files unnoticed.
bool leads_out_of(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Reads a picture that a scene names. One that cannot be read is two by two texels of magenta and black, and
/// `problem` says why.
Image read_named_picture(const std::filesystem::path& file, std::string& problem);

}  // namespace castor
