#pragma once

#include <optional>
#include <string>

#include "castor/built_scene.h"
#include "castor/scene.h"
#include "phase.h"

namespace castor::cli {

/// What the command line names as SCENE.
struct SceneInput {
    Scene scene;                      // once it is built without its geometry
    std::optional<BuiltScene> built;  // by castor build, or here

    /// Builds it unless it is built, and lets the geometry that was read go.
    void build(const std::vector<Device>& devices, BuildOptions options, bool quiet);

    /// A Renderer or Tracer of it; it is built.
    template <class User, class Options>
    User make(const std::vector<Device>& devices, const Options& options, bool quiet) const {
        const Phase phase("uploading", quiet);
        return User(*built, devices, options);
    }
};

inline constexpr const char* kSceneHelp = "scene (.xml), mesh (.ply, .obj), or what castor build wrote";

/// Reads a scene that is not built, and prints its warnings. Throws SceneError.
Scene read_scene(const std::string& file, bool quiet);

/// Reads the file and prints the scene's warnings. Throws SceneError; UsageError if the scene is built already and
/// `quality` is not the default.
SceneInput read_scene_input(const std::string& file, TreeQuality quality, bool quiet);

}  // namespace castor::cli
