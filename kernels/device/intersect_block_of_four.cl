// Four alike rays of a group against a leaf block of four triangles: ray i / 4 and triangle i % 4 meet in lane i. The
// rays agree in the signs of their directions and in their longest axis.
#include "castor/shared/layout.h"
#include "device/intersect_blocks.cl"
#include "device/ray_group_tests.x16.cl"

// The places of four rays in their group, the first ones again where there are fewer; and that of lane i's ray.
typedef struct FourRays {
    uint place[4];
    uint count;  // of different ones
    uint16 of_lane;
} FourRays;

// Takes up to four rays out of *rays, which are bits and not zero.
CASTOR_INLINE FourRays take_four_rays(uint *rays)
{
    FourRays four;
    uint place = lowest_bit(*rays);
    four.count = min(popcount(*rays), 4u);
    for (uint i = 0; i < 4; ++i) {
        if (*rays) place = lowest_bit(*rays);
        *rays &= *rays - 1;
        four.place[i] = place;
    }
    four.of_lane =
        (uint16)((uint4)(four.place[0]), (uint4)(four.place[1]), (uint4)(four.place[2]), (uint4)(four.place[3]));
    return four;
}

CASTOR_INLINE float16 rays_of_four(const RayFloats column, const FourRays four)
{
#if defined(__AVX512F__)
    return permute_16(vload16(0, column), four.of_lane);
#else
    return (float16)((float4)(column[four.place[0]]), (float4)(column[four.place[1]]), (float4)(column[four.place[2]]),
                     (float4)(column[four.place[3]]));
#endif
}

CASTOR_INLINE float16 four_times(const float4 triangles)
{
    return (float16)(triangles, triangles, triangles, triangles);
}

CASTOR_INLINE Slabs16 slabs_of_four(const RayGroup *group, const FourRays four)
{
    Slabs16 slabs;
    slabs.inverse_x = rays_of_four(group->inverse_x, four);
    slabs.inverse_y = rays_of_four(group->inverse_y, four);
    slabs.inverse_z = rays_of_four(group->inverse_z, four);
    slabs.entry_x = rays_of_four(group->entry_x, four);
    slabs.entry_y = rays_of_four(group->entry_y, four);
    slabs.entry_z = rays_of_four(group->entry_z, four);
    slabs.exit_x = rays_of_four(group->exit_x, four);
    slabs.exit_y = rays_of_four(group->exit_y, four);
    slabs.exit_z = rays_of_four(group->exit_z, four);
    return slabs;
}

// Returns the planes of the boxes of four triangles, for four rays.
CASTOR_INLINE BoxPlanes16 planes_of_block(const RayGroup *group, const FourRays four, const global float4 *columns)
{
    const float4 lower_x = least_of_three4(columns[0], columns[3], columns[6]);
    const float4 lower_y = least_of_three4(columns[1], columns[4], columns[7]);
    const float4 lower_z = least_of_three4(columns[2], columns[5], columns[8]);
    const float4 upper_x = greatest_of_three4(columns[0], columns[3], columns[6]);
    const float4 upper_y = greatest_of_three4(columns[1], columns[4], columns[7]);
    const float4 upper_z = greatest_of_three4(columns[2], columns[5], columns[8]);
    const int down_x = group->inverse_x[four.place[0]] < 0.0f;
    const int down_y = group->inverse_y[four.place[0]] < 0.0f;
    const int down_z = group->inverse_z[four.place[0]] < 0.0f;
    BoxPlanes16 planes;
    planes.near_x = four_times(down_x ? upper_x : lower_x);
    planes.near_y = four_times(down_y ? upper_y : lower_y);
    planes.near_z = four_times(down_z ? upper_z : lower_z);
    planes.far_x = four_times(down_x ? lower_x : upper_x);
    planes.far_y = four_times(down_y ? lower_y : upper_y);
    planes.far_z = four_times(down_z ? lower_z : upper_z);
    return planes;
}

CASTOR_INLINE void visit_block_of_four(RayGroup *group, const FourRays four, const SceneColumns scene,
                                       const global TriangleBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    const global float4 *along_x = columns + group->kx[four.place[0]];
    const global float4 *along_y = columns + group->ky[four.place[0]];
    const global float4 *along_z = columns + group->kz[four.place[0]];
    const float16 origin_x = rays_of_four(group->origin_x, four);
    const float16 origin_y = rays_of_four(group->origin_y, four);
    const float16 origin_z = rays_of_four(group->origin_z, four);
    RelativeTriangle16 triangle;
    triangle.ax = four_times(along_x[0]) - origin_x;
    triangle.ay = four_times(along_y[0]) - origin_y;
    triangle.az = four_times(along_z[0]) - origin_z;
    triangle.bx = four_times(along_x[3]) - origin_x;
    triangle.by = four_times(along_y[3]) - origin_y;
    triangle.bz = four_times(along_z[3]) - origin_z;
    triangle.cx = four_times(along_x[6]) - origin_x;
    triangle.cy = four_times(along_y[6]) - origin_y;
    triangle.cz = four_times(along_z[6]) - origin_z;
    Shear16 shear;
    shear.x = rays_of_four(group->shear_x, four);
    shear.y = rays_of_four(group->shear_y, four);
    shear.z = rays_of_four(group->shear_z, four);
    const RelativeTriangle16 sheared = shear_triangle16(shear, triangle);
    if (!mask_of16(may_hit_triangle16(sheared))) return;
    const TriangleWeights16 weights = triangle_weights16(sheared);
    if (!mask_of16(weights.inside)) return;
    const PrimitiveHits16 hits = within_own_box16(slabs_of_four(group, four), planes_of_block(group, four, columns),
                                                  rays_of_four(group->t_min, four), rays_of_four(group->t_max, four),
                                                  triangle_hits16(shear, sheared, weights));
    uint mask = mask_of16(hits.accepted & (hits.t <= rays_of_four(group->best_t, four)));
    if (!mask) return;
    float t[16], u[16], v[16], determinant[16];
    store_reals16(hits.t, t);
    store_reals16(hits.u, u);
    store_reals16(hits.v, v);
    store_reals16(hits.determinant, determinant);
    for (; mask; mask &= mask - 1) {
        const uint i = lowest_bit(mask);
        const uint place = four.place[i / 4];
        set_best_of_ray(
            group, place,
            with_lane_hit(best_of_ray(group, place), scene, t[i], u[i], v[i], determinant[i], block->primitive[i % 4]));
    }
}
