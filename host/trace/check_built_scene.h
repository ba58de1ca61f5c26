#pragma once

#include <string>

#include "base/progress.h"
#include "trace/scene_contents.h"

namespace castor {

/// Checks a scene that was read from a file, in parallel, for all that kernels and host code rely on without looking
/// again: a file whose checksums are right may still hold any values. Throws SceneError with the section, the number of
/// the element, what was found and what was expected.
///
/// After it has returned,
///  - columns that belong together are equally long, and geometries, mesh ranges and primitive numbers divide them
///    without gaps;
///  - every index lies within the column that it is for, and a primitive in a tree within the geometry of the tree;
///  - every tree is one: each node but the root is the child of exactly one node that stands before it, and the tree is
///    no deeper than the stacks of traversal;
///  - enums have a value of theirs, and floats lie in the domain that `flatten` promises (SceneArrays). So trees that
///    are missing can be built, and chunks be cut.
///
/// What only changes hits or the picture is not looked for: boxes of nodes that do not contain what is below them,
/// blocks that hold other vertices than the triangles that they name, vectors that are not quite unit, to_world that is
/// not the inverse of to_object. Nor is the fingerprint compared with the columns: to compute it takes another pass
/// over them and is not possible in chunks; a forged one lets the checkpoint of another scene go on in this one.
/// Cameras are checked when they are used, as those of any scene.
void check_built_scene(const SceneContents& scene, const std::string& file, const Progress& progress = {});

}  // namespace castor
