#pragma once

#include <filesystem>
#include <string>

#include "castor/scene.h"

namespace castor::test {

/// Returns every field of a scene, a line each, without the lines of its file. Images and meshes are written whole.
std::string describe(const Scene& scene);

/// Returns the scene in the JSON of 2025, translated from XML element by element: attributes begin with an underscore,
/// `_data` is the text beside them, and repeated elements are an array.
std::string to_json(const std::string& xml);

}  // namespace castor::test
