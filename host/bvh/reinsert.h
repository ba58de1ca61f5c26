#pragma once

#include "base/progress.h"
#include "bvh/bvh.h"

namespace castor {

/// Moves subtrees of a tree to where the surface area heuristic likes them better. A pass looks for the best new
/// sibling of every node, in parallel, and then moves nodes, those first that gain most. There are passes over
/// all nodes, at most four, as long as one is expected to save more than `least_gain` of the sum of all nodes'
/// surfaces; this is estimated from a sample. Before, there are as many over the largest nodes, which need to save a
/// quarter of that. A binned tree of a scanned surface leaves nearly nothing to gain, one of objects or rooms a tenth.
/// Bittner, Hapala, Havran 2013, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies"; Meister, Bittner
/// 2018, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization".
///
/// Leaves keep their primitives. Where something was moved, nodes and primitives are in depth-first order afterwards.
/// The result depends on the tree alone, never on the threads.
void reinsert_nodes(Bvh& bvh, float least_gain, const Progress& progress = {});

}  // namespace castor
