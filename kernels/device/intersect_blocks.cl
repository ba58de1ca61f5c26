// One ray against four triangles or four spheres at once: the arithmetic of intersect_triangle and intersect_sphere, lane by lane, in the same order and
// so with the same bits.
#include "castor/shared/layout.h"
#include "device/scene.cl"
#include "device/simd.cl"

// A ray as blocks need it. Kept as scalars: vectors are splat from memory where they are used, which costs a CPU nothing.
typedef struct BlockRay {
    float inverse_x, inverse_y, inverse_z;  // slabs along the world's axes: see TraceRay
    float entry_x, entry_y, entry_z;
    float exit_x, exit_y, exit_z;
    float t_min, t_max;
    float origin_x, origin_y, origin_z;  // along the permuted axes
    float shear_x, shear_y, shear_z;     // x and y negated
    uint kx, ky, kz;                     // axes that become x, y, z: columns of a block, so that nothing is shuffled
#if CASTOR_HAS_SPHERES
    float3 world_origin, world_direction;
    DoubleFloat direction_squared;
#endif
} BlockRay;

CASTOR_INLINE BlockRay make_block_ray(const TraceRay ray)
{
    BlockRay b;
    b.inverse_x = ray.inverse.x;
    b.inverse_y = ray.inverse.y;
    b.inverse_z = ray.inverse.z;
    b.entry_x = ray.entry_offset.x;
    b.entry_y = ray.entry_offset.y;
    b.entry_z = ray.entry_offset.z;
    b.exit_x = ray.exit_offset.x;
    b.exit_y = ray.exit_offset.y;
    b.exit_z = ray.exit_offset.z;
    b.t_min = ray.t_min;
    b.t_max = ray.t_max;
    const uint next = ray.axis == 2 ? 0 : ray.axis + 1;
    const uint last = next == 2 ? 0 : next + 1;
    b.kz = ray.axis;
    b.kx = ray.mirrored ? last : next;
    b.ky = ray.mirrored ? next : last;
    const float origin[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
    b.origin_x = origin[b.kx];
    b.origin_y = origin[b.ky];
    b.origin_z = origin[b.kz];
    b.shear_x = -ray.shear.x;
    b.shear_y = -ray.shear.y;
    b.shear_z = ray.shear.z;
#if CASTOR_HAS_SPHERES
    b.world_origin = ray.origin;
    b.world_direction = ray.direction;
    b.direction_squared = direction_squared(ray.direction);
#endif
    return b;
}

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
CASTOR_INLINE void block_intervals(const BlockRay *ray, const BlockBoxes boxes, float4 *entry, float4 *exit)
{
    const int down_x = ray->inverse_x < 0.0f;
    const int down_y = ray->inverse_y < 0.0f;
    const int down_z = ray->inverse_z < 0.0f;
    const float4 inverse_x = (float4)(ray->inverse_x);
    const float4 inverse_y = (float4)(ray->inverse_y);
    const float4 inverse_z = (float4)(ray->inverse_z);
    const float4 entry_x = fma(down_x ? boxes.upper_x : boxes.lower_x, inverse_x, (float4)(ray->entry_x));
    const float4 entry_y = fma(down_y ? boxes.upper_y : boxes.lower_y, inverse_y, (float4)(ray->entry_y));
    const float4 entry_z = fma(down_z ? boxes.upper_z : boxes.lower_z, inverse_z, (float4)(ray->entry_z));
    const float4 exit_x = fma(down_x ? boxes.lower_x : boxes.upper_x, inverse_x, (float4)(ray->exit_x));
    const float4 exit_y = fma(down_y ? boxes.lower_y : boxes.upper_y, inverse_y, (float4)(ray->exit_y));
    const float4 exit_z = fma(down_z ? boxes.lower_z : boxes.upper_z, inverse_z, (float4)(ray->exit_z));
    *entry = larger4(entry_x, larger4(entry_y, entry_z));
    *exit = smaller4(exit_x, smaller4(exit_y, exit_z));
}

// The own-box rule (within_own_box) for four boxes.
CASTOR_INLINE BlockHits within_own_boxes(const BlockRay *ray, const BlockBoxes boxes, BlockHits hits)
{
    float4 entry, exit;
    block_intervals(ray, boxes, &entry, &exit);
    entry = larger4(entry, (float4)(ray->t_min));
    exit = smaller4(exit, (float4)(ray->t_max));
    hits.mask &= mask_of_4((entry <= exit) & (hits.t >= ray->t_min) & (hits.t <= ray->t_max));
    hits.t = smaller4(larger4(hits.t, entry), exit);
    return hits;
}

// The exact sign of edge functions whose rounded products were equal: see edge_function.
CASTOR_INLINE float4 exact_where_zero(const float4 difference, const float4 ax, const float4 ay, const float4 bx, const float4 by)
{
    const float4 exact = fma(ax, by, -(ax * by)) - fma(ay, bx, -(ay * bx));
    return difference == 0.0f ? exact : difference;
}

CASTOR_INLINE BlockHits intersect_triangle_block(const BlockRay *ray, const global TriangleBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    BlockHits hits;
    const float4 az = columns[ray->kz] - ray->origin_z;
    const float4 bz = columns[3 + ray->kz] - ray->origin_z;
    const float4 cz = columns[6 + ray->kz] - ray->origin_z;
    const float4 ax = fma((float4)(ray->shear_x), az, columns[ray->kx] - ray->origin_x);
    const float4 ay = fma((float4)(ray->shear_y), az, columns[ray->ky] - ray->origin_y);
    const float4 bx = fma((float4)(ray->shear_x), bz, columns[3 + ray->kx] - ray->origin_x);
    const float4 by = fma((float4)(ray->shear_y), bz, columns[3 + ray->ky] - ray->origin_y);
    const float4 cx = fma((float4)(ray->shear_x), cz, columns[6 + ray->kx] - ray->origin_x);
    const float4 cy = fma((float4)(ray->shear_y), cz, columns[6 + ray->ky] - ray->origin_y);
    float4 u = cx * by - cy * bx;
    float4 v = ax * cy - ay * cx;
    float4 w = bx * ay - by * ax;

    // Zero counts as inside on both sides first; what stays is decided exactly. NaN (an unused lane) is outside.
    const float4 least = smaller4(u, smaller4(v, w));
    const float4 most = larger4(u, larger4(v, w));
    hits.mask = mask_of_4((least >= 0.0f) | (most <= 0.0f));
    if (!hits.mask) return hits;

    if (mask_of_4((u == 0.0f) | (v == 0.0f) | (w == 0.0f)) & hits.mask) {
        u = exact_where_zero(u, cx, cy, bx, by);
        v = exact_where_zero(v, ax, ay, cx, cy);
        w = exact_where_zero(w, bx, by, ax, ay);
        const int4 any_negative = (u < 0.0f) | (v < 0.0f) | (w < 0.0f);
        const int4 any_positive = (u > 0.0f) | (v > 0.0f) | (w > 0.0f);
        hits.mask &= ~mask_of_4(any_negative & any_positive);
    }
    hits.determinant = u + v + w;
    hits.mask &= ~mask_of_4(fabs(hits.determinant) < FLT_MIN);
    if (!hits.mask) return hits;

    const float4 r = divide4((float4)(1.0f), hits.determinant);
    hits.u = v * r;
    hits.v = w * r;
    hits.t = fma(u * r, ray->shear_z * az, fma(hits.u, ray->shear_z * bz, hits.v * (ray->shear_z * cz)));

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
CASTOR_INLINE BlockHits intersect_sphere_block(const BlockRay *ray, const global SphereBlock *block)
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
    BlockHits hits;
    hits.mask = mask_of_4((entry <= exit) & (columns[3] == columns[3]));
    if (!hits.mask) return hits;

    DoubleFloat4 a;
    a.high = (float4)(ray->direction_squared.high);
    a.low = (float4)(ray->direction_squared.low);
    const SphereRoots4 roots =
        sphere_roots4((float4)(ray->world_origin.x), (float4)(ray->world_origin.y), (float4)(ray->world_origin.z),
                      (float4)(ray->world_direction.x), (float4)(ray->world_direction.y), (float4)(ray->world_direction.z), a,
                      columns[0], columns[1], columns[2], columns[3]);
    const int4 near_counts = (roots.near_t >= ray->t_min) & (roots.near_t <= ray->t_max);
    hits.t = near_counts ? roots.near_t : roots.far_t;
    hits.u = (float4)(0.0f);
    hits.v = (float4)(0.0f);
    hits.determinant = (float4)(1.0f);  // spheres are never culled
    return within_own_boxes(ray, boxes, hits);
}
#endif
