// Sixteen rays made ready for traversal side by side, in columns: make_trace_ray for eight at a time, in the same order
// and so with the same bits.
//
// A pointer to one ray is the group's, moved on by the ray's place: element 0 of each column is then the ray's
// (ray_of_group).
#include "castor/shared/layout.h"
#include "device/instances.cl"
#include "device/simd.cl"

#define CASTOR_GROUP_RAYS 16u

typedef struct RayGroup {
    float inverse_x[CASTOR_GROUP_RAYS], inverse_y[CASTOR_GROUP_RAYS],
        inverse_z[CASTOR_GROUP_RAYS];  // slabs along the world's axes: see TraceRay
    float entry_x[CASTOR_GROUP_RAYS], entry_y[CASTOR_GROUP_RAYS], entry_z[CASTOR_GROUP_RAYS];
    float exit_x[CASTOR_GROUP_RAYS], exit_y[CASTOR_GROUP_RAYS], exit_z[CASTOR_GROUP_RAYS];
    float t_min[CASTOR_GROUP_RAYS], t_max[CASTOR_GROUP_RAYS], t_scale[CASTOR_GROUP_RAYS];
    float origin_x[CASTOR_GROUP_RAYS], origin_y[CASTOR_GROUP_RAYS],
        origin_z[CASTOR_GROUP_RAYS];  // along the permuted axes
    float shear_x[CASTOR_GROUP_RAYS], shear_y[CASTOR_GROUP_RAYS], shear_z[CASTOR_GROUP_RAYS];  // x and y negated
    uint kx[CASTOR_GROUP_RAYS], ky[CASTOR_GROUP_RAYS], kz[CASTOR_GROUP_RAYS];  // axes that become x, y, z
    uint near_x[CASTOR_GROUP_RAYS], near_y[CASTOR_GROUP_RAYS],
        near_z[CASTOR_GROUP_RAYS];  // bytes to the near planes in a WideNode; the far ones are at ^ CASTOR_PLANE_BYTES
    float world_origin_x[CASTOR_GROUP_RAYS], world_origin_y[CASTOR_GROUP_RAYS], world_origin_z[CASTOR_GROUP_RAYS];
#if CASTOR_HAS_SPHERES
    float direction_x[CASTOR_GROUP_RAYS], direction_y[CASTOR_GROUP_RAYS], direction_z[CASTOR_GROUP_RAYS];
    float direction_squared_high[CASTOR_GROUP_RAYS], direction_squared_low[CASTOR_GROUP_RAYS];
#endif
    // The best hit so far; best_t is t_max where there is none.
    float best_t[CASTOR_GROUP_RAYS], best_u[CASTOR_GROUP_RAYS], best_v[CASTOR_GROUP_RAYS];
    uint best_primitive[CASTOR_GROUP_RAYS];
#if CASTOR_HAS_INSTANCES
    uint best_instance[CASTOR_GROUP_RAYS];
    uint root[CASTOR_GROUP_RAYS];  // of the tree that the ray is for, where that is not the same for all
#endif
    uint valid;  // the rays that can hit anything, as bits
} RayGroup;

#define CASTOR_PLANE_BYTES 32u

CASTOR_INLINE RayGroup *ray_of_group(RayGroup *group, const uint place) { return (RayGroup *)((uint *)group + place); }

// One column of eight rows.
#define CASTOR_COLUMN_OF(rows, c) \
    (float8)(rows[0].c, rows[1].c, rows[2].c, rows[3].c, rows[4].c, rows[5].c, rows[6].c, rows[7].c)

// slab_inverse, ray by ray.
CASTOR_INLINE float8 slab_inverse8(const float8 d)
{
    const float8 smallest = d < 0.0f ? (float8)(-CASTOR_SMALLEST_DIRECTION) : (float8)(CASTOR_SMALLEST_DIRECTION);
    return divide8((float8)(1.0f), fabs(d) < CASTOR_SMALLEST_DIRECTION ? smallest : d);
}

CASTOR_INLINE float8 choose_axis8(const int8 axis, const float8 x, const float8 y, const float8 z)
{
    return axis == 2 ? z : axis == 1 ? y : x;
}

// Makes eight rays of the columns ready, from row `begin` on, at places [place, place + 8) of the group. Those from row
// `end` on are not valid.
CASTOR_INLINE void make_half_group(RayGroup *group, const uint place, const TraceParams params, const uint begin,
                                   const uint end, const global float4 *restrict ray_origin_tmin,
                                   const global float4 *restrict ray_direction_tmax)
{
    float4 origin_rows[8];
    float4 direction_rows[8];
    for (uint i = 0; i < 8; ++i) {
        const size_t row = (size_t)min(begin + i, end - 1) * params.ray_stride;
        origin_rows[i] = ray_origin_tmin[row];
        direction_rows[i] = ray_direction_tmax[row + params.direction_offset];
    }
    const float8 origin[4] = {CASTOR_COLUMN_OF(origin_rows, x), CASTOR_COLUMN_OF(origin_rows, y),
                              CASTOR_COLUMN_OF(origin_rows, z), CASTOR_COLUMN_OF(origin_rows, w)};
    const float8 direction[4] = {CASTOR_COLUMN_OF(direction_rows, x), CASTOR_COLUMN_OF(direction_rows, y),
                                 CASTOR_COLUMN_OF(direction_rows, z), CASTOR_COLUMN_OF(direction_rows, w)};

    // is_traceable
    const float8 ax = fabs(direction[0]);
    const float8 ay = fabs(direction[1]);
    const float8 az = fabs(direction[2]);
    const int8 origin_is_near = (fabs(origin[0]) <= CASTOR_MAX_COORDINATE) &
                                (fabs(origin[1]) <= CASTOR_MAX_COORDINATE) & (fabs(origin[2]) <= CASTOR_MAX_COORDINATE);
    const int8 direction_is_finite = (ax <= FLT_MAX) & (ay <= FLT_MAX) & (az <= FLT_MAX);
    const int8 direction_is_normal = (ax >= FLT_MIN) | (ay >= FLT_MIN) | (az >= FLT_MIN);
    const int8 is_here = (int8)(0, 1, 2, 3, 4, 5, 6, 7) < (int)(end - begin);
    const int8 valid =
        origin_is_near & direction_is_finite & direction_is_normal & (origin[3] <= direction[3]) & is_here;
    group->valid |= mask_of_8(valid) << place;
    // The others become some ray.
    const float8 ox = valid ? origin[0] : (float8)(0.0f);
    const float8 oy = valid ? origin[1] : (float8)(0.0f);
    const float8 oz = valid ? origin[2] : (float8)(0.0f);
    const float8 t_min = valid ? origin[3] : (float8)(0.0f);
    const float8 t_max = valid ? direction[3] : (float8)(0.0f);
    float8 dx = valid ? direction[0] : (float8)(1.0f);
    float8 dy = valid ? direction[1] : (float8)(1.0f);
    float8 dz = valid ? direction[2] : (float8)(1.0f);

    const float8 largest = larger8(fabs(dx), larger8(fabs(dy), fabs(dz)));
    const int8 exponent = as_int8(largest) >> 23;
    const int8 scale_exponent = exponent > 253 ? (int8)(1) : 254 - exponent;
    const float8 scale = as_float8(scale_exponent << 23);
    const float8 inverse_scale = as_float8((254 - scale_exponent) << 23);
    dx *= scale;
    dy *= scale;
    dz *= scale;
    vstore8(scale, 0, group->t_scale + place);
    const float8 finite_t_max = smaller8(t_max, (float8)(FLT_MAX));
    const float8 scaled_min = t_min * inverse_scale;
    const float8 scaled_max = finite_t_max * inverse_scale;
    const float8 best_t = scaled_max * scale > finite_t_max ? scaled_max - 0x1p-149f : scaled_max;
    vstore8(scaled_min * scale < t_min ? scaled_min + 0x1p-149f : scaled_min, 0, group->t_min + place);
    vstore8(best_t, 0, group->t_max + place);
    vstore8(best_t, 0, group->best_t + place);
    vstore8((uint8)(CASTOR_INVALID_INDEX), 0, group->best_primitive + place);
#if CASTOR_HAS_INSTANCES
    vstore8((uint8)(0), 0, group->best_instance + place);
#endif

    const float8 ix = slab_inverse8(dx);
    const float8 iy = slab_inverse8(dy);
    const float8 iz = slab_inverse8(dz);
    const float8 farthest = larger8(fabs(ox), larger8(fabs(oy), fabs(oz)));
    const float8 padding = CASTOR_BOX_PADDING * (params.largest_coordinate + farthest);
    vstore8(ix, 0, group->inverse_x + place);
    vstore8(iy, 0, group->inverse_y + place);
    vstore8(iz, 0, group->inverse_z + place);
    vstore8(-(ox * ix) - padding * fabs(ix), 0, group->entry_x + place);
    vstore8(-(oy * iy) - padding * fabs(iy), 0, group->entry_y + place);
    vstore8(-(oz * iz) - padding * fabs(iz), 0, group->entry_z + place);
    vstore8(-(ox * ix) + padding * fabs(ix), 0, group->exit_x + place);
    vstore8(-(oy * iy) + padding * fabs(iy), 0, group->exit_y + place);
    vstore8(-(oz * iz) + padding * fabs(iz), 0, group->exit_z + place);
    const int8 plane_bytes = (int)CASTOR_PLANE_BYTES;
    vstore8(as_uint8((dx < 0.0f) & plane_bytes), 0, group->near_x + place);
    vstore8(as_uint8(((dy < 0.0f) & plane_bytes) + 2 * plane_bytes), 0, group->near_y + place);
    vstore8(as_uint8(((dz < 0.0f) & plane_bytes) + 4 * plane_bytes), 0, group->near_z + place);

    const int8 axis = fabs(dz) > larger8(fabs(dx), fabs(dy)) ? (int8)(2) : fabs(dy) > fabs(dx) ? (int8)(1) : (int8)(0);
    const int8 next = axis == 2 ? (int8)(0) : axis + 1;
    const int8 last = next == 2 ? (int8)(0) : next + 1;
    const int8 mirrored = choose_axis8(axis, dx, dy, dz) < 0.0f;
    const int8 kx = mirrored ? last : next;
    const int8 ky = mirrored ? next : last;
    const float8 inverse_z = choose_axis8(axis, ix, iy, iz);
    vstore8(as_uint8(kx), 0, group->kx + place);
    vstore8(as_uint8(ky), 0, group->ky + place);
    vstore8(as_uint8(axis), 0, group->kz + place);
    vstore8(choose_axis8(kx, ox, oy, oz), 0, group->origin_x + place);
    vstore8(choose_axis8(ky, ox, oy, oz), 0, group->origin_y + place);
    vstore8(choose_axis8(axis, ox, oy, oz), 0, group->origin_z + place);
    vstore8(-(choose_axis8(kx, dx, dy, dz) * inverse_z), 0, group->shear_x + place);
    vstore8(-(choose_axis8(ky, dx, dy, dz) * inverse_z), 0, group->shear_y + place);
    vstore8(inverse_z, 0, group->shear_z + place);

    vstore8(ox, 0, group->world_origin_x + place);
    vstore8(oy, 0, group->world_origin_y + place);
    vstore8(oz, 0, group->world_origin_z + place);
#if CASTOR_HAS_SPHERES
    vstore8(dx, 0, group->direction_x + place);
    vstore8(dy, 0, group->direction_y + place);
    vstore8(dz, 0, group->direction_z + place);
    const DoubleFloat8 squared =
        add_double_float8(add_double_float8(two_product8(dx, dx), two_product8(dy, dy)), two_product8(dz, dz));
    vstore8(squared.high, 0, group->direction_squared_high + place);
    vstore8(squared.low, 0, group->direction_squared_low + place);
#endif
}

CASTOR_INLINE Hit best_of_ray(const RayGroup *ray)
{
    Hit best;
    best.t = ray->best_t[0];
    best.u = ray->best_u[0];
    best.v = ray->best_v[0];
    best.primitive = ray->best_primitive[0];
#if CASTOR_HAS_INSTANCES
    best.instance = ray->best_instance[0];
#else
    best.instance = 0;
#endif
    return best;
}

CASTOR_INLINE void set_best_of_ray(RayGroup *ray, const Hit best)
{
    ray->best_t[0] = best.t;
    ray->best_u[0] = best.u;
    ray->best_v[0] = best.v;
    ray->best_primitive[0] = best.primitive;
#if CASTOR_HAS_INSTANCES
    ray->best_instance[0] = best.instance;
#endif
}

#if CASTOR_HAS_INSTANCES
// A ray that was made alone, with the best hit so far.
CASTOR_INLINE void set_ray_of_group(RayGroup *group, const uint place, const TraceRay made, const Hit best)
{
    RayGroup *ray = ray_of_group(group, place);
    ray->inverse_x[0] = made.inverse.x;
    ray->inverse_y[0] = made.inverse.y;
    ray->inverse_z[0] = made.inverse.z;
    ray->entry_x[0] = made.entry_offset.x;
    ray->entry_y[0] = made.entry_offset.y;
    ray->entry_z[0] = made.entry_offset.z;
    ray->exit_x[0] = made.exit_offset.x;
    ray->exit_y[0] = made.exit_offset.y;
    ray->exit_z[0] = made.exit_offset.z;
    ray->t_min[0] = made.t_min;
    ray->t_max[0] = made.t_max;
    ray->t_scale[0] = made.t_scale;
    const float3 origin = permute(made.origin, made.axis, made.mirrored);
    ray->origin_x[0] = origin.x;
    ray->origin_y[0] = origin.y;
    ray->origin_z[0] = origin.z;
    ray->shear_x[0] = -made.shear.x;
    ray->shear_y[0] = -made.shear.y;
    ray->shear_z[0] = made.shear.z;
    const uint next = made.axis == 2 ? 0 : made.axis + 1;
    const uint last = next == 2 ? 0 : next + 1;
    ray->kx[0] = made.mirrored ? last : next;
    ray->ky[0] = made.mirrored ? next : last;
    ray->kz[0] = made.axis;
    ray->near_x[0] = made.direction.x < 0.0f ? CASTOR_PLANE_BYTES : 0;
    ray->near_y[0] = (made.direction.y < 0.0f ? CASTOR_PLANE_BYTES : 0) + 2 * CASTOR_PLANE_BYTES;
    ray->near_z[0] = (made.direction.z < 0.0f ? CASTOR_PLANE_BYTES : 0) + 4 * CASTOR_PLANE_BYTES;
    ray->world_origin_x[0] = made.origin.x;
    ray->world_origin_y[0] = made.origin.y;
    ray->world_origin_z[0] = made.origin.z;
#if CASTOR_HAS_SPHERES
    ray->direction_x[0] = made.direction.x;
    ray->direction_y[0] = made.direction.y;
    ray->direction_z[0] = made.direction.z;
    const DoubleFloat squared = direction_squared(made.direction);
    ray->direction_squared_high[0] = squared.high;
    ray->direction_squared_low[0] = squared.low;
#endif
    set_best_of_ray(ray, best);
}
#endif

CASTOR_INLINE int has_hit(const RayGroup *ray) { return ray->best_primitive[0] != CASTOR_INVALID_INDEX; }

// The rays that no hit has ended yet, as bits.
CASTOR_INLINE uint unended_rays(RayGroup *group, const int wants_any)
{
    uint unended = group->valid;
    if (!wants_any) return unended;
    for (uint place = 0; place < CASTOR_GROUP_RAYS; ++place)
        if (has_hit(ray_of_group(group, place))) unended &= ~(1u << place);
    return unended;
}

// The rays that are to be led down the tree, as bits.
CASTOR_INLINE uint undecided_rays(RayGroup *group, const int wants_any)
{
    return CASTOR_HAS_PLANES || CASTOR_HAS_CHUNKS ? unended_rays(group, wants_any) : group->valid;
}

// Makes rays [begin, end) of the columns ready, at most 16. Their hits so far are those with the scene's planes; where
// earlier chunks have given answers, they go as far as these, and those that are known to be occluded have a hit.
CASTOR_INLINE void make_ray_group(RayGroup *group, const SceneColumns scene, const uint begin, const uint end,
                                  const int wants_any, const global float4 *restrict ray_origin_tmin,
                                  const global float4 *restrict ray_direction_tmax, const global Hit *hits,
                                  const global uchar *occluded)
{
    group->valid = 0;
    make_half_group(group, 0, scene.params, begin, end, ray_origin_tmin, ray_direction_tmax);
    make_half_group(group, 8, scene.params, begin + 8, end, ray_origin_tmin, ray_direction_tmax);
    if (goes_on(scene)) {
        for (uint mask = group->valid; mask; mask &= mask - 1) {
            const uint place = lowest_bit(mask);
            RayGroup *ray = ray_of_group(group, place);
            if (!wants_any)
                ray->best_t[0] = search_limit(scene, ray->best_t[0], hits + begin + place);
            else if (occluded[begin + place])
                ray->best_primitive[0] = 0;
        }
    }
    if (!CASTOR_HAS_PLANES) return;
    for (uint mask = undecided_rays(group, wants_any); mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        const TraceRay ray = load_ray(scene.params, begin + place, ray_origin_tmin, ray_direction_tmax);
        set_best_of_ray(ray_of_group(group, place),
                        nearest_plane(scene, ray, no_hit_yet(ray_of_group(group, place)->best_t[0])));
    }
}

// Writes the answers of rays [begin, end), which the group holds.
CASTOR_INLINE void write_answers(RayGroup *group, const SceneColumns scene, const uint begin, const uint end,
                                 const int wants_any, global Hit *hits, global uchar *occluded)
{
    for (uint place = 0; begin + place < end; ++place) {
        const RayGroup *ray = ray_of_group(group, place);
        if (wants_any)
            occluded[begin + place] = (uchar)has_hit(ray);
        else
            hits[begin + place] = finished_hit(scene, ray->t_scale[0], best_of_ray(ray), hits + begin + place);
    }
}
