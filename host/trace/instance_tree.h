#pragma once

#include <vector>

#include "base/box.h"
#include "base/column.h"
#include "castor/shared/types.h"
#include "scene/scene_arrays.h"

namespace castor {

/// The tree over all instances but number 0 that place anything: `geometry_boxes` says what each geometry holds, by the
/// boxes of its primitives; an empty one holds nothing. A chunk's geometries hold less, and have the largest_coordinate
/// of the whole ones. Empty if there is no instance. At most CASTOR_MAX_INSTANCE_STACK levels.
Column<shared::InstanceNode> build_instance_tree(const Column<shared::Instance>& instances,
                                                 const Column<shared::Geometry>& geometries,
                                                 const std::vector<Box>& geometry_boxes);

/// The same tree with eight children a node, for strategies that test eight boxes at once: as many levels at most, and
/// no slopes, for which that of the first InstanceNode stands, the greatest. A leaf child is CASTOR_WIDE_LEAF +
/// instance.
Column<shared::WideNode> widen_instance_tree(const Column<shared::InstanceNode>& nodes);

inline Box box_of(const shared::InstanceNode& node) {
    return {make_float4(node.lower[0], node.lower[1], node.lower[2]),
            make_float4(node.upper[0], node.upper[1], node.upper[2])};
}

}  // namespace castor
