// What traced paths take along from bounce to bounce, for CASTOR_LANES lanes (see lanes.cl). It stands in
// path_throughput and path_state, which means other things where paths branch (path_states.lanes.cl).
#include "castor/shared/wave_columns.h"
#include "device/media.lanes.cl"
#include "device/queue.lanes.cl"

typedef struct LANES(PathRecords) {
    LANES(Vectors) throughput;
    Real density;  // with which the ray's direction was drawn, by solid angle; 0: of eye rays and mirrored ones
    // Of the surface that scattered it: the cosine of the direction with its normal; where a tree chooses lights, what
    // packed_normals (light_tree.lanes.cl) made of it, as a float's bits.
    Real cosine;
    Real length;  // of the path, up to the ray's origin
    LANES(Media) media;
} LANES(PathRecords);

CASTOR_INLINE LANES(PathRecords)
    LANES(path_records)(const RenderParams params, const PathParams path, const global float4 *restrict path_throughput,
                        const global uint4 *restrict path_state, const Whole slot)
{
    LANES(PathRecords) record;
    const Real one = (Real)(1.0f);
    record.throughput = LANES(vectors)(one, one, one);
    record.density = record.cosine = record.length = (Real)(0.0f);
    record.media.medium = (Whole)(path.eye_medium);
    record.media.outer = (Whole)(path.eye_outer);
    if ((params.flags & (CASTOR_RENDER_FIRST_BOUNCE | CASTOR_RENDER_RECORDS)) == CASTOR_RENDER_FIRST_BOUNCE)
        return record;
    const LANES(Rows) carried = LANES(gather_rows)(path_throughput, slot);
    record.throughput = LANES(vectors_of_rows)(carried);
    record.media.outer = LANES(as_uint)(carried.w);
    const LANES(Rows) row = LANES(gather_rows)((const global float4 *)path_state, slot);
    record.density = row.x;
    record.cosine = row.y;
    record.media.medium = LANES(as_uint)(row.z);
    record.length = row.w;
    return record;
}

CASTOR_INLINE void LANES(store_path_records)(const LANES(PathRecords) record, const Whole slot, const Mask counts,
                                             global float4 *restrict path_throughput, global uint4 *restrict path_state)
{
    LANES(scatter_rows)
    (record.throughput.x, record.throughput.y, record.throughput.z, LANES(as_float)(record.media.outer), slot, counts,
     path_throughput);
    LANES(scatter_rows)
    (record.density, record.cosine, LANES(as_float)(record.media.medium), record.length, slot, counts,
     (global float4 *)path_state);
}

// Returns what a direction that two ways of sampling can draw counts where the way with the density `own` drew it
// (Veach, Guibas 1995, "Optimally Combining Sampling Techniques", the balance heuristic).
CASTOR_INLINE Real LANES(balance)(const Real own, const Real other)
{
    const Real sum = own + other;
    const Mask is_usual = (sum > 0.0f) & (sum <= FLT_MAX);
    const Real share = LANES(divide)(is_usual ? own : (Real)(1.0f), is_usual ? sum : (Real)(1.0f));
    return is_usual ? share : (Real)(own > other ? (Real)(1.0f) : (Real)(0.0f));
}
