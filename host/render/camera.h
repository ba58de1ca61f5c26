#pragma once

#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

/// Converts a camera to what `generate_rays` reads. `scene_file` is for messages.
/// Throws SceneError for a zero or non-finite gaze or up, up parallel to gaze, no pixels or more than 65536 in a
/// direction, a window that is empty or reaches beyond 1e15, an image plane nearer than 1e-15 or farther than 1e15, a
/// lens larger than CASTOR_MAX_COORDINATE or focused nearer than 1e-15 or farther than 1e15, or NaN anywhere.
shared::Camera make_camera(const Camera& camera, const std::string& scene_file);

}  // namespace castor
