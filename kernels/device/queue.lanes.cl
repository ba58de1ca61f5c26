// Paths in the queue of a wave, and their rays, for CASTOR_LANES lanes (see lanes.cl). The last work-item of a stage
// may have fewer paths than lanes: columns have room for all, but what stands in the places that are left means
// nothing.
#include "device/vector.lanes.cl"

// The smallest t_min of mirror and shadow rays: hits count for t > 0, and the interval of a ray is closed.
#define CASTOR_SMALLEST_T 1e-30f

typedef struct LANES(PathRays) {
    LANES(Vectors) origin;
    Real t_min;
    LANES(Vectors) direction;
    Real t_max;
} LANES(PathRays);

// Returns rays that hit nothing, since their t_max lies before their t_min: for pixels outside the picture, and for
// lights that add nothing.
CASTOR_INLINE LANES(PathRays) LANES(dead_rays)(void)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    LANES(PathRays) ray;
    ray.origin = LANES(vectors)(zero, zero, zero);
    ray.t_min = one;
    ray.direction = LANES(vectors)(zero, zero, one);
    ray.t_max = zero;
    return ray;
}

CASTOR_INLINE LANES(PathRays) LANES(choose_rays)(const Mask is_a, const LANES(PathRays) a, const LANES(PathRays) b)
{
    LANES(PathRays) ray;
    ray.origin = LANES(choose_vectors)(is_a, a.origin, b.origin);
    ray.t_min = is_a ? a.t_min : b.t_min;
    ray.direction = LANES(choose_vectors)(is_a, a.direction, b.direction);
    ray.t_max = is_a ? a.t_max : b.t_max;
    return ray;
}

CASTOR_INLINE void LANES(store_path_rays)(const LANES(PathRays) ray, global float4 *origin_tmin,
                                          global float4 *direction_tmax)
{
    LANES(store_rows)(ray.origin.x, ray.origin.y, ray.origin.z, ray.t_min, origin_tmin);
    LANES(store_rows)(ray.direction.x, ray.direction.y, ray.direction.z, ray.t_max, direction_tmax);
}

// Returns the directions from where rays end back along them.
CASTOR_INLINE LANES(Vectors) LANES(directions_back)(const global float4 *ray_direction)
{
    return LANES(scaled_vectors)(LANES(normalized_vectors)(LANES(load_vectors)(ray_direction)), (Real)(-1.0f));
}

// Tells which of the places place, place + 1 ... are of the queue.
CASTOR_INLINE Mask LANES(is_place)(const uint place, const uint path_count)
{
    return place + LANES(lane_numbers)() < path_count;
}

// Returns the slots of the paths at some places, one after another; where there is none, that of the first, or of the
// last in the queue: of work-items with a path, none reads what belongs to the paths of another.
CASTOR_INLINE Whole LANES(slots)(const RenderParams params, const global uint *path_slot, const uint place,
                                 const Mask is_path)
{
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE) return place + LANES(lane_numbers)();
    const uint known = path_slot[min(place, params.path_count - 1u)];
#if CASTOR_LANES == 1
    return known;
#else
    return is_path ? LANES(load_whole_column)(path_slot + place) : (Whole)(known);
#endif
}

CASTOR_INLINE LANES(Vectors)
    LANES(throughputs)(const RenderParams params, const global float4 *path_throughput, const Whole slot)
{
    const Real one = (Real)(1.0f);
    if (params.flags & CASTOR_RENDER_FIRST_BOUNCE) return LANES(vectors)(one, one, one);
    return LANES(gather_vectors)(path_throughput, slot);
}
