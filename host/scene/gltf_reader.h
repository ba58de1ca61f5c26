#pragma once

#include <filesystem>
#include <optional>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads a glTF 2.0 file, `.gltf` or `.glb`, in its rest pose, or as its first animation has it at a time. Materials
/// are principled ones alone; cameras and lights are those of the file. Throws SceneError with the JSON path, what was
/// found and what was expected.
Scene read_gltf(const std::filesystem::path& file, const Progress& progress = {},
                std::optional<double> time_seconds = std::nullopt);

}  // namespace castor
