// Where rays met primitives, as shading needs it, for CASTOR_LANES lanes (see lanes.cl).
#include "device/surface.cl"
#include "device/vector.lanes.cl"

#if CASTOR_SURFACES_HAVE_AXES
// Two edges of surfaces, and how texture coordinates change along them: what axes_of_edges takes. All of it 0 where
// there are no texture coordinates.
typedef struct LANES(Edges) {
    LANES(Vectors) e1, e2;
    Real du1, dv1, du2, dv2;
} LANES(Edges);

// dp/du and dp/dv; both (0,0,0) where there are no texture coordinates.
typedef struct LANES(Axes) {
    LANES(Vectors) along_u;
    LANES(Vectors) along_v;
} LANES(Axes);
#endif

typedef struct LANES(Surfaces) {
    LANES(Vectors) position;
    LANES(Vectors) normal;  // unit, outward: not turned towards who sees the surface from behind
    Whole material;
#if CASTOR_SURFACES_HAVE_UVS
    LANES(Twos) uv;  // of triangles; (0,0) of all else
#endif
#if CASTOR_SURFACES_HAVE_AXES
    LANES(Edges) edge;  // of triangles; none of all else
#endif
} LANES(Surfaces);

CASTOR_INLINE LANES(Vectors) LANES(weighted_sums)(const LANES(Vectors) a, const LANES(Vectors) b,
                                                  const LANES(Vectors) c, const Real u, const Real v)
{
    const Real w = 1.0f - u - v;
    return LANES(vectors)(fma(w, a.x, fma(u, b.x, v * c.x)), fma(w, a.y, fma(u, b.y, v * c.y)),
                          fma(w, a.z, fma(u, b.z, v * c.z)));
}

// The least cosine with a triangle's own normal of what a smooth normal mirrors, where the ray's is not less itself.
#define CASTOR_LEAST_MIRRORED_COSINE 0.01f

// Returns the largest component, in magnitude.
CASTOR_INLINE Real LANES(largest_components)(const LANES(Vectors) a)
{
    return LANES(larger)(fabs(a.x), LANES(larger)(fabs(a.y), fabs(a.z)));
}

// Returns the normals (p1-p0) x (p2-p0), of any length. The edges are brought to a size near 1 first, so that the
// products of tiny triangles do not vanish.
CASTOR_INLINE LANES(Vectors)
    LANES(crossed_edges)(const LANES(Vectors) p0, const LANES(Vectors) p1, const LANES(Vectors) p2)
{
    const LANES(Vectors) e1 = LANES(difference_of_vectors)(p1, p0);
    const LANES(Vectors) e2 = LANES(difference_of_vectors)(p2, p0);
    const Real one = (Real)(1.0f);
    const LANES(Vectors) a = LANES(scaled_vectors)(e1, LANES(divide)(one, LANES(largest_components)(e1)));
    const LANES(Vectors) b = LANES(scaled_vectors)(e2, LANES(divide)(one, LANES(largest_components)(e2)));
    return LANES(cross_products)(a, b);
}

// Returns smooth normals of triangles, bent where a mirror with such a normal would send rays to the other side of the
// triangle, or where they see the normal from another side than the triangle: both happen at rims. What is mirrored
// then leaves just above the triangle, so that nothing gets into a solid but by refraction. `across`: the triangles'
// own normals, of any length, on whichever side.
CASTOR_INLINE LANES(Vectors)
    LANES(bent_normals)(const LANES(Vectors) normal, const LANES(Vectors) across, const LANES(Vectors) direction)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Vectors) along = LANES(normalized_vectors)(direction), flat = LANES(normalized_vectors)(across);
    const Real outward = LANES(dot_products)(flat, normal), seen = LANES(dot_products)(flat, along);
    // All as seen from the side that is seen.
    const LANES(Vectors) up = LANES(scaled_vectors)(flat, seen > zero ? -one : one);
    const Mask is_behind = (outward > zero) == (seen > zero);
    const LANES(Vectors) n = LANES(scaled_vectors)(normal, is_behind ? -one : one);
    const LANES(Vectors) mirrored = LANES(points_on_rays)(along, -2.0f * LANES(dot_products)(n, along), n);
    const Real height = LANES(dot_products)(mirrored, up),
               least = LANES(smaller)(0.9f * fabs(seen), (Real)(CASTOR_LEAST_MIRRORED_COSINE));
    const Mask is_bent = (outward != zero) & (seen != zero) & !(height >= least);
    if (!LANES(mask_of)(is_bent)) return normal;
    const LANES(Vectors) lifted = LANES(normalized_vectors)(LANES(points_on_rays)(mirrored, least - height, up));
    const LANES(Vectors) bent = LANES(normalized_vectors)(LANES(difference_of_vectors)(lifted, along));
    return LANES(choose_vectors)(is_bent, LANES(scaled_vectors)(bent, is_behind ? -one : one), normal);
}

// What the corners of triangles have, and their mesh.
typedef struct LANES(Corners) {
    LANES(Vectors) p0, p1, p2;
    LANES(Vectors) n0, n1, n2;  // (0,0,0) where the mesh is flat
    int has_normals;            // 0: all meshes are flat
    Whole material;
#if CASTOR_SURFACES_HAVE_UVS
    LANES(Twos) uv0, uv1, uv2;  // (0,0) where the mesh has none
#endif
} LANES(Corners);

// Returns the same element of a column of threes, or of twos, in every lane.
CASTOR_INLINE LANES(Vectors) LANES(same_three)(const global float *threes, const uint number)
{
    const float3 three = vload3(number, threes);
    return LANES(vectors)((Real)(three.x), (Real)(three.y), (Real)(three.z));
}

CASTOR_INLINE LANES(Twos) LANES(same_two)(const global float *twos, const uint number)
{
    const float2 two = vload2(number, twos);
    const LANES(Twos) same = {(Real)(two.x), (Real)(two.y)};
    return same;
}

// Returns the corners of one triangle, in every lane.
CASTOR_INLINE LANES(Corners) LANES(corners_of_triangle)(const TriangleColumns columns, const uint triangle)
{
    const uint3 vertex = vload3(triangle, columns.triangle_vertices);
    const MeshRange mesh = mesh_of_triangle(columns.mesh_ranges, columns.mesh_count, triangle);
    const Real zero = (Real)(0.0f);
    LANES(Corners) corner;
    corner.p0 = LANES(same_three)(columns.vertex_position, vertex.x);
    corner.p1 = LANES(same_three)(columns.vertex_position, vertex.y);
    corner.p2 = LANES(same_three)(columns.vertex_position, vertex.z);
    corner.n0 = corner.n1 = corner.n2 = LANES(vectors)(zero, zero, zero);
    corner.has_normals = mesh.first_normal != CASTOR_INVALID_INDEX;
    if (corner.has_normals) {
        const uint shift = mesh.first_normal - mesh.first_vertex;  // modulo 2^32
        corner.n0 = LANES(same_three)(columns.vertex_normal, vertex.x + shift);
        corner.n1 = LANES(same_three)(columns.vertex_normal, vertex.y + shift);
        corner.n2 = LANES(same_three)(columns.vertex_normal, vertex.z + shift);
    }
    corner.material = (Whole)(mesh.material);
#if CASTOR_SURFACES_HAVE_UVS
    corner.uv0.x = corner.uv0.y = zero;
    corner.uv1 = corner.uv2 = corner.uv0;
    if (mesh.first_uv != CASTOR_INVALID_INDEX) {
        const uint shift = mesh.first_uv - mesh.first_vertex;  // modulo 2^32
        corner.uv0 = LANES(same_two)(columns.vertex_uv, vertex.x + shift);
        corner.uv1 = LANES(same_two)(columns.vertex_uv, vertex.y + shift);
        corner.uv2 = LANES(same_two)(columns.vertex_uv, vertex.z + shift);
    }
#endif
    return corner;
}

#if CASTOR_LANES > 1
CASTOR_INLINE LANES(Corners) LANES(choose_corners)(const Mask is_a, const LANES(Corners) a, const LANES(Corners) b)
{
    LANES(Corners) corner;
    corner.p0 = LANES(choose_vectors)(is_a, a.p0, b.p0);
    corner.p1 = LANES(choose_vectors)(is_a, a.p1, b.p1);
    corner.p2 = LANES(choose_vectors)(is_a, a.p2, b.p2);
    corner.n0 = LANES(choose_vectors)(is_a, a.n0, b.n0);
    corner.n1 = LANES(choose_vectors)(is_a, a.n1, b.n1);
    corner.n2 = LANES(choose_vectors)(is_a, a.n2, b.n2);
    corner.has_normals = a.has_normals | b.has_normals;
    corner.material = is_a ? a.material : b.material;
#if CASTOR_SURFACES_HAVE_UVS
    corner.uv0 = LANES(choose_twos)(is_a, a.uv0, b.uv0);
    corner.uv1 = LANES(choose_twos)(is_a, a.uv1, b.uv1);
    corner.uv2 = LANES(choose_twos)(is_a, a.uv2, b.uv2);
#endif
    return corner;
}
#endif

// Returns the corners of triangles, where `counts`, which some lane does. Samples of one pixel mostly lie on few
// triangles: each is loaded once, for all lanes that it counts in.
CASTOR_INLINE LANES(Corners)
    LANES(corners_of_triangles)(const TriangleColumns columns, const Mask counts, const Whole triangle)
{
#if CASTOR_LANES == 1
    return corners_of_triangle(columns, triangle);
#else
    uint numbers[CASTOR_LANES];
    LANES(store_wholes)(triangle, numbers);
    uint left = LANES(mask_of)(counts);
    uint number = numbers[lowest_bit(left)];
    LANES(Corners) corner = LANES(corners_of_triangle)(columns, number);
    while (left &= ~LANES(mask_of)(triangle == number)) {
        number = numbers[lowest_bit(left)];
        corner = LANES(choose_corners)(triangle == number, LANES(corners_of_triangle)(columns, number), corner);
    }
    return corner;
#endif
}

#if CASTOR_SURFACES_HAVE_AXES
CASTOR_INLINE LANES(Edges) LANES(choose_edges)(const Mask is_a, const LANES(Edges) a, const LANES(Edges) b)
{
    LANES(Edges) edge;
    edge.e1 = LANES(choose_vectors)(is_a, a.e1, b.e1);
    edge.e2 = LANES(choose_vectors)(is_a, a.e2, b.e2);
    edge.du1 = is_a ? a.du1 : b.du1;
    edge.dv1 = is_a ? a.dv1 : b.dv1;
    edge.du2 = is_a ? a.du2 : b.du2;
    edge.dv2 = is_a ? a.dv2 : b.dv2;
    return edge;
}

CASTOR_INLINE LANES(Edges) LANES(no_edges)(void)
{
    const Real zero = (Real)(0.0f);
    LANES(Edges) edge;
    edge.e1 = edge.e2 = LANES(vectors)(zero, zero, zero);
    edge.du1 = edge.dv1 = edge.du2 = edge.dv2 = zero;
    return edge;
}

CASTOR_INLINE LANES(Edges) LANES(edges_of_triangles)(const LANES(Corners) corner)
{
    LANES(Edges) edge;
    edge.e1 = LANES(difference_of_vectors)(corner.p1, corner.p0);
    edge.e2 = LANES(difference_of_vectors)(corner.p2, corner.p0);
    edge.du1 = corner.uv1.x - corner.uv0.x;
    edge.dv1 = corner.uv1.y - corner.uv0.y;
    edge.du2 = corner.uv2.x - corner.uv0.x;
    edge.dv2 = corner.uv2.y - corner.uv0.y;
    return edge;
}

// Returns twice the areas, with a sign, that the edges span in a picture of area 1.
CASTOR_INLINE Real LANES(determinants_of_edges)(const LANES(Edges) edge)
{
    return fma(edge.du1, edge.dv2, -(edge.du2 * edge.dv1));
}

// Tells where there are axes.
CASTOR_INLINE Mask LANES(have_axes)(const Real determinant)
{
    return (fabs(determinant) >= FLT_MIN) & (fabs(determinant) <= FLT_MAX);
}

// Solves e1 = du1 dp/du + dv1 dp/dv, e2 = du2 dp/du + dv2 dp/dv.
CASTOR_ONCE LANES(Axes) LANES(axes_of_edges)(const LANES(Edges) edge)
{
    const Real determinant = LANES(determinants_of_edges)(edge);
    const Mask is_usual = LANES(have_axes)(determinant);
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real inverse = LANES(divide)(one, is_usual ? determinant : one);
    const Real du1 = edge.du1, dv1 = edge.dv1, du2 = edge.du2, dv2 = edge.dv2;
    const LANES(Vectors) e1 = edge.e1, e2 = edge.e2, none = LANES(vectors)(zero, zero, zero);
    LANES(Axes) axis;
    axis.along_u = LANES(vectors)(fma(dv2, e1.x, -(dv1 * e2.x)) * inverse, fma(dv2, e1.y, -(dv1 * e2.y)) * inverse,
                                  fma(dv2, e1.z, -(dv1 * e2.z)) * inverse);
    axis.along_v = LANES(vectors)(fma(du1, e2.x, -(du2 * e1.x)) * inverse, fma(du1, e2.y, -(du2 * e1.y)) * inverse,
                                  fma(du1, e2.z, -(du2 * e1.z)) * inverse);
    axis.along_u = LANES(choose_vectors)(is_usual, axis.along_u, none);
    axis.along_v = LANES(choose_vectors)(is_usual, axis.along_v, none);
    return axis;
}
#endif

// triangle_surfaces, with the columns one by one: a struct goes through memory to a function.
CASTOR_ONCE LANES(Surfaces)
    LANES(surfaces_of_corners)(const uint mesh_count, const global MeshRange *mesh_ranges,
                               const global uint *triangle_vertices, const global float *vertex_position,
                               const global float *vertex_normal, const global float *vertex_uv, const Mask counts,
                               const Whole triangle, const Real u, const Real v, const int bends_normals,
                               const LANES(Vectors) direction)
{
    const TriangleColumns columns = {mesh_count,      mesh_ranges,   triangle_vertices,
                                     vertex_position, vertex_normal, vertex_uv};
    const LANES(Corners) corner = LANES(corners_of_triangles)(columns, counts, triangle);
    const Real zero = (Real)(0.0f);
    LANES(Surfaces) surface;
    surface.position = LANES(weighted_sums)(corner.p0, corner.p1, corner.p2, u, v);
    surface.normal = LANES(vectors)(zero, zero, zero);
    surface.material = corner.material;
#if CASTOR_SURFACES_HAVE_UVS
    const Real w = 1.0f - u - v;
    surface.uv.x = fma(w, corner.uv0.x, fma(u, corner.uv1.x, v * corner.uv2.x));
    surface.uv.y = fma(w, corner.uv0.y, fma(u, corner.uv1.y, v * corner.uv2.y));
#endif
#if CASTOR_SURFACES_HAVE_AXES
    surface.edge = LANES(edges_of_triangles)(corner);
#endif
    if (corner.has_normals)
        surface.normal = LANES(normalized_vectors)(LANES(weighted_sums)(corner.n0, corner.n1, corner.n2, u, v));
    const Mask is_flat = counts & (LANES(dot_products)(surface.normal, surface.normal) == 0.0f);
    if ((bends_normals && corner.has_normals) || LANES(mask_of)(is_flat)) {
        const LANES(Vectors) across = LANES(crossed_edges)(corner.p0, corner.p1, corner.p2);
        if (bends_normals) surface.normal = LANES(bent_normals)(surface.normal, across, direction);
        if (LANES(mask_of)(is_flat))
            surface.normal = LANES(choose_vectors)(is_flat, LANES(normalized_vectors)(across), surface.normal);
    }
    return surface;
}

// Returns the surfaces of triangles, where `counts`, which some lane does. `direction`: of the rays, in the space of
// the triangles.
CASTOR_INLINE LANES(Surfaces)
    LANES(triangle_surfaces)(const SurfaceColumns columns, const Mask counts, const Whole triangle, const Real u,
                             const Real v, const LANES(Vectors) direction)
{
#if CASTOR_SURFACES_HAVE_UVS
    const global float *vertex_uv = columns.vertex_uv;
#else
    const global float *vertex_uv = 0;
#endif
    return LANES(surfaces_of_corners)(columns.params.mesh_count, columns.mesh_ranges, columns.triangle_vertices,
                                      columns.vertex_position, columns.vertex_normal, vertex_uv, counts, triangle, u, v,
                                      columns.params.flags & CASTOR_TRACE_BENDS_NORMALS, direction);
}

CASTOR_INLINE LANES(Surfaces)
    LANES(sphere_surfaces)(const LANES(Vectors) point, const LANES(Rows) center_radius, const Whole material)
{
    const LANES(Vectors) center = LANES(vectors_of_rows)(center_radius);
    LANES(Surfaces) surface;
    surface.normal = LANES(normalized_vectors)(LANES(difference_of_vectors)(point, center));
    surface.position = LANES(points_on_rays)(center, center_radius.w, surface.normal);
    surface.material = material;
#if CASTOR_SURFACES_HAVE_UVS
    surface.uv.x = surface.uv.y = (Real)(0.0f);
#endif
#if CASTOR_SURFACES_HAVE_AXES
    surface.edge = LANES(no_edges)();
#endif
    return surface;
}

CASTOR_INLINE LANES(Surfaces) LANES(choose_surfaces)(const Mask is_a, const LANES(Surfaces) a, const LANES(Surfaces) b)
{
    LANES(Surfaces) surface;
    surface.position = LANES(choose_vectors)(is_a, a.position, b.position);
    surface.normal = LANES(choose_vectors)(is_a, a.normal, b.normal);
    surface.material = is_a ? a.material : b.material;
#if CASTOR_SURFACES_HAVE_UVS
    surface.uv = LANES(choose_twos)(is_a, a.uv, b.uv);
#endif
#if CASTOR_SURFACES_HAVE_AXES
    surface.edge = LANES(choose_edges)(is_a, a.edge, b.edge);
#endif
    return surface;
}

CASTOR_INLINE LANES(Surfaces) LANES(no_surfaces)(void)
{
    const Real zero = (Real)(0.0f);
    LANES(Surfaces) surface;
    surface.position = surface.normal = LANES(vectors)(zero, zero, zero);
    surface.material = (Whole)(CASTOR_INVALID_INDEX);
#if CASTOR_SURFACES_HAVE_UVS
    surface.uv.x = surface.uv.y = zero;
#endif
#if CASTOR_SURFACES_HAVE_AXES
    surface.edge = LANES(no_edges)();
#endif
    return surface;
}

// Returns what hits in no instance but 0 name, where the scene is no chunk: see primitive_of_hit.
CASTOR_INLINE Whole LANES(primitives_in_place)(const SurfaceColumns columns, const Geometry geometry,
                                               const Whole primitive)
{
    const Whole after_triangles = primitive - geometry.triangle_count;
    const Whole sphere = columns.params.triangle_count + geometry.first_sphere + after_triangles;
    const Whole plane =
        columns.params.triangle_count + columns.params.sphere_count + after_triangles - geometry.sphere_count;
    const Whole others = after_triangles < geometry.sphere_count ? sphere : plane;
    return primitive < geometry.triangle_count ? geometry.first_triangle + primitive : others;
}

// Returns the surfaces of hits that are in no instance but 0, where `counts`. `primitive`: what primitive_of_hit says
// of the hits; t, u and v are theirs.
CASTOR_INLINE LANES(Surfaces)
    LANES(surfaces_in_place)(const SurfaceColumns columns, const Mask counts, const Whole primitive, const Real t,
                             const Real u, const Real v, const LANES(Vectors) origin, const LANES(Vectors) direction)
{
    const Whole sphere = primitive - columns.params.triangle_count;
    const Whole plane = sphere - columns.params.sphere_count;
    const Mask is_triangle = counts & (primitive < columns.params.triangle_count);
    const Mask is_sphere = counts & !is_triangle & (sphere < columns.params.sphere_count);
    const Mask is_plane = counts & !is_triangle & !is_sphere;
    LANES(Surfaces) surface;
    surface.position = LANES(points_on_rays)(origin, t, direction);
    surface.normal = surface.position;
    surface.material = (Whole)(CASTOR_INVALID_INDEX);
#if CASTOR_SURFACES_HAVE_UVS
    surface.uv.x = surface.uv.y = (Real)(0.0f);
#endif
#if CASTOR_SURFACES_HAVE_AXES
    surface.edge = LANES(no_edges)();
#endif
    if (LANES(mask_of)(is_plane)) {
        const Whole number = is_plane ? plane : (Whole)(0);
        surface.normal = LANES(gather_vectors)(columns.plane_normal, number);
        surface.material = LANES(gather_wholes)(columns.plane_material, number, 1);
    }
    if (LANES(mask_of)(is_sphere)) {
        const Whole number = is_sphere ? sphere : (Whole)(0);
        const LANES(Surfaces) spheres = LANES(sphere_surfaces)(
            LANES(points_on_rays)(origin, t, direction), LANES(gather_rows)(columns.sphere_center_radius, number),
            LANES(gather_wholes)(columns.sphere_material, number, 1));
        surface = LANES(choose_surfaces)(is_sphere, spheres, surface);
    }
    if (LANES(mask_of)(is_triangle)) {
        const LANES(Surfaces) triangles = LANES(triangle_surfaces)(columns, is_triangle, primitive, u, v, direction);
        surface = LANES(choose_surfaces)(is_triangle, triangles, surface);
    }
    return surface;
}

// Transform by rows of an affine matrix, and by the transpose of its 3 x 3 part.
CASTOR_INLINE LANES(Vectors) LANES(rows_times)(const global float (*m)[4], const LANES(Vectors) v, const float w)
{
    return LANES(vectors)(
        fma((Real)(m[0][0]), v.x, fma((Real)(m[0][1]), v.y, fma((Real)(m[0][2]), v.z, (Real)(m[0][3] * w)))),
        fma((Real)(m[1][0]), v.x, fma((Real)(m[1][1]), v.y, fma((Real)(m[1][2]), v.z, (Real)(m[1][3] * w)))),
        fma((Real)(m[2][0]), v.x, fma((Real)(m[2][1]), v.y, fma((Real)(m[2][2]), v.z, (Real)(m[2][3] * w)))));
}

CASTOR_INLINE LANES(Vectors) LANES(columns_times)(const global float (*m)[4], const LANES(Vectors) v)
{
    return LANES(vectors)(fma((Real)(m[0][0]), v.x, fma((Real)(m[1][0]), v.y, m[2][0] * v.z)),
                          fma((Real)(m[0][1]), v.x, fma((Real)(m[1][1]), v.y, m[2][1] * v.z)),
                          fma((Real)(m[0][2]), v.x, fma((Real)(m[1][2]), v.y, m[2][2] * v.z)));
}

// The inverse transpose takes normals to the world. What comes in is brought to a size near 1 before it is squared,
// since the matrix may scale a lot.
CASTOR_INLINE LANES(Vectors) LANES(world_normals)(const global Instance *instance, const LANES(Vectors) normal)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Vectors) n = LANES(columns_times)(instance->to_object, normal);
    const Real largest = LANES(largest_components)(n);
    const Mask has_length = largest > 0.0f;
    const LANES(Vectors) scaled = LANES(scaled_vectors)(n, LANES(divide)(one, has_length ? largest : one));
    return LANES(choose_vectors)(has_length, LANES(normalized_vectors)(scaled), n);
}

// Returns the surfaces, in the object's space, of hits in an instance other than 0, where `counts`. Positions of
// spheres lie on the rays.
CASTOR_INLINE LANES(Surfaces)
    LANES(surfaces_in_instance)(const SurfaceColumns columns, const global Instance *instance, const Mask counts,
                                const Whole primitive, const Real t, const Real u, const Real v,
                                const LANES(Vectors) origin, const LANES(Vectors) direction)
{
    const Mask is_triangle = counts & (primitive < columns.params.triangle_count);
    const Mask is_sphere = counts & !is_triangle;
    const global float(*m)[4] = instance->to_object;
    const LANES(Vectors) along = LANES(rows_times)(m, direction, 0.0f);
    LANES(Surfaces) surface = LANES(no_surfaces)();
    if (LANES(mask_of)(is_triangle)) surface = LANES(triangle_surfaces)(columns, is_triangle, primitive, u, v, along);
    if (LANES(mask_of)(is_sphere)) {
        const LANES(Vectors) point = LANES(points_on_rays)(LANES(rows_times)(m, origin, 1.0f), t, along);
        const Whole sphere = is_sphere ? primitive - columns.params.triangle_count : (Whole)(0);
        const LANES(Surfaces) spheres =
            LANES(sphere_surfaces)(point, LANES(gather_rows)(columns.sphere_center_radius, sphere), (Whole)(0));
        surface = LANES(choose_surfaces)(is_sphere, spheres, surface);
    }
    return surface;
}
