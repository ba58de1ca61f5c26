#pragma once

#include <vector>

#include "castor/renderer.h"
#include "castor/scene.h"
#include "trace/scene_contents.h"

namespace castor {

/// Returns what tells the programs that a renderer will need for pictures of these cameras with these options: nearly
/// all of them, and none where it will refuse to shade the scene's materials so.
ProgramsOfScene programs_of_pictures(const std::vector<Camera>& cameras, const RenderOptions& options);

}  // namespace castor
