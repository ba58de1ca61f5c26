#pragma once

#include <array>
#include <cstdint>

#include "base/box.h"
#include "base/column.h"
#include "bvh/bvh.h"
#include "castor/shared/types.h"

namespace castor {

/// An 8-wide tree of 80 bytes a node, whose leaves are one to three primitives: for devices on which a work-item leads
/// one ray. Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs".
struct CompressedBvh {
    Column<shared::CompressedNode> nodes;  // the root first; empty if there is no bounded primitive
    Column<std::uint32_t> primitives;      // leaf order -> primitive number
    Column<std::uint32_t> roots;           // of several trees side by side, as `append` leaves them
    std::uint32_t levels = 0;              // nodes on the longest way down; at most CASTOR_MAX_STACK
};

/// Collapses a binary tree to the wide one that costs least where a leaf costs what its primitives do (see Collapse),
/// and compresses it. A child stands at the place whose corner of the node it is nearest to, as far as places go, so
/// that a ray meets near children first (§3.3, with a greedy assignment).
CompressedBvh compress_bvh(const Primitives& primitives, const Bvh& bvh, const Progress& progress = {});

/// Appends the tree to others, and its root, or CASTOR_INVALID_INDEX if it is empty, to `trees.roots`.
void append(CompressedBvh& trees, CompressedBvh&& tree);

/// Writes `origin`, `exponent`, `lower` and `upper` of a node: the tightest grid planes that contain each of the boxes,
/// exactly as a device computes them from the node. Places whose box is empty get a box of no meaning. Coordinates are
/// within CASTOR_MAX_COORDINATE in magnitude.
void compress_boxes(const std::array<Box, 8>& boxes, shared::CompressedNode& node);

/// The box of a child as a device computes it: origin + lower * 2^exponent, one rounding.
Box decompressed_box(const shared::CompressedNode& node, int place);

}  // namespace castor
