#pragma once

#include <filesystem>

#include "castor/api.h"
#include "castor/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads a scene: the XML format that scenes/README.md describes (.xml), or a mesh alone (.ply, .obj), for which
/// camera, lights and materials are chosen so that the model is seen well. What the reader does not know is named in
/// `Scene::warnings`, with its line.
/// Throws SceneError (file, line or byte, what was found and what was expected) where the file is missing, damaged or
/// wrong. Throws Interrupted where `progress` says so.
CASTOR_API Scene load_scene(const std::filesystem::path& file, const ProgressHook& progress = {});

/// Gives a scene of bare geometry a camera, lights, and a material where it has none. The camera looks at the
/// box of all bounded geometry from a little above, in front (+z) and to the right, and sees all of it; a room that is
/// open on one horizontal side is looked into, straight. The material is clay; light is balanced so that 255 is white
/// on a white surface.
CASTOR_API void add_default_view(Scene& scene);

}  // namespace castor
