// Where branches are in the tree of their sample's rays, for CASTOR_LANES lanes (see lanes.cl).
//
// A hit of glass has two children: the tree of a sample's rays branches. It is walked level by level, so that all
// branches of a level, of all samples, are traced side by side. Each has a number within its level. At level 0 it is
// the slot of the sample. The children of the branch at a place of the queue have the numbers `place` (reflected) and
// row_length + place (refracted). path_slot has the numbers of branches (CASTOR_RENDER_BRANCHES), and what a path takes
// along stands at these. Where a level has more branches than the queue has places, one part of them after another is
// followed to its leaves, so that no more than two queues of each level are kept.
//
// A branch has a sum of its own, to which add_branches adds those of its children when these are known: the reflected
// one first. So a sample's sum does not depend on which branches were traced side by side.
//
// Where the scene has no dielectrics, all paths in the queue have the same node, and no state.
#include "castor/shared/wave_columns.h"
#include "device/features.cl"
#include "device/media.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/random.lanes.cl"

// What a branch takes along beside its throughput.
typedef struct LANES(PathStates) {
    Whole slot;  // of the sample
    Whole node;  // where the ray ends: see CASTOR_NODE_EYE
    LANES(Media) media;
} LANES(PathStates);

// `branch`: the numbers of branches. Where there is no path, the slot is 0 and the rest means nothing.
CASTOR_INLINE LANES(PathStates) LANES(path_states)(const RenderParams params, const global uint4 *restrict path_state,
                                                   const Whole branch, const Mask is_path)
{
    LANES(PathStates) state;
    state.slot = branch;
    state.node = (Whole)(CASTOR_NODE_EYE);
    state.media.medium = state.media.outer = (Whole)(CASTOR_INVALID_INDEX);
    if (!(params.flags & CASTOR_RENDER_BRANCHES)) return state;
    const LANES(Rows) row = LANES(gather_rows)((const global float4 *)path_state, branch);
    state.slot = is_path ? LANES(as_uint)(row.x) : (Whole)(0);
    state.node = LANES(as_uint)(row.y);
    state.media.medium = LANES(as_uint)(row.z);
    state.media.outer = LANES(as_uint)(row.w);
    return state;
}

// Returns the slots of paths, of which path_slot says `slot`.
CASTOR_INLINE Whole LANES(slots_of_samples)(const RenderParams params, const global uint4 *restrict path_state,
                                            const Whole slot, const Mask is_path)
{
    return LANES(path_states)(params, path_state, slot, is_path).slot;
}

// Returns the nodes of paths. `node`: of all of them, where the scene has no dielectrics.
CASTOR_INLINE Whole LANES(nodes_of_paths)(const RenderParams params, const uint node,
                                          const global uint4 *restrict path_state, const Whole slot, const Mask is_path)
{
    return CASTOR_HAS_DIELECTRICS ? LANES(path_states)(params, path_state, slot, is_path).node : (Whole)(node);
}

// Rays that go on from surfaces, with what their paths take along.
typedef struct LANES(Branches) {
    Mask exists;
    LANES(Vectors) origin;
    LANES(Vectors) direction;
    LANES(Vectors) throughput;
    Whole node;  // see PathStates
    LANES(Media) media;
} LANES(Branches);

CASTOR_INLINE LANES(Branches) LANES(no_branches)(void)
{
    const LANES(Vectors) zero = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    LANES(Branches) branch;
    branch.origin = branch.direction = branch.throughput = zero;
    branch.node = branch.media.medium = branch.media.outer = (Whole)(0);
    branch.exists = branch.node != 0u;
    return branch;
}

// Stores the rays of branches at place, place + 1 ..., and next_rank: 0; CASTOR_PATH_ENDED where there is none.
CASTOR_INLINE void LANES(store_rays_of_branches)(const LANES(Branches) branch, const uint place,
                                                 global float4 *next_origin_tmin, global float4 *next_direction_tmax,
                                                 global uchar *next_rank)
{
    LANES(store_bytes)(branch.exists ? (Whole)(0) : (Whole)(CASTOR_PATH_ENDED), next_rank + place);
    if (!LANES(mask_of)(branch.exists)) return;
    LANES(PathRays) ray;
    ray.origin = branch.origin;
    ray.t_min = (Real)(CASTOR_SMALLEST_T);
    ray.direction = branch.direction;
    ray.t_max = (Real)(INFINITY);
    LANES(store_path_rays)(ray, next_origin_tmin + place, next_direction_tmax + place);
}

#if CASTOR_HAS_DIELECTRICS
// Stores what branches at place, place + 1 ... take along. `slot`: of their samples.
CASTOR_INLINE void LANES(store_states_of_branches)(const LANES(Branches) branch, const Whole slot, const uint place,
                                                   global float4 *next_throughput, global uint4 *next_state)
{
    if (!LANES(mask_of)(branch.exists)) return;
    LANES(store_vectors)(branch.throughput, next_throughput + place);
    LANES(store_rows)
    (LANES(as_float)(slot), LANES(as_float)(branch.node), LANES(as_float)(branch.media.medium),
     LANES(as_float)(branch.media.outer), (global float4 *)(next_state + place));
}
#endif
