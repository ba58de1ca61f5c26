#pragma once

#include <filesystem>

#include "castor/api.h"
#include "castor/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads a scene: the format that scenes/README.md describes, in XML or JSON (.xml, .json), or a mesh alone (.ply,
/// .obj), for which add_default_view chooses camera, lights and material. `Scene::warnings` names what the reader
/// does not know, with its line. Throws SceneError if the file is missing, damaged or wrong, with file, line or byte,
/// the value found and the values expected. Throws Interrupted if `progress` returns false.
CASTOR_API Scene load_scene(const std::filesystem::path& file, const ProgressHook& progress = {});

/// Adds a camera and lights to a scene of bare geometry, and a material if it has none. The camera sees the whole box
/// of all bounded geometry, from a little above, in front (+z) and to the right; into a room that is open on one
/// horizontal side it looks straight. The material is clay. The light makes a white surface 255.
CASTOR_API void add_default_view(Scene& scene);

}  // namespace castor
