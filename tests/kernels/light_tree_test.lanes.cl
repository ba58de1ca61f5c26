// Chooses lights by a tree, for CASTOR_LANES lanes (see device/lanes.cl). `count` is a multiple of the lanes.
#include "device/light_tree.lanes.cl"

// Rows: points where light is wanted; their normals, where w says whether both sides count; sample points, or with
// `is_drawn` 0 the trail of a light in z. Results: the light's number, the bits of a whole one; its probability; x of
// the normal after packing; what is left of the random number, plus 1 where both sides count.
kernel CASTOR_IN_LANES void LANES(choose_lights_test)(const uint count, const global LightNode *restrict nodes,
                                                      const uint is_drawn, const global float4 *restrict origins,
                                                      const global float4 *restrict normals,
                                                      const global float4 *restrict points,
                                                      global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) row = LANES(load_rows)(points + i), normal = LANES(load_rows)(normals + i);
    const LANES(Receivers) receiver = LANES(receivers)(
        LANES(load_vectors)(origins + i), LANES(packed_normals)(LANES(vectors_of_rows)(normal), normal.w > 0.0f));
    LANES(Points) at;
    at.x = row.x;
    at.y = row.y;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    const LANES(ChosenLights) light =
        LANES(walk_light_tree)(nodes, receiver, all, (int)is_drawn, LANES(as_uint)(row.z), at);
    LANES(store_rows)
    (LANES(as_float)(light.number), light.probability, receiver.normal.x,
     light.rest + (receiver.has_both_sides ? (Real)(1.0f) : (Real)(0.0f)), results + i);
}
