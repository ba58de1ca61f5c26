// One ray of a group against a leaf block: four triangles or four spheres at once.
#include "castor/shared/layout.h"
#include "device/make_ray_group.cl"
#include "device/ray_group_tests.x4.cl"

CASTOR_INLINE Candidate lane_candidate(const float t, const float u, const float v, const float determinant)
{
    Candidate candidate;
    candidate.t = t;
    candidate.u = u;
    candidate.v = v;
    candidate.from_behind = determinant < 0.0f;
    return candidate;
}

// Offers one lane's hit with a primitive to nearer_hit.
CASTOR_INLINE Hit with_lane_hit(const Hit best, const SceneColumns scene, const float t, const float u, const float v,
                                const float determinant, const uint primitive)
{
    const Candidate candidate = lane_candidate(t, u, v, determinant);
    return is_culled(scene, primitive, candidate) ? best : nearer_hit(best, candidate, primitive);
}

// Applies nearer_hit to the hits of a block. Returns whether the ray has a better hit now.
CASTOR_INLINE int accept_block_hits(RayGroup *group, const uint place, const SceneColumns scene,
                                    const PrimitiveHits4 hits, const global uint *primitives)
{
    uint mask = mask_of4(hits.accepted & (hits.t <= group->best_t[place]));
    if (!mask) return 0;
    float t[4], u[4], v[4], determinant[4];
    vstore4(hits.t, 0, t);
    vstore4(hits.u, 0, u);
    vstore4(hits.v, 0, v);
    vstore4(hits.determinant, 0, determinant);
    const Hit before = best_of_ray(group, place);
    Hit best = before;
    for (; mask; mask &= mask - 1) {
        const uint i = lowest_bit(mask);
        best = with_lane_hit(best, scene, t[i], u[i], v[i], determinant[i], primitives[i]);
    }
    set_best_of_ray(group, place, best);
    return best.primitive != before.primitive || best.t != before.t;
}

// Applies the own-box rule.
CASTOR_INLINE PrimitiveHits4 within_own_boxes(const RayGroup *group, const uint place, const BoxPlanes4 planes,
                                              const PrimitiveHits4 hits)
{
    return within_own_box4(slabs_of_group4(group, place), planes, rays_of4(group->t_min, place),
                           rays_of4(group->t_max, place), hits);
}

// Returns the triangles of a block as the ray sees them.
CASTOR_INLINE RelativeTriangle4 sheared_block(const RayGroup *group, const uint place,
                                              const global TriangleBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    const global float4 *along_x = columns + group->kx[place];
    const global float4 *along_y = columns + group->ky[place];
    const global float4 *along_z = columns + group->kz[place];
    const float origin_x = group->origin_x[place];
    const float origin_y = group->origin_y[place];
    const float origin_z = group->origin_z[place];
    RelativeTriangle4 triangle;
    triangle.ax = along_x[0] - origin_x;
    triangle.ay = along_y[0] - origin_y;
    triangle.az = along_z[0] - origin_z;
    triangle.bx = along_x[3] - origin_x;
    triangle.by = along_y[3] - origin_y;
    triangle.bz = along_z[3] - origin_z;
    triangle.cx = along_x[6] - origin_x;
    triangle.cy = along_y[6] - origin_y;
    triangle.cz = along_z[6] - origin_z;
    return shear_triangle4(shear_of_group4(group, place), triangle);
}

// Returns the planes of the own boxes of a block's triangles, for rays that go in the directions of the slabs.
CASTOR_INLINE BoxPlanes4 planes_of_block(const Slabs4 slabs, const global TriangleBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    return box_planes4(
        slabs, least_of_three4(columns[0], columns[3], columns[6]), least_of_three4(columns[1], columns[4], columns[7]),
        least_of_three4(columns[2], columns[5], columns[8]), greatest_of_three4(columns[0], columns[3], columns[6]),
        greatest_of_three4(columns[1], columns[4], columns[7]), greatest_of_three4(columns[2], columns[5], columns[8]));
}

// Returns the hits of a ray and the triangles of a block.
CASTOR_INLINE PrimitiveHits4 hits_of_block(const RayGroup *group, const uint place, const global TriangleBlock *block,
                                           const RelativeTriangle4 sheared, const TriangleWeights4 weights)
{
    const BoxPlanes4 planes = planes_of_block(slabs_of_group4(group, place), block);
    return within_own_boxes(group, place, planes, triangle_hits4(shear_of_group4(group, place), sheared, weights));
}

// Returns what accept_block_hits does.
CASTOR_INLINE int visit_triangle_block(RayGroup *group, const uint place, const SceneColumns scene,
                                       const global TriangleBlock *block)
{
    const RelativeTriangle4 sheared = sheared_block(group, place, block);
    if (!mask_of4(may_hit_triangle4(sheared))) return 0;
    const TriangleWeights4 weights = triangle_weights4(sheared);
    if (!mask_of4(weights.inside)) return 0;
    return accept_block_hits(group, place, scene, hits_of_block(group, place, block, sheared, weights),
                             block->primitive);
}

#if CASTOR_HAS_SPHERES
CASTOR_INLINE Spheres4 spheres_of_block(const global SphereBlock *block)
{
    const global float4 *columns = (const global float4 *)block;
    const Spheres4 spheres = {columns[0], columns[1], columns[2], columns[3]};
    return spheres;
}

// Returns which spheres the ray may hit, no farther than its best hit so far: what is hit beyond it would not count.
CASTOR_INLINE int4 may_hit_spheres(const RayGroup *group, const uint place, const Spheres4 spheres,
                                   const BoxPlanes4 planes)
{
    const float4 t_min = rays_of4(group->t_min, place);
    const Interval4 interval = slab_test4(slabs_of_group4(group, place), planes, t_min, rays_of4(group->best_t, place));
    // An unused lane, whose radius is NaN, is missed.
    return (interval.entry <= interval.exit) & (spheres.radius == spheres.radius) &
           !sphere_missed4(sphere_ray_of_group4(group, place), t_min, spheres);
}

CASTOR_INLINE void visit_sphere_block(RayGroup *group, const uint place, const SceneColumns scene,
                                      const global SphereBlock *block)
{
    const Spheres4 spheres = spheres_of_block(block);
    const float4 t_min = rays_of4(group->t_min, place);
    const BoxPlanes4 planes = planes_of_spheres4(slabs_of_group4(group, place), spheres);
    const SphereRay4 ray = sphere_ray_of_group4(group, place);
    const int4 possible = may_hit_spheres(group, place, spheres, planes);
    if (!mask_of4(possible)) return;
    PrimitiveHits4 hits = sphere_hits4(ray, t_min, rays_of4(group->t_max, place), spheres);
    hits.accepted &= possible;
    accept_block_hits(group, place, scene, within_own_boxes(group, place, planes, hits), block->primitive);
}
#endif
