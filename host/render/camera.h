#pragma once

#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

/// The camera as `generate_rays` reads it. `scene_file` is for messages.
/// Throws SceneError for a zero or non-finite gaze or up, up parallel to gaze, no pixels or more than 65536 in a direction, an empty window, a
/// distance that is not positive, or NaN anywhere.
shared::Camera make_camera(const Camera& camera, const std::string& scene_file);

}  // namespace castor
