#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "castor/built_scene.h"
#include "castor/scene.h"
#include "castor/scene_io.h"
#include "phase.h"
#include "trace/scene_contents.h"

namespace castor::cli {

/// The scene that the command line names as SCENE.
struct SceneInput {
    Scene scene;                      // without its geometry once `built` is set
    std::optional<BuiltScene> built;  // loaded from a file of castor build, or built here
    bool strict = false;              // warnings are errors

    /// Builds the scene unless it is built, and frees the geometry that was read. `programs` are built meanwhile.
    /// Throws SceneError if the scene is strict and there is something to warn of in its geometry.
    void build(const std::vector<Device>& devices, BuildOptions options, bool quiet,
               const ProgramsOfScene& programs = {});

    /// Throws SceneError if the scene is strict and has warnings, so many.
    void refuse_warnings(const std::string& file, std::size_t count) const;

    /// Cuts the scene, which must be built, into chunks for so many processes, and prints what there is to tell of it.
    /// Returns whether chunks had to be cut or trees to be built for it.
    bool divide(const std::vector<Device>& devices, BuildOptions options, std::size_t shares, bool quiet);

    /// Makes a Renderer or a Tracer. The scene must be built.
    template <class User, class Options>
    User make(const std::vector<Device>& devices, const Options& options, bool quiet) const {
        const Phase phase("uploading", quiet);
        return User(*built, devices, options);
    }
};

inline constexpr const char* kSceneHelp =
    "scene (.xml, .json, .gltf, .glb), mesh (.ply, .obj, .stl), or a file of castor build";

/// How a scene is read: whether without progress, and whether its warnings are errors.
struct ReadingOptions {
    bool quiet = false;
    bool strict = false;
    LoadOptions load{};
};
/// Adds --environment, --time, --animation, --material-variant and --sun-angle.
void add_load_options(CLI::App& command, LoadOptions& options);
void add_strict_option(CLI::App& command, bool& strict);

/// Reads a scene file that is not built, and prints its warnings. Throws SceneError.
Scene read_scene(const std::string& file, bool quiet, const LoadOptions& options = {});

/// Reads a scene file or a built scene and prints its warnings. Throws SceneError, and UsageError if the scene is built
/// already and `quality` is not the default, or something is to be added to it. With `strict`, warnings are a
/// SceneError.
SceneInput read_scene_input(const std::string& file, TreeQuality quality, const ReadingOptions& options);

}  // namespace castor::cli
