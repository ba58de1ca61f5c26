// Where rays met primitives, as shading needs it, for CASTOR_LANES lanes (see lanes.cl).
#include "device/surface.cl"
#include "device/vector.lanes.cl"

typedef struct LANES(Surfaces) {
    LANES(Vectors) position;
    LANES(Vectors) normal;  // unit, outward: never turned towards the viewer
    Whole material;
#if CASTOR_SURFACES_HAVE_UVS
    LANES(Twos) uv;  // of triangles; (0,0) of all else
#endif
} LANES(Surfaces);

// The ranges of meshes that hold triangles.
typedef struct LANES(Meshes) {
    Whole first_vertex;
    Whole first_normal;
    Whole first_uv;
    Whole material;
} LANES(Meshes);

CASTOR_INLINE LANES(Meshes) LANES(same_meshes)(const MeshRange range)
{
    LANES(Meshes) mesh;
    mesh.first_vertex = (Whole)(range.first_vertex);
    mesh.first_normal = (Whole)(range.first_normal);
    mesh.first_uv = (Whole)(range.first_uv);
    mesh.material = (Whole)(range.material);
    return mesh;
}

CASTOR_INLINE LANES(Meshes) LANES(meshes_of_triangles)(const global MeshRange *restrict mesh_ranges,
                                                       const uint mesh_count, const Whole triangle)
{
#if CASTOR_LANES == 1
    return same_meshes(mesh_of_triangle(mesh_ranges, mesh_count, triangle));
#else
    if (mesh_count == 1) return LANES(same_meshes)(mesh_ranges[0]);
    uint triangles[CASTOR_LANES], first_vertex[CASTOR_LANES], first_normal[CASTOR_LANES], first_uv[CASTOR_LANES];
    uint material[CASTOR_LANES];
    LANES(store_wholes)(triangle, triangles);
    for (uint lane = 0; lane < CASTOR_LANES; ++lane) {
        const MeshRange range = mesh_of_triangle(mesh_ranges, mesh_count, triangles[lane]);
        first_vertex[lane] = range.first_vertex;
        first_normal[lane] = range.first_normal;
        first_uv[lane] = range.first_uv;
        material[lane] = range.material;
    }
    LANES(Meshes) mesh;
    mesh.first_vertex = LANES(vload)(0, first_vertex);
    mesh.first_normal = LANES(vload)(0, first_normal);
    mesh.first_uv = LANES(vload)(0, first_uv);
    mesh.material = LANES(vload)(0, material);
    return mesh;
#endif
}

CASTOR_INLINE LANES(Vectors) LANES(weighted_sums)(const LANES(Vectors) a, const LANES(Vectors) b,
                                                  const LANES(Vectors) c, const Real u, const Real v)
{
    const Real w = 1.0f - u - v;
    return LANES(vectors)(fma(w, a.x, fma(u, b.x, v * c.x)), fma(w, a.y, fma(u, b.y, v * c.y)),
                          fma(w, a.z, fma(u, b.z, v * c.z)));
}

// Returns the largest component, in magnitude.
CASTOR_INLINE Real LANES(largest_components)(const LANES(Vectors) a)
{
    return LANES(larger)(fabs(a.x), LANES(larger)(fabs(a.y), fabs(a.z)));
}

// Returns the normals (p1-p0) x (p2-p0), unit. The edges are brought to a size near 1 first, so that the products of
// tiny triangles do not vanish.
CASTOR_INLINE LANES(Vectors)
    LANES(geometric_normals)(const LANES(Vectors) p0, const LANES(Vectors) p1, const LANES(Vectors) p2)
{
    const LANES(Vectors) e1 = LANES(difference_of_vectors)(p1, p0);
    const LANES(Vectors) e2 = LANES(difference_of_vectors)(p2, p0);
    const Real one = (Real)(1.0f);
    const LANES(Vectors) a = LANES(scaled_vectors)(e1, LANES(divide)(one, LANES(largest_components)(e1)));
    const LANES(Vectors) b = LANES(scaled_vectors)(e2, LANES(divide)(one, LANES(largest_components)(e2)));
    return LANES(normalized_vectors)(LANES(cross_products)(a, b));
}

#if CASTOR_SURFACES_HAVE_UVS
// Returns the texture coordinates of corners of triangles in these meshes; (0,0) where a mesh has none.
CASTOR_INLINE LANES(Twos)
    LANES(uvs_of_corners)(const SurfaceColumns columns, const LANES(Meshes) mesh, const Whole corner)
{
    const Mask has_uvs = mesh.first_uv != CASTOR_INVALID_INDEX;
    const Whole shift = mesh.first_uv - mesh.first_vertex;  // modulo 2^32
    const Real zero = (Real)(0.0f);
    LANES(Twos) uv = {zero, zero};
    if (LANES(mask_of)(has_uvs)) {
        const LANES(Twos) found = LANES(gather_twos)(columns.vertex_uv, has_uvs ? corner + shift : (Whole)(0), 2);
        uv.x = has_uvs ? found.x : zero;
        uv.y = has_uvs ? found.y : zero;
    }
    return uv;
}
#endif

CASTOR_ONCE LANES(Surfaces)
    LANES(triangle_surfaces)(const SurfaceColumns columns, const Whole triangle, const Real u, const Real v)
{
    const Whole corner0 = LANES(gather_wholes)(columns.triangle_vertices, triangle, 3);
    const Whole corner1 = LANES(gather_wholes)(columns.triangle_vertices + 1, triangle, 3);
    const Whole corner2 = LANES(gather_wholes)(columns.triangle_vertices + 2, triangle, 3);
    const LANES(Vectors) p0 = LANES(gather_threes)(columns.vertex_position, corner0);
    const LANES(Vectors) p1 = LANES(gather_threes)(columns.vertex_position, corner1);
    const LANES(Vectors) p2 = LANES(gather_threes)(columns.vertex_position, corner2);
    const LANES(Meshes) mesh = LANES(meshes_of_triangles)(columns.mesh_ranges, columns.params.mesh_count, triangle);
    const Real zero = (Real)(0.0f);
    LANES(Surfaces) surface;
    surface.position = LANES(weighted_sums)(p0, p1, p2, u, v);
    surface.normal = LANES(vectors)(zero, zero, zero);
    surface.material = mesh.material;
#if CASTOR_SURFACES_HAVE_UVS
    const LANES(Twos) uv0 = LANES(uvs_of_corners)(columns, mesh, corner0);
    const LANES(Twos) uv1 = LANES(uvs_of_corners)(columns, mesh, corner1);
    const LANES(Twos) uv2 = LANES(uvs_of_corners)(columns, mesh, corner2);
    const Real w = 1.0f - u - v;
    surface.uv.x = fma(w, uv0.x, fma(u, uv1.x, v * uv2.x));
    surface.uv.y = fma(w, uv0.y, fma(u, uv1.y, v * uv2.y));
#endif
    const Mask is_smooth = mesh.first_normal != CASTOR_INVALID_INDEX;
    if (LANES(mask_of)(is_smooth)) {
        const Whole shift = mesh.first_normal - mesh.first_vertex;  // modulo 2^32
        const Whole first = is_smooth ? corner0 + shift : (Whole)(0);
        const Whole second = is_smooth ? corner1 + shift : (Whole)(0);
        const Whole third = is_smooth ? corner2 + shift : (Whole)(0);
        const LANES(Vectors) sum = LANES(weighted_sums)(LANES(gather_threes)(columns.vertex_normal, first),
                                                        LANES(gather_threes)(columns.vertex_normal, second),
                                                        LANES(gather_threes)(columns.vertex_normal, third), u, v);
        surface.normal = LANES(choose_vectors)(is_smooth, LANES(normalized_vectors)(sum), surface.normal);
    }
    const Mask is_flat = LANES(dot_products)(surface.normal, surface.normal) == 0.0f;
    if (LANES(mask_of)(is_flat))
        surface.normal = LANES(choose_vectors)(is_flat, LANES(geometric_normals)(p0, p1, p2), surface.normal);
    return surface;
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
    return surface;
}

CASTOR_INLINE LANES(Surfaces) LANES(choose_surfaces)(const Mask is_a, const LANES(Surfaces) a, const LANES(Surfaces) b)
{
    LANES(Surfaces) surface;
    surface.position = LANES(choose_vectors)(is_a, a.position, b.position);
    surface.normal = LANES(choose_vectors)(is_a, a.normal, b.normal);
    surface.material = is_a ? a.material : b.material;
#if CASTOR_SURFACES_HAVE_UVS
    surface.uv.x = is_a ? a.uv.x : b.uv.x;
    surface.uv.y = is_a ? a.uv.y : b.uv.y;
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
        const LANES(Surfaces) triangles = LANES(triangle_surfaces)(columns, is_triangle ? primitive : (Whole)(0), u, v);
        surface = LANES(choose_surfaces)(is_triangle, triangles, surface);
    }
    return surface;
}

// Transform by rows of an affine matrix, and by the transpose of its 3 x 3 part.
CASTOR_INLINE LANES(Vectors) LANES(rows_times)(const global float *m, const LANES(Vectors) v, const float w)
{
    return LANES(vectors)(fma((Real)(m[0]), v.x, fma((Real)(m[1]), v.y, fma((Real)(m[2]), v.z, (Real)(m[3] * w)))),
                          fma((Real)(m[4]), v.x, fma((Real)(m[5]), v.y, fma((Real)(m[6]), v.z, (Real)(m[7] * w)))),
                          fma((Real)(m[8]), v.x, fma((Real)(m[9]), v.y, fma((Real)(m[10]), v.z, (Real)(m[11] * w)))));
}

CASTOR_INLINE LANES(Vectors) LANES(columns_times)(const global float *m, const LANES(Vectors) v)
{
    return LANES(vectors)(fma((Real)(m[0]), v.x, fma((Real)(m[4]), v.y, m[8] * v.z)),
                          fma((Real)(m[1]), v.x, fma((Real)(m[5]), v.y, m[9] * v.z)),
                          fma((Real)(m[2]), v.x, fma((Real)(m[6]), v.y, m[10] * v.z)));
}

// The inverse transpose takes normals to the world. What comes in is brought to a size near 1 before it is squared,
// since the matrix may scale a lot.
CASTOR_INLINE LANES(Vectors) LANES(world_normals)(const global Instance *instance, const LANES(Vectors) normal)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Vectors) n = LANES(columns_times)(&instance->to_object[0][0], normal);
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
    LANES(Surfaces) surface = LANES(no_surfaces)();
    if (LANES(mask_of)(is_triangle))
        surface = LANES(triangle_surfaces)(columns, is_triangle ? primitive : (Whole)(0), u, v);
    if (LANES(mask_of)(is_sphere)) {
        const global float *m = &instance->to_object[0][0];
        const LANES(Vectors) point =
            LANES(points_on_rays)(LANES(rows_times)(m, origin, 1.0f), t, LANES(rows_times)(m, direction, 0.0f));
        const Whole sphere = is_sphere ? primitive - columns.params.triangle_count : (Whole)(0);
        const LANES(Surfaces) spheres =
            LANES(sphere_surfaces)(point, LANES(gather_rows)(columns.sphere_center_radius, sphere), (Whole)(0));
        surface = LANES(choose_surfaces)(is_sphere, spheres, surface);
    }
    return surface;
}
