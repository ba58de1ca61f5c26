#pragma once

#include <optional>
#include <string>

#include "castor/built_scene.h"
#include "castor/scene.h"

namespace castor::cli {

/// What the command line names as SCENE.
struct SceneInput {
    Scene scene;                      // of a built scene without its geometry
    std::optional<BuiltScene> built;  // where the file is one of castor build

    /// A Renderer or Tracer of it.
    template <class User, class Options>
    User make(const std::vector<Device>& devices, const Options& options) const {
        return built ? User(*built, devices, options) : User(scene, devices, options);
    }
};

inline constexpr const char* kSceneHelp = "scene (.xml), mesh (.ply, .obj), or what castor build wrote";

/// Reads the file and prints the scene's warnings. Throws SceneError; UsageError if the scene is built already and `quality` is not the
/// default.
SceneInput read_scene_input(const std::string& file, TreeQuality quality = TreeQuality::medium);

}  // namespace castor::cli
