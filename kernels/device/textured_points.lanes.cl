// What textures are functions of: points of surfaces in the space of their objects, with texture coordinates and their
// axes. For CASTOR_LANES lanes (see lanes.cl).
#include "device/elementary.lanes.cl"
#include "device/surface.lanes.cl"

#define CASTOR_PI 3.1415927f

// dp/du and dp/dv; both (0,0,0) where there are no texture coordinates.
typedef struct LANES(Axes) {
    LANES(Vectors) along_u;
    LANES(Vectors) along_v;
} LANES(Axes);

typedef struct LANES(TexturedPoints) {
    LANES(Twos) uv;
    LANES(Vectors) position;
    LANES(Vectors) normal;  // unit, outward
    LANES(Axes) axis;
} LANES(TexturedPoints);

CASTOR_INLINE LANES(Axes) LANES(choose_axes)(const Mask is_a, const LANES(Axes) a, const LANES(Axes) b)
{
    LANES(Axes) axis;
    axis.along_u = LANES(choose_vectors)(is_a, a.along_u, b.along_u);
    axis.along_v = LANES(choose_vectors)(is_a, a.along_v, b.along_v);
    return axis;
}

// Solves e1 = du1 dp/du + dv1 dp/dv, e2 = du2 dp/du + dv2 dp/dv for the axes of triangles.
CASTOR_ONCE LANES(Axes) LANES(axes_of_triangles)(const SurfaceColumns columns, const Whole triangle)
{
    const LANES(Meshes) mesh = LANES(meshes_of_triangles)(columns.mesh_ranges, columns.params.mesh_count, triangle);
    const Whole corner0 = LANES(gather_wholes)(columns.triangle_vertices, triangle, 3);
    const Whole corner1 = LANES(gather_wholes)(columns.triangle_vertices + 1, triangle, 3);
    const Whole corner2 = LANES(gather_wholes)(columns.triangle_vertices + 2, triangle, 3);
    const LANES(Twos) uv0 = LANES(uvs_of_corners)(columns, mesh, corner0);
    const LANES(Twos) uv1 = LANES(uvs_of_corners)(columns, mesh, corner1);
    const LANES(Twos) uv2 = LANES(uvs_of_corners)(columns, mesh, corner2);
    const Real du1 = uv1.x - uv0.x, dv1 = uv1.y - uv0.y, du2 = uv2.x - uv0.x, dv2 = uv2.y - uv0.y;
    const Real determinant = fma(du1, dv2, -(du2 * dv1));
    const Mask is_usual = (fabs(determinant) >= FLT_MIN) & (fabs(determinant) <= FLT_MAX);
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    LANES(Axes) none;
    none.along_u = none.along_v = LANES(vectors)(zero, zero, zero);
    if (!LANES(mask_of)(is_usual)) return none;
    const Real inverse = LANES(divide)(one, is_usual ? determinant : one);
    const LANES(Vectors) p0 = LANES(gather_threes)(columns.vertex_position, corner0);
    const LANES(Vectors) e1 = LANES(difference_of_vectors)(LANES(gather_threes)(columns.vertex_position, corner1), p0);
    const LANES(Vectors) e2 = LANES(difference_of_vectors)(LANES(gather_threes)(columns.vertex_position, corner2), p0);
    LANES(Axes) axis;
    axis.along_u = LANES(vectors)(fma(dv2, e1.x, -(dv1 * e2.x)) * inverse, fma(dv2, e1.y, -(dv1 * e2.y)) * inverse,
                                  fma(dv2, e1.z, -(dv1 * e2.z)) * inverse);
    axis.along_v = LANES(vectors)(fma(du1, e2.x, -(du2 * e1.x)) * inverse, fma(du1, e2.y, -(du2 * e1.y)) * inverse,
                                  fma(du1, e2.z, -(du2 * e1.z)) * inverse);
    return LANES(choose_axes)(is_usual, axis, none);
}

// u = (pi - phi) / (2 pi), v = theta / pi with phi = atan2(z, x) and theta = acos(y / radius). `n`: the normal.
CASTOR_ONCE LANES(Twos) LANES(uvs_of_spheres)(const LANES(Vectors) n)
{
    const Real one = (Real)(1.0f);
    LANES(Twos) uv;
    uv.x = (CASTOR_PI - LANES(arc_tangent2)(n.z, n.x)) * 0.15915494f;  // 1 / (2 pi)
    uv.y = LANES(arc_cosine)(clamp(n.y, -one, one)) * 0.31830987f;     // 1 / pi
    return uv;
}

CASTOR_ONCE LANES(Axes) LANES(axes_of_spheres)(const LANES(Vectors) n, const Real radius)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real around = LANES(square_root)(fma(n.x, n.x, n.z * n.z));
    const Mask is_off_axis = around > 0.0f;
    const Real inverse = is_off_axis ? LANES(divide)(one, is_off_axis ? around : one) : zero;
    const Real cos_phi = is_off_axis ? n.x * inverse : one, sin_phi = n.z * inverse;
    const Real around_once = 2.0f * CASTOR_PI * radius, half_around = CASTOR_PI * radius;
    LANES(Axes) axis;
    axis.along_u = LANES(vectors)(around_once * n.z, zero, around_once * -n.x);
    axis.along_v = LANES(vectors)(half_around * (n.y * cos_phi), half_around * -around, half_around * (n.y * sin_phi));
    return axis;
}

// `primitive`: what primitive_of_hit says of the hits; `surface`: in the object's space, where `counts`. `has_axes`:
// whether these are asked for.
CASTOR_INLINE LANES(TexturedPoints)
    LANES(textured_points)(const SurfaceColumns columns, const Mask counts, const Whole primitive,
                           const LANES(Surfaces) surface, const int has_axes)
{
    const Real zero = (Real)(0.0f);
    LANES(TexturedPoints) point;
    point.uv = surface.uv;
    point.position = surface.position;
    point.normal = surface.normal;
    point.axis.along_u = point.axis.along_v = LANES(vectors)(zero, zero, zero);
    const Mask is_triangle = counts & (primitive < columns.params.triangle_count);
    const Whole sphere = primitive - columns.params.triangle_count;
    const Mask is_sphere = counts & !is_triangle & (sphere < columns.params.sphere_count);
    if (has_axes && LANES(mask_of)(is_triangle))
        point.axis = LANES(choose_axes)(
            is_triangle, LANES(axes_of_triangles)(columns, is_triangle ? primitive : (Whole)(0)), point.axis);
    if (LANES(mask_of)(is_sphere)) {
        const LANES(Twos) uv = LANES(uvs_of_spheres)(surface.normal);
        point.uv.x = is_sphere ? uv.x : point.uv.x;
        point.uv.y = is_sphere ? uv.y : point.uv.y;
        if (!has_axes) return point;
        const Real radius = LANES(gather_reals)((const global float *)columns.sphere_center_radius + 3,
                                                is_sphere ? sphere : (Whole)(0), 4);
        point.axis = LANES(choose_axes)(is_sphere, LANES(axes_of_spheres)(surface.normal, radius), point.axis);
    }
    return point;
}
