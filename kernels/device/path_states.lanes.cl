// Where paths are in the tree of their sample's rays, for CASTOR_LANES lanes (see lanes.cl).
//
// A hit of glass has two children. A slot follows one ray at a time: scatter goes on with the reflected child and puts
// the refracted one on the slot's stack, and where a path ends it takes the ray that was put there last. So the tree is
// walked depth first, and at most max_depth rays of a slot wait. Where the scene has no dielectrics, all paths in the
// queue have the same depth and node, and no state.
#include "castor/shared/wave_columns.h"
#include "device/features.cl"
#include "device/queue.lanes.cl"
#include "device/random.lanes.cl"
#include "device/slots.cl"

// What a path takes along beside its throughput.
typedef struct LANES(PathStates) {
    Whole depth;    // of the ray: bounces before it
    Whole node;     // where the ray ends: see CASTOR_NODE_EYE
    Whole medium;   // material of the dielectric in which the ray is; CASTOR_INVALID_INDEX: in none
    Whole waiting;  // rays on the stack of the slot
} LANES(PathStates);

CASTOR_INLINE LANES(PathStates)
    LANES(path_states)(const RenderParams params, const global uint4 *restrict path_state, const Whole slot)
{
    LANES(PathStates) state;
    state.depth = state.waiting = (Whole)(0);
    state.node = (Whole)(CASTOR_NODE_EYE);
    state.medium = (Whole)(CASTOR_INVALID_INDEX);
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE) return state;
    const LANES(Rows) row = LANES(gather_rows)((const global float4 *)path_state, slot);
    state.depth = LANES(as_uint)(row.x);
    state.node = LANES(as_uint)(row.y);
    state.medium = LANES(as_uint)(row.z);
    state.waiting = LANES(as_uint)(row.w);
    return state;
}

CASTOR_INLINE void LANES(store_path_states)(const LANES(PathStates) state, const Whole slot, const Mask counts,
                                            global uint4 *restrict path_state)
{
    LANES(scatter_rows)
    (LANES(as_float)(state.depth), LANES(as_float)(state.node), LANES(as_float)(state.medium),
     LANES(as_float)(state.waiting), slot, counts, (global float4 *)path_state);
}

// Returns the nodes of paths. `node`: of all of them, where the scene has no dielectrics.
CASTOR_INLINE Whole LANES(nodes_of_paths)(const RenderParams params, const uint node,
                                          const global uint4 *restrict path_state, const Whole slot)
{
    return CASTOR_HAS_DIELECTRICS ? LANES(path_states)(params, path_state, slot).node : (Whole)(node);
}

// Rays that go on from surfaces, with what their paths take along.
typedef struct LANES(Branches) {
    Mask exists;
    LANES(Vectors) origin;
    LANES(Vectors) direction;
    LANES(Vectors) throughput;
    Whole depth, node, medium;
    Whole outer;  // the dielectric around the medium: in which the ray is when it leaves that
} LANES(Branches);

CASTOR_INLINE LANES(Branches) LANES(no_branches)(void)
{
    const LANES(Vectors) zero = LANES(vectors)((Real)(0.0f), (Real)(0.0f), (Real)(0.0f));
    LANES(Branches) branch;
    branch.origin = branch.direction = branch.throughput = zero;
    branch.depth = branch.node = branch.medium = branch.outer = (Whole)(0);
    branch.exists = branch.depth != 0u;
    return branch;
}

CASTOR_INLINE LANES(Branches) LANES(choose_branches)(const Mask is_a, const LANES(Branches) a, const LANES(Branches) b)
{
    LANES(Branches) branch;
    branch.exists = is_a ? a.exists : b.exists;
    branch.origin = LANES(choose_vectors)(is_a, a.origin, b.origin);
    branch.direction = LANES(choose_vectors)(is_a, a.direction, b.direction);
    branch.throughput = LANES(choose_vectors)(is_a, a.throughput, b.throughput);
    branch.depth = is_a ? a.depth : b.depth;
    branch.node = is_a ? a.node : b.node;
    branch.medium = is_a ? a.medium : b.medium;
    branch.outer = is_a ? a.outer : b.outer;
    return branch;
}

// Puts rays on the stacks of their slots, above the `waiting` that are there, where `counts`.
CASTOR_INLINE void LANES(push_branches)(const RenderParams params, const LANES(Branches) branch, const Whole waiting,
                                        const Whole slot, const Mask counts,
                                        global float4 *restrict stack_origin_medium,
                                        global float4 *restrict stack_direction_depth,
                                        global float4 *restrict stack_throughput_node,
                                        global uint *restrict stack_outer)
{
    const Whole row = waiting * slot_count(params) + slot;
    LANES(scatter_rows)
    (branch.origin.x, branch.origin.y, branch.origin.z, LANES(as_float)(branch.medium), row, counts,
     stack_origin_medium);
    LANES(scatter_rows)
    (branch.direction.x, branch.direction.y, branch.direction.z, LANES(as_float)(branch.depth), row, counts,
     stack_direction_depth);
    LANES(scatter_rows)
    (branch.throughput.x, branch.throughput.y, branch.throughput.z, LANES(as_float)(branch.node), row, counts,
     stack_throughput_node);
    LANES(scatter_wholes)(branch.outer, row, counts, stack_outer);
}

// Returns the rays at places of the stacks of their slots.
CASTOR_INLINE LANES(Branches)
    LANES(waiting_branches)(const RenderParams params, const Whole place, const Whole slot, const Mask counts,
                            const global float4 *restrict stack_origin_medium,
                            const global float4 *restrict stack_direction_depth,
                            const global float4 *restrict stack_throughput_node,
                            const global uint *restrict stack_outer)
{
    const Whole row = counts ? place * slot_count(params) + slot : (Whole)(0);
    const LANES(Rows) first = LANES(gather_rows)(stack_origin_medium, row);
    const LANES(Rows) second = LANES(gather_rows)(stack_direction_depth, row);
    const LANES(Rows) third = LANES(gather_rows)(stack_throughput_node, row);
    LANES(Branches) branch;
    branch.exists = counts;
    branch.origin = LANES(vectors_of_rows)(first);
    branch.medium = LANES(as_uint)(first.w);
    branch.direction = LANES(vectors_of_rows)(second);
    branch.depth = LANES(as_uint)(second.w);
    branch.throughput = LANES(vectors_of_rows)(third);
    branch.node = LANES(as_uint)(third.w);
    branch.outer = LANES(gather_wholes)(stack_outer, row, 1);
    return branch;
}
