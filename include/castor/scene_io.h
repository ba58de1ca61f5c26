#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "castor/api.h"
#include "castor/progress.h"
#include "castor/scene.h"

namespace castor {

/// What is added to a scene, or chosen, when it is read.
struct LoadOptions {
    /// A picture of light from all directions, in which 1 is white; empty: none. No other light is added then.
    std::filesystem::path environment{};
    /// The time that a glTF file's animation is shown at; without it, the rest pose. Other files have no time:
    /// UsageError.
    std::optional<double> time_seconds{};
    /// Which animations are shown at that time: a number from 1 on; a name, which means all that have it; or "all".
    /// They are applied in the file's order: the last one that moves something counts. Without it, the first.
    /// UsageError if there is no such animation, or no time.
    std::optional<std::string> animation{};
    /// Which of a glTF file's material variants is shown: a number from 1 on or a name. Without it, what the file shows
    /// without any. Other files have no variants: UsageError; as if there is no such variant.
    std::optional<std::string> material_variant{};
    /// Under how many radians the directional lights are seen, 0 to pi; without it, as the file says, and glTF says
    /// nothing. UsageError if the scene has no such light.
    std::optional<float> sun_angle_radians{};
};

/// Reads a scene: the format that scenes/README.md describes, in XML or JSON (.xml, .json), glTF 2.0 (.gltf, .glb), or
/// a mesh alone (.ply, .obj, .stl), for which add_default_view chooses camera, lights and material. `Scene::warnings`
/// names what the reader does not know, with its line. Throws SceneError if the file is missing, damaged or wrong, with
/// file, line or byte, the value found and the values expected. Throws Interrupted if `progress` returns false.
CASTOR_API Scene load_scene(const std::filesystem::path& file, const ProgressHook& progress = {});
CASTOR_API Scene load_scene(const std::filesystem::path& file, const LoadOptions& options,
                            const ProgressHook& progress = {});

/// Adds a camera and lights to a scene of bare geometry, and a material if it has none. The camera sees the whole box
/// of all bounded geometry, from a little above, in front (+z) and to the right; into a room that is open on one
/// horizontal side it looks straight. The material is clay. The light makes a white surface 255.
CASTOR_API void add_default_view(Scene& scene);

}  // namespace castor
