#pragma once

#include "castor/tracer.h"
#include "trace/scene_contents.h"

namespace castor {

/// Computes where `ray` meets what `hit` names, see Tracer::find_surfaces. Throws UsageError for a hit that names what
/// the scene has not.
Surface surface_of_hit(const SceneContents& scene, const Ray& ray, const Hit& hit);

}  // namespace castor
