#pragma once

#include <vector>

#include "base/box.h"
#include "base/column.h"
#include "bvh/bvh.h"
#include "castor/shared/types.h"
#include "scene/scene_arrays.h"

namespace castor {

/// Boxes that together hold all boxes of a geometry's primitives, or of their pieces; none: it holds nothing.
using BoxCover = std::vector<Box>;

/// Returns the boxes of nodes of the tree that hold all that it holds: as many as `most`, one at least, or fewer where
/// leaves are not many. The largest boxes are opened first.
BoxCover cover_of(const Bvh& bvh, std::size_t most);

/// The tree over all instances but number 0 that place anything: `covers` says what each geometry holds. A placement's
/// box is the one around all boxes of the cover, each turned with it: that of a round scan is up to half as wide again
/// where its one box is turned. A chunk's geometries hold less, and have the largest_coordinate of the whole ones.
/// Empty if there is no instance. At most CASTOR_MAX_INSTANCE_STACK levels.
Column<shared::InstanceNode> build_instance_tree(const Column<shared::Instance>& instances,
                                                 const Column<shared::Geometry>& geometries,
                                                 const std::vector<BoxCover>& covers);

/// The same tree with eight children a node, for strategies that test eight boxes at once: as many levels at most, and
/// no slopes, for which that of the first InstanceNode stands, the greatest. A leaf child is CASTOR_WIDE_LEAF +
/// instance.
Column<shared::WideNode> widen_instance_tree(const Column<shared::InstanceNode>& nodes);

inline Box box_of(const shared::InstanceNode& node) {
    return {make_float4(node.lower[0], node.lower[1], node.lower[2]),
            make_float4(node.upper[0], node.upper[1], node.upper[2])};
}

}  // namespace castor
