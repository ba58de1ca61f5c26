// One ray against four triangles or four spheres at once: the arithmetic of intersect_triangle and intersect_sphere,
// lane by lane, in the same order and so with the same bits.
#include "castor/shared/layout.h"
#include "device/ray_group.cl"

// Four candidates; `mask` has a bit for each that counts.
typedef struct BlockHits {
    uint mask;
    float4 t, u, v;
    float4 determinant;
} BlockHits;

// Four boxes of primitives.
typedef struct BlockBoxes {
    float4 lower_x, lower_y, lower_z;
    float4 upper_x, upper_y, upper_z;
} BlockBoxes;

// (entry, exit) of the ray's line through each box: see box_interval.
CASTOR_INLINE void block_intervals(const RayGroup *ray, const BlockBoxes boxes, float4 *entry, float4 *exit)
{
    const float4 inverse_x = (float4)(ray->inverse_x[0]);
    const float4 inverse_y = (float4)(ray->inverse_y[0]);
    const float4 inverse_z = (float4)(ray->inverse_z[0]);
    // Chosen lane by lane, which takes no branch.
    const int4 down_x = inverse_x < 0.0f;
    const int4 down_y = inverse_y < 0.0f;
    const int4 down_z = inverse_z < 0.0f;
    const float4 entry_x = fma(down_x ? boxes.upper_x : boxes.lower_x, inverse_x, (float4)(ray->entry_x[0]));
    const float4 entry_y = fma(down_y ? boxes.upper_y : boxes.lower_y, inverse_y, (float4)(ray->entry_y[0]));
    const float4 entry_z = fma(down_z ? boxes.upper_z : boxes.lower_z, inverse_z, (float4)(ray->entry_z[0]));
    const float4 exit_x = fma(down_x ? boxes.lower_x : boxes.upper_x, inverse_x, (float4)(ray->exit_x[0]));
    const float4 exit_y = fma(down_y ? boxes.lower_y : boxes.upper_y, inverse_y, (float4)(ray->exit_y[0]));
    const float4 exit_z = fma(down_z ? boxes.lower_z : boxes.upper_z, inverse_z, (float4)(ray->exit_z[0]));
    *entry = larger4(entry_x, larger4(entry_y, entry_z));
    *exit = smaller4(exit_x, smaller4(exit_y, exit_z));
}

// The own-box rule (within_own_box) for four boxes. What is farther than the best hit does not count either.
CASTOR_INLINE BlockHits within_own_boxes(const RayGroup *ray, const BlockBoxes boxes, BlockHits hits)
{
    float4 entry, exit;
    block_intervals(ray, boxes, &entry, &exit);
    entry = larger4(entry, (float4)(ray->t_min[0]));
    exit = smaller4(exit, (float4)(ray->t_max[0]));
    const float4 limited = smaller4(larger4(hits.t, entry), exit);
    hits.mask &= mask_of_4((entry <= exit) & (hits.t >= ray->t_min[0]) & (hits.t <= ray->t_max[0]) &
                           (limited <= ray->best_t[0]));
    hits.t = limited;
    return hits;
}

// See edge_function.
CASTOR_INLINE float4 edge_function4(const float4 ax, const float4 ay, const float4 bx, const float4 by)
{
    const float4 right = ay * bx;
    const float4 error = fma(-ay, bx, right);
    return fma(ax, by, -right) + error;
}

CASTOR_INLINE BlockHits intersect_triangle_block(const RayGroup *ray, const global TriangleBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    BlockHits hits;
    const float4 az = columns[ray->kz[0]] - ray->origin_z[0];
    const float4 bz = columns[3 + ray->kz[0]] - ray->origin_z[0];
    const float4 cz = columns[6 + ray->kz[0]] - ray->origin_z[0];
    const float4 ax = fma((float4)(ray->shear_x[0]), az, columns[ray->kx[0]] - ray->origin_x[0]);
    const float4 ay = fma((float4)(ray->shear_y[0]), az, columns[ray->ky[0]] - ray->origin_y[0]);
    const float4 bx = fma((float4)(ray->shear_x[0]), bz, columns[3 + ray->kx[0]] - ray->origin_x[0]);
    const float4 by = fma((float4)(ray->shear_y[0]), bz, columns[3 + ray->ky[0]] - ray->origin_y[0]);
    const float4 cx = fma((float4)(ray->shear_x[0]), cz, columns[6 + ray->kx[0]] - ray->origin_x[0]);
    const float4 cy = fma((float4)(ray->shear_y[0]), cz, columns[6 + ray->ky[0]] - ray->origin_y[0]);
    float4 u = cx * by - cy * bx;
    float4 v = ax * cy - ay * cx;
    float4 w = bx * ay - by * ax;

    // Rounding is monotone, so these have the right signs, or are zero. That counts as inside on both sides first; what
    // stays is decided exactly. NaN (an unused lane) is outside.
    const float4 least = smaller4(u, smaller4(v, w));
    const float4 most = larger4(u, larger4(v, w));
    hits.mask = mask_of_4((least >= 0.0f) | (most <= 0.0f));
    if (!hits.mask) return hits;

    u = edge_function4(cx, cy, bx, by);
    v = edge_function4(ax, ay, cx, cy);
    w = edge_function4(bx, by, ax, ay);
    hits.mask &= mask_of_4((smaller4(u, smaller4(v, w)) >= 0.0f) | (larger4(u, larger4(v, w)) <= 0.0f));
    hits.determinant = u + v + w;
    hits.mask &= ~mask_of_4(fabs(hits.determinant) < FLT_MIN);
    if (!hits.mask) return hits;

    const float4 r = divide4((float4)(1.0f), hits.determinant);
    hits.u = v * r;
    hits.v = w * r;
    hits.t = fma(u * r, ray->shear_z[0] * az, fma(hits.u, ray->shear_z[0] * bz, hits.v * (ray->shear_z[0] * cz)));

    BlockBoxes boxes;
    boxes.lower_x = smaller4(columns[0], smaller4(columns[3], columns[6]));
    boxes.lower_y = smaller4(columns[1], smaller4(columns[4], columns[7]));
    boxes.lower_z = smaller4(columns[2], smaller4(columns[5], columns[8]));
    boxes.upper_x = larger4(columns[0], larger4(columns[3], columns[6]));
    boxes.upper_y = larger4(columns[1], larger4(columns[4], columns[7]));
    boxes.upper_z = larger4(columns[2], larger4(columns[5], columns[8]));
    return within_own_boxes(ray, boxes, hits);
}

#if CASTOR_HAS_SPHERES
// NaN (an unused lane) is missed.
CASTOR_INLINE BlockHits intersect_sphere_block(const RayGroup *ray, const global SphereBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    BlockBoxes boxes;
    boxes.lower_x = columns[0] - columns[3];
    boxes.lower_y = columns[1] - columns[3];
    boxes.lower_z = columns[2] - columns[3];
    boxes.upper_x = columns[0] + columns[3];
    boxes.upper_y = columns[1] + columns[3];
    boxes.upper_z = columns[2] + columns[3];
    float4 entry, exit;
    block_intervals(ray, boxes, &entry, &exit);
    // Within limits already: what hits beyond them would not count.
    entry = larger4(entry, (float4)(ray->t_min[0]));
    exit = smaller4(exit, (float4)(ray->best_t[0]));
    DoubleFloat4 a;
    a.high = (float4)(ray->direction_squared_high[0]);
    a.low = (float4)(ray->direction_squared_low[0]);
    const int4 missed = sphere_missed4((float4)(ray->world_origin_x[0]), (float4)(ray->world_origin_y[0]),
                                       (float4)(ray->world_origin_z[0]), (float4)(ray->direction_x[0]),
                                       (float4)(ray->direction_y[0]), (float4)(ray->direction_z[0]), a.high,
                                       (float4)(ray->t_min[0]), columns[0], columns[1], columns[2], columns[3]);
    BlockHits hits;
    hits.mask = mask_of_4((entry <= exit) & (columns[3] == columns[3]) & ~missed);
    if (!hits.mask) return hits;

    const SphereRoots4 roots =
        sphere_roots4((float4)(ray->world_origin_x[0]), (float4)(ray->world_origin_y[0]),
                      (float4)(ray->world_origin_z[0]), (float4)(ray->direction_x[0]), (float4)(ray->direction_y[0]),
                      (float4)(ray->direction_z[0]), a, columns[0], columns[1], columns[2], columns[3]);
    const int4 near_counts = (roots.near_t >= ray->t_min[0]) & (roots.near_t <= ray->t_max[0]);
    hits.t = near_counts ? roots.near_t : roots.far_t;
    hits.u = (float4)(0.0f);
    hits.v = (float4)(0.0f);
    hits.determinant = (float4)(1.0f);  // spheres are never culled
    return within_own_boxes(ray, boxes, hits);
}
#endif
