#pragma once

#include "scene/gltf_document.h"
#include "scene/gltf_nodes.h"

namespace castor {

/// What 1 of a glTF file's radiances is in a Scene, where 255 is white.
inline constexpr float kGltfWhite = 255.0f;

/// Adds the cameras of the nodes that the file's scene shows. Throws SceneError.
void read_gltf_cameras(GltfDocument& document, const GltfNodes& nodes, Scene& scene);

/// Adds the lights (KHR_lights_punctual) of the nodes that the file's scene shows. Throws SceneError.
void read_gltf_lights(GltfDocument& document, const GltfNodes& nodes, Scene& scene);

}  // namespace castor
