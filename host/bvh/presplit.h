#pragma once

#include <span>
#include <vector>

#include "base/box.h"
#include "base/progress.h"
#include "bvh/primitive_ref.h"
#include "bvh/primitives.h"

namespace castor {

/// Cuts triangles that fill their boxes badly into pieces before the tree is built, which makes about half as many more
/// references at most: the more pieces, the larger the empty part of the box and the coarser the grid planes that cross
/// it. Triangles whose boxes are shorter than `least_side` in every direction stay whole. Cuts are made where such
/// planes are, since a tree cuts there too. Karras, Aila 2013, "Fast Parallel Construction of High-Quality Bounding
/// Volume Hierarchies", §4.2.
///
/// Every point of a triangle, in exact arithmetic, lies in the box of a piece, and every piece's box in that of its
/// triangle. That is enough for hits to stay those of brute force: intersect_triangle finds a t at which the ray is so
/// near to a point of the triangle that it is within the enlarged box of the piece with that point, and so visits its
/// leaf (see there). Returns the new references, in parts, in order.
std::vector<std::vector<PrimitiveRef>> presplit(const Primitives& primitives, std::span<const PrimitiveRef> refs,
                                                float least_side, const Progress& progress = {});

/// The half surface of a triangle's box that boxes around ever smaller pieces of it would not have; 0 for a sphere.
double wasted_half_area(const Primitives& primitives, const PrimitiveRef& ref);

}  // namespace castor
