// One triangle or sphere against the sixteen rays of a group.
#include "device/make_ray_group.cl"
#include "device/ray_group_tests.x16.cl"

#define CASTOR_GROUP_COLUMN(group, name) vload16(0, (group)->name)

// Applies the own-box rule and nearer_hit, ray by ray, to the hits of one primitive. Returns the rays that have a
// better hit now, as bits.
CASTOR_INLINE uint accept_group_hits(RayGroup *group, const BoxPlanes16 planes, PrimitiveHits16 hits,
                                     const uint primitive)
{
    hits = within_own_box16(slabs_of_group16(group, 0), planes, CASTOR_GROUP_COLUMN(group, t_min),
                            CASTOR_GROUP_COLUMN(group, t_max), hits);
    const float16 best_t = CASTOR_GROUP_COLUMN(group, best_t);
    const uint16 best_primitive = CASTOR_GROUP_COLUMN(group, best_primitive);
    const int16 accepted =
        hits.accepted & ((hits.t < best_t) | ((hits.t == best_t) & ((uint16)(primitive) < best_primitive)));
    const uint mask = mask_of16(accepted);
    if (!mask) return 0;
    store_reals16(accepted ? hits.t : best_t, group->best_t);
    store_reals16(accepted ? hits.u : CASTOR_GROUP_COLUMN(group, best_u), group->best_u);
    store_reals16(accepted ? hits.v : CASTOR_GROUP_COLUMN(group, best_v), group->best_v);
    store_wholes16(accepted ? (uint16)(primitive) : best_primitive, group->best_primitive);
    return mask;
}

// Finds where rays meet the plane of a triangle; `inside` is true where the triangle counts there. Returns 0 where it
// is true nowhere; then *weights are not said.
CASTOR_INLINE int find_weights_in_triangle(const SceneColumns scene, const RelativeTriangle16 sheared,
                                           const uint primitive, TriangleWeights16 *weights)
{
    if (!mask_of16(may_hit_triangle16(sheared))) return 0;
    *weights = triangle_weights16(sheared);
    uint inside = mask_of16(weights->inside);
    if (!inside) return 0;
    if (scene.params.flags & CASTOR_TRACE_CULL_BACK_FACES) {
        Candidate from_behind = no_candidate();
        from_behind.from_behind = 1;
        if (is_culled(scene, primitive, from_behind)) inside &= mask_of16(weights->determinant > 0.0f);
        weights->inside = lanes_of_mask16(inside);
    }
    return inside != 0;
}

// Returns the corner of a triangle of a block, whose first coordinate is at `at`.
CASTOR_INLINE float3 corner_of_block(const global float *at) { return (float3)(at[0], at[4], at[8]); }

// Returns the planes of one box for the rays of a group, whose directions may differ.
CASTOR_INLINE BoxPlanes16 planes_of_box_for_group(const RayGroup *group, const float3 lower, const float3 upper)
{
    return box_planes16(slabs_of_group16(group, 0), (float16)(lower.x), (float16)(lower.y), (float16)(lower.z),
                        (float16)(upper.x), (float16)(upper.y), (float16)(upper.z));
}

// Returns when the group's rays are in the box at `place` of the node, no later than their best hits.
CASTOR_INLINE Interval16 group_interval_in_child(const RayGroup *group, const global WideNode *node, const uint place)
{
    const float3 lower = (float3)(node->planes[0][0][place], node->planes[1][0][place], node->planes[2][0][place]);
    const float3 upper = (float3)(node->planes[0][1][place], node->planes[1][1][place], node->planes[2][1][place]);
    return slab_test16(slabs_of_group16(group, 0), planes_of_box_for_group(group, lower, upper),
                       CASTOR_GROUP_COLUMN(group, t_min), CASTOR_GROUP_COLUMN(group, best_t));
}

// Returns a point relative to the rays' origins, along one of their axes, which may differ.
CASTOR_INLINE float16 along_axes(const float3 point, const uint16 axis, const float16 origin)
{
    return choose_axis16(axis, (float16)(point.x), (float16)(point.y), (float16)(point.z)) - origin;
}

// Tests one triangle of a leaf block against the group.
CASTOR_INLINE void visit_triangle_by_group(RayGroup *group, const SceneColumns scene, const global TriangleBlock *block,
                                           const uint place)
{
    CASTOR_COUNT(scene, BUNDLE_TRIANGLE);
    const global float *at = (const global float *)block + place;
    const float3 p0 = corner_of_block(at), p1 = corner_of_block(at + 12), p2 = corner_of_block(at + 24);
    const uint16 kx = CASTOR_GROUP_COLUMN(group, kx);
    const uint16 ky = CASTOR_GROUP_COLUMN(group, ky);
    const uint16 kz = CASTOR_GROUP_COLUMN(group, kz);
    const float16 ox = CASTOR_GROUP_COLUMN(group, origin_x);
    const float16 oy = CASTOR_GROUP_COLUMN(group, origin_y);
    const float16 oz = CASTOR_GROUP_COLUMN(group, origin_z);
    RelativeTriangle16 triangle;
    triangle.ax = along_axes(p0, kx, ox);
    triangle.ay = along_axes(p0, ky, oy);
    triangle.az = along_axes(p0, kz, oz);
    triangle.bx = along_axes(p1, kx, ox);
    triangle.by = along_axes(p1, ky, oy);
    triangle.bz = along_axes(p1, kz, oz);
    triangle.cx = along_axes(p2, kx, ox);
    triangle.cy = along_axes(p2, ky, oy);
    triangle.cz = along_axes(p2, kz, oz);
    const Shear16 shear = shear_of_group16(group, 0);
    const RelativeTriangle16 sheared = shear_triangle16(shear, triangle);
    const uint primitive = block->primitive[place];
    TriangleWeights16 weights;
    if (!find_weights_in_triangle(scene, sheared, primitive, &weights)) return;
    accept_group_hits(group, planes_of_box_for_group(group, lower_corner(p0, p1, p2), upper_corner(p0, p1, p2)),
                      triangle_hits16(shear, sheared, weights), primitive);
}

#if CASTOR_HAS_SPHERES
// Returns the hits of the group's rays and one sphere of a leaf block; *is_missed: there is none.
CASTOR_INLINE PrimitiveHits16 group_hits_of_sphere(const RayGroup *group, const float3 center, const float radius,
                                                   int *is_missed)
{
    const Spheres16 sphere = {(float16)(center.x), (float16)(center.y), (float16)(center.z), (float16)(radius)};
    const SphereRay16 ray = sphere_ray_of_group16(group, 0);
    const float16 t_min = CASTOR_GROUP_COLUMN(group, t_min);
    PrimitiveHits16 hits;
    *is_missed = mask_of16(sphere_missed16(ray, t_min, sphere)) == 0xffffu;
    if (!*is_missed) hits = sphere_hits16(ray, t_min, CASTOR_GROUP_COLUMN(group, t_max), sphere);
    return hits;
}

CASTOR_INLINE void visit_sphere_by_group(RayGroup *group, const SceneColumns scene, const global SphereBlock *block,
                                         const uint place)
{
    CASTOR_COUNT(scene, BUNDLE_SPHERE);
    const float3 center =
        (float3)(block->center_radius[0][place], block->center_radius[1][place], block->center_radius[2][place]);
    const float radius = block->center_radius[3][place];
    int is_missed;
    const PrimitiveHits16 hits = group_hits_of_sphere(group, center, radius, &is_missed);
    if (!is_missed)
        accept_group_hits(group, planes_of_box_for_group(group, center - radius, center + radius), hits,
                          block->primitive[place]);
}
#endif
