// Makes the rays of a group ready, and writes their answers.
#include "castor/shared/layout.h"
#include "device/instances.cl"
#include "device/ray_group.cl"
#include "device/simd.cl"
#include "device/store_rays.x1.cl"
#include "device/store_rays.x8.cl"

// Returns one column of eight rows.
#define CASTOR_COLUMN_OF(rows, c) \
    (float8)(rows[0].c, rows[1].c, rows[2].c, rows[3].c, rows[4].c, rows[5].c, rows[6].c, rows[7].c)

// Makes eight rays of the columns ready, from row `begin` on, at places [place, place + 8) of the group. Those from row
// `end` on are not valid.
CASTOR_INLINE void make_half_group(RayGroup *group, const uint place, const TraceParams params, const uint begin,
                                   const uint end, const global float4 *restrict ray_origin_tmin,
                                   const global float4 *restrict ray_direction_tmax)
{
    float4 origin[8];
    float4 direction[8];
    for (uint i = 0; i < 8; ++i) {
        const size_t row = (size_t)min(begin + i, end - 1) * params.ray_stride;
        origin[i] = ray_origin_tmin[row];
        direction[i] = ray_direction_tmax[row + params.direction_offset];
    }
    TraceRay8 rays;
    rays.origin_x = CASTOR_COLUMN_OF(origin, x);
    rays.origin_y = CASTOR_COLUMN_OF(origin, y);
    rays.origin_z = CASTOR_COLUMN_OF(origin, z);
    rays.t_min = CASTOR_COLUMN_OF(origin, w);
    rays.direction_x = CASTOR_COLUMN_OF(direction, x);
    rays.direction_y = CASTOR_COLUMN_OF(direction, y);
    rays.direction_z = CASTOR_COLUMN_OF(direction, z);
    rays.t_max = CASTOR_COLUMN_OF(direction, w);
    const int8 is_here = (int8)(0, 1, 2, 3, 4, 5, 6, 7) < (int)(end - begin);
    rays = prepare_ray8(rays, is_here, params.largest_coordinate);
    group->valid |= mask_of8(rays.valid) << place;
    store_rays8(group, place, rays);
}

CASTOR_INLINE Hit best_of_ray(const RayGroup *group, const uint place)
{
    Hit best;
    best.t = group->best_t[place];
    best.u = group->best_u[place];
    best.v = group->best_v[place];
    best.primitive = group->best_primitive[place];
#if CASTOR_HAS_INSTANCES
    best.instance = group->best_instance[place];
#else
    best.instance = 0;
#endif
    return best;
}

CASTOR_INLINE void set_best_of_ray(RayGroup *group, const uint place, const Hit best)
{
    group->best_t[place] = best.t;
    group->best_u[place] = best.u;
    group->best_v[place] = best.v;
    group->best_primitive[place] = best.primitive;
#if CASTOR_HAS_INSTANCES
    group->best_instance[place] = best.instance;
#endif
}

CASTOR_INLINE int has_hit(const RayGroup *group, const uint place)
{
    return group->best_primitive[place] != CASTOR_INVALID_INDEX;
}

// Returns the rays that no hit has ended yet, as bits.
CASTOR_INLINE uint unended_rays(const RayGroup *group, const int wants_any)
{
    uint unended = group->valid;
    if (!wants_any) return unended;
    for (uint place = 0; place < CASTOR_GROUP_RAYS; ++place)
        if (has_hit(group, place)) unended &= ~(1u << place);
    return unended;
}

// Returns the rays that have to traverse the tree, as bits.
CASTOR_INLINE uint undecided_rays(const RayGroup *group, const int wants_any)
{
    return CASTOR_HAS_PLANES || CASTOR_HAS_CHUNKS ? unended_rays(group, wants_any) : group->valid;
}

// Makes rays [begin, end) of the columns ready, at most 16, and tests them against the scene's planes. Where earlier
// chunks have written answers, a ray reaches no farther than its answer, and one that is occluded already has a hit.
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
            if (!wants_any)
                group->best_t[place] = search_limit(scene, group->best_t[place], hits + begin + place);
            else if (occluded[begin + place])
                group->best_primitive[place] = 0;
        }
    }
    if (!CASTOR_HAS_PLANES) return;
    for (uint mask = undecided_rays(group, wants_any); mask; mask &= mask - 1) {
        const uint place = lowest_bit(mask);
        const TraceRay ray = load_ray(scene.params, begin + place, ray_origin_tmin, ray_direction_tmax);
        set_best_of_ray(group, place, nearest_plane(scene, ray, no_hit_yet(group->best_t[place])));
    }
}

// Writes the answers of rays [begin, end), which the group holds.
CASTOR_INLINE void write_answers(const RayGroup *group, const SceneColumns scene, const uint begin, const uint end,
                                 const int wants_any, global Hit *hits, global uchar *occluded)
{
    for (uint place = 0; begin + place < end; ++place) {
        if (wants_any)
            occluded[begin + place] = (uchar)has_hit(group, place);
        else
            hits[begin + place] =
                finished_hit(scene, group->t_scale[place], best_of_ray(group, place), hits + begin + place);
    }
}
