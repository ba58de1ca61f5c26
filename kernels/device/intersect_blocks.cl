// One ray against four triangles or four spheres at once: the arithmetic of intersect_triangle and intersect_sphere, lane by lane, in the same order and
// so with the same bits.
#include "device/scene.cl"
#include "device/simd.cl"

// Splat and permuted once a ray. Axis numbers choose columns of a block, so that nothing is shuffled.
typedef struct BlockRay {
    float4 origin_x, origin_y, origin_z;        // along the permuted axes
    float4 shear_x, shear_y, shear_z;
    int kx, ky, kz;                             // axes that become x, y, z
    // Slabs along the world's axes.
    float4 inverse[3], entry_offset[3], exit_offset[3];
    float4 t_min, t_max;
} BlockRay;

BlockRay make_block_ray(const TraceRay ray)
{
    BlockRay b;
    const int next = ray.axis == 2 ? 0 : ray.axis + 1;
    const int last = next == 2 ? 0 : next + 1;
    b.kz = ray.axis;
    b.kx = ray.mirrored ? last : next;
    b.ky = ray.mirrored ? next : last;
    const float3 o = permute(ray.origin, ray.axis, ray.mirrored);
    b.origin_x = (float4)(o.x);
    b.origin_y = (float4)(o.y);
    b.origin_z = (float4)(o.z);
    b.shear_x = (float4)(-ray.shear.x);
    b.shear_y = (float4)(-ray.shear.y);
    b.shear_z = (float4)(ray.shear.z);
    b.inverse[0] = (float4)(ray.inverse.x);
    b.inverse[1] = (float4)(ray.inverse.y);
    b.inverse[2] = (float4)(ray.inverse.z);
    b.entry_offset[0] = (float4)(ray.entry_offset.x);
    b.entry_offset[1] = (float4)(ray.entry_offset.y);
    b.entry_offset[2] = (float4)(ray.entry_offset.z);
    b.exit_offset[0] = (float4)(ray.exit_offset.x);
    b.exit_offset[1] = (float4)(ray.exit_offset.y);
    b.exit_offset[2] = (float4)(ray.exit_offset.z);
    b.t_min = (float4)(ray.t_min);
    b.t_max = (float4)(ray.t_max);
    return b;
}

// Four candidates; `mask` has a bit for each that counts.
typedef struct BlockHits {
    uint mask;
    float4 t, u, v;
    float4 determinant;
} BlockHits;

// The own-box rule (within_own_box) for four boxes.
void limit_to_own_boxes(const BlockRay ray, const float4 *const lower, const float4 *const upper, BlockHits *hits)
{
    float4 entry = ray.t_min;
    float4 exit = ray.t_max;
    for (int axis = 0; axis < 3; ++axis) {
        const int runs_down = ray.inverse[axis].x < 0.0f;
        const float4 near_plane = runs_down ? upper[axis] : lower[axis];
        const float4 far_plane = runs_down ? lower[axis] : upper[axis];
        entry = larger4(fma(near_plane, ray.inverse[axis], ray.entry_offset[axis]), entry);
        exit = smaller4(fma(far_plane, ray.inverse[axis], ray.exit_offset[axis]), exit);
    }
    hits->mask &= mask_of_4((entry <= exit) & (hits->t >= ray.t_min) & (hits->t <= ray.t_max));
    hits->t = smaller4(larger4(hits->t, entry), exit);
}

// The exact sign of edge functions whose rounded products were equal: see edge_function.
float4 exact_where_zero(const float4 difference, const float4 ax, const float4 ay, const float4 bx, const float4 by)
{
    const float4 exact = fma(ax, by, -(ax * by)) - fma(ay, bx, -(ay * bx));
    return difference == 0.0f ? exact : difference;
}

BlockHits intersect_triangle_block(const BlockRay ray, const global TriangleBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    BlockHits hits;
    const float4 az = columns[ray.kz] - ray.origin_z;
    const float4 bz = columns[3 + ray.kz] - ray.origin_z;
    const float4 cz = columns[6 + ray.kz] - ray.origin_z;
    const float4 ax = fma(ray.shear_x, az, columns[ray.kx] - ray.origin_x);
    const float4 ay = fma(ray.shear_y, az, columns[ray.ky] - ray.origin_y);
    const float4 bx = fma(ray.shear_x, bz, columns[3 + ray.kx] - ray.origin_x);
    const float4 by = fma(ray.shear_y, bz, columns[3 + ray.ky] - ray.origin_y);
    const float4 cx = fma(ray.shear_x, cz, columns[6 + ray.kx] - ray.origin_x);
    const float4 cy = fma(ray.shear_y, cz, columns[6 + ray.ky] - ray.origin_y);
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
    hits.mask &= ~mask_of_4(hits.determinant == 0.0f);
    if (!hits.mask) return hits;

    const float4 r = divide4((float4)(1.0f), hits.determinant);
    hits.u = v * r;
    hits.v = w * r;
    hits.t = fma(u * r, ray.shear_z * az, fma(hits.u, ray.shear_z * bz, hits.v * (ray.shear_z * cz)));

    float4 lower[3], upper[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float4 a = columns[axis];
        const float4 b = columns[3 + axis];
        const float4 c = columns[6 + axis];
        lower[axis] = smaller4(a, smaller4(b, c));
        upper[axis] = larger4(a, larger4(b, c));
    }
    limit_to_own_boxes(ray, lower, upper, &hits);
    return hits;
}

float4 sphere_of_block(const global SphereBlock *block, const uint lane)
{
    return (float4)(block->center_radius[0][lane], block->center_radius[1][lane], block->center_radius[2][lane],
                    block->center_radius[3][lane]);
}

// The spheres of a block whose boxes the ray's line passes, as bits. NaN (an unused lane) is passed by.
uint enter_sphere_boxes(const BlockRay ray, const global SphereBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    float4 entry = (float4)(-INFINITY);
    float4 exit = (float4)(INFINITY);
    int4 is_used = columns[3] == columns[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float4 lower = columns[axis] - columns[3];
        const float4 upper = columns[axis] + columns[3];
        const int runs_down = ray.inverse[axis].x < 0.0f;
        entry = larger4(fma(runs_down ? upper : lower, ray.inverse[axis], ray.entry_offset[axis]), entry);
        exit = smaller4(fma(runs_down ? lower : upper, ray.inverse[axis], ray.exit_offset[axis]), exit);
    }
    return mask_of_4((entry <= exit) & is_used);
}
