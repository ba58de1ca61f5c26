#pragma once

#include "castor/scene.h"

namespace castor {

/// Gives each material that has a PrincipledMaterial what stands in for it under the rules of the courses, until the
/// integrator shades principled materials themselves; and makes lights of meshes that emit. What has no counterpart
/// there is left out, with a warning. Lengths and radiances are as in the scene: 255 is white.
///
/// - An opaque dielectric: a matt base under Torrance and Sparrow's microfacets, with the exponent 2 / alpha^2 - 2 for
///   alpha = roughness^2, and normalised (kd / pi).
/// - A metal, where the mean of `metallic` is at least 1/2: a mirror of the mean base colour, whose rays are scattered
///   by 2 alpha, and microfacets that reflect all.
/// - What transmits more than half is a dielectric; a thin wall, and what is blended by less than half, is one of index
///   1.
/// - Base colours are linear pictures, times their factors and 1 - metallic; normal maps have their y turned.
void stand_in_for_principled(Scene& scene);

}  // namespace castor
