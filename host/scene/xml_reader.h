#pragma once

#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads a scene in the XML format that scenes/README.md describes. Meshes, spheres and planes are in the order of the
/// file; consecutive <Triangle> elements of one material make one mesh. The scene has only the cameras of the
/// file, perhaps none. Throws SceneError with the line.
Scene read_xml_scene(const std::filesystem::path& file, const Progress& progress = {});

}  // namespace castor
