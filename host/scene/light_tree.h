#pragma once

#include <span>
#include <string>

#include "castor/scene.h"
#include "scene/scene_arrays.h"

namespace castor {

/// The tree down which a path chooses the light to which it sends a ray (kernels/device/light_tree.lanes.cl; Conty
/// Estevez, Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting").
///
/// Lights with a place, and those without, have a tree each, joined at the root where there are both. A tree is built
/// from the top, by the surface area orientation heuristic of that paper (section 4.4) over 12 bins an axis, with the
/// square of a box's diagonal in place of its area, so that lamps in a row are told apart, too. Where no bin separates
/// the lights, or the depth would exceed CASTOR_LIGHT_LEVELS, halves have as many. All children follow their parents,
/// in pairs; a tree of n lights has 2n - 1 nodes. It is the same however many threads build it.
///
/// The flux of a light is the irradiance at a distance of 1, all channels' mean: of a point or spot light its
/// intensity; of a flat surface its radiance times its area; of other surfaces this times the mean cosine within the
/// cone of their normals, and the mean of a texture of emission; of a sphere its radiance times the area of its disc.
/// Of a directional light it is the irradiance, of an environment pi times the mean radiance.

/// Makes the column light_nodes for the scene's lights, and says in them where they
/// are in the tree. Fewer than two lights have no tree. `images`: Scene::images, for environments.
void build_light_tree(SceneArrays& arrays, std::span<const Image> images);

/// Returns what is wrong with the tree over the lights of a scene; empty: nothing. A tree that is right leads to each
/// light once, by the way that the light says.
std::string problem_of_light_tree(const SceneArrays& arrays);

}  // namespace castor
