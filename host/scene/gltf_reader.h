#pragma once

#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"
#include "castor/scene_io.h"

namespace castor {

/// Reads a glTF 2.0 file, `.gltf` or `.glb`, in its rest pose, or as animations have it at the time of the options, of
/// which only `time_seconds`, `animation` and `material_variant` are used. Materials are principled ones alone; cameras
/// and lights are those of the file. Throws SceneError with the JSON path, what was found and what was expected;
/// UsageError if there is no such animation or variant.
Scene read_gltf(const std::filesystem::path& file, const Progress& progress = {}, const LoadOptions& options = {});

}  // namespace castor
