// Makes rays of a caller's columns ready in a group, CASTOR_LANES at a time (see lanes.cl): 8 or 16.
#include "device/intersect_box.lanes.cl"
#include "device/ray_group.cl"
#include "device/rows.lanes.cl"
#include "device/store_rays.lanes.cl"

// Loads the first CASTOR_LANES rows of a column that are `stride` rows apart; the last of `count` again where there are
// fewer.
CASTOR_INLINE LANES(Rows) LANES(load_ray_rows)(const global float4 *rows, const uint count, const uint stride)
{
#if CASTOR_LANES == 16
    if (count >= 16 && stride == 1) return load_rows16(rows);
    return gather_rows16(rows, min(lane_numbers16(), count - 1) * stride);
#else
    float4 row[CASTOR_LANES];
    for (uint i = 0; i < CASTOR_LANES; ++i) row[i] = rows[min(i, count - 1) * stride];
    return rows_of_array8(row);
#endif
}

// Stores rays that can hit nothing at places [place, place + CASTOR_LANES): what write_answers reads of them.
CASTOR_INLINE void LANES(store_misses)(RayGroup *group, const uint place, const Real t_scale)
{
    LANES(store_wholes)((Whole)(CASTOR_INVALID_INDEX), group->best_primitive + place);
    LANES(store_reals)(t_scale, group->t_scale + place);
#if CASTOR_HAS_INSTANCES
    LANES(store_wholes)((Whole)(0), group->best_instance + place);
#endif
}

// Tells which rays meet the box, by the test of the nodes in it: what is in the box is met by no other ray.
CASTOR_INLINE Mask LANES(meets_bounds)(const LANES(TraceRay) rays, const Bounds bounds)
{
    const LANES(Slabs) slabs = LANES(slabs_of_rays)(rays);
    const LANES(BoxPlanes) planes =
        LANES(box_planes)(slabs, (Real)(bounds.lower.x), (Real)(bounds.lower.y), (Real)(bounds.lower.z),
                          (Real)(bounds.upper.x), (Real)(bounds.upper.y), (Real)(bounds.upper.z));
    const LANES(Interval) interval = LANES(slab_test)(slabs, planes, rays.t_min, rays.t_max);
    return interval.entry <= interval.exit;
}

// Adds rays begin, begin + 1 ... of the columns at the places from `place` on. Those from ray `end` on are not valid,
// and, where all that can be hit has bounds, those that pass these by.
CASTOR_INLINE void LANES(add_rays)(RayGroup *group, const uint place, const TraceParams params, const Bounds bounds,
                                   const uint begin, const uint end, const global float4 *restrict ray_origin_tmin,
                                   const global float4 *restrict ray_direction_tmax)
{
    const uint count = end > begin ? end - begin : 0;
    const size_t row = (size_t)(count ? begin : end - 1) * params.ray_stride;
    const uint rows = max(count, 1u);
    const LANES(Rows) origin = LANES(load_ray_rows)(ray_origin_tmin + row, rows, params.ray_stride);
    const LANES(Rows) direction =
        LANES(load_ray_rows)(ray_direction_tmax + row + params.direction_offset, rows, params.ray_stride);
    const Mask is_there = LANES(lane_numbers)() < count;
    const Mask is_ray = is_there & (origin.w <= direction.w);
    if (!LANES(mask_of)(is_ray)) {  // as many shadow rays of a picture are, where its eye rays met nothing
        LANES(store_misses)(group, place, (Real)(1.0f));
        return;
    }
    LANES(TraceRay) rays;
    rays.origin_x = origin.x;
    rays.origin_y = origin.y;
    rays.origin_z = origin.z;
    rays.t_min = origin.w;
    rays.direction_x = direction.x;
    rays.direction_y = direction.y;
    rays.direction_z = direction.z;
    rays.t_max = direction.w;
    rays = LANES(prepare_ray)(rays, is_there, params.largest_coordinate);
#if CASTOR_ALL_IS_BOUNDED
    rays.valid &= LANES(meets_bounds)(rays, bounds);
    if (!LANES(mask_of)(rays.valid)) {  // as many rays are that leave the scene
        LANES(store_misses)(group, place, rays.t_scale);
        return;
    }
#endif
    group->valid |= LANES(mask_of)(rays.valid) << place;
    LANES(store_rays)(group, place, rays);
}
