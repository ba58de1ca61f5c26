// What textures are functions of: a point of a surface in its object's own space, with texture coordinates and their
// axes.
#include "device/noise.cl"
#include "device/surface_of_hit.cl"
#include "device/texture_lookup.cl"

#define CASTOR_PI 3.1415927f

typedef struct TexturedPoint {
    float2 uv;
    float3 position;
    float3 normal;   // unit, outward
    float3 along_u;  // dp/du and dp/dv; both (0,0,0) where there are no texture coordinates
    float3 along_v;
} TexturedPoint;

// Returns the texture coordinates of a triangle's corner.
CASTOR_INLINE float2 uv_of_corner(const global float *restrict vertex_uv, const MeshRange mesh, const uint corner)
{
    return vload2((size_t)mesh.first_uv + (corner - mesh.first_vertex), vertex_uv);
}

// Interpolates texture coordinates. With `has_axes` solves e1 = du1 dp/du + dv1 dp/dv, e2 = du2 dp/du + dv2 dp/dv for
// the axes, too.
CASTOR_INLINE void place_on_triangle(TexturedPoint *point, const SurfaceColumns columns,
                                     const global float *restrict vertex_uv, const uint triangle, const float u,
                                     const float v, const int has_axes)
{
    const MeshRange mesh = mesh_of_triangle(columns.mesh_ranges, columns.params.mesh_count, triangle);
    if (mesh.first_uv == CASTOR_INVALID_INDEX) return;
    const uint3 corner = vload3(triangle, columns.triangle_vertices);
    const float2 uv0 = uv_of_corner(vertex_uv, mesh, corner.x);
    const float2 uv1 = uv_of_corner(vertex_uv, mesh, corner.y);
    const float2 uv2 = uv_of_corner(vertex_uv, mesh, corner.z);
    const float w = 1.0f - u - v;
    point->uv.x = fma(w, uv0.x, fma(u, uv1.x, v * uv2.x));
    point->uv.y = fma(w, uv0.y, fma(u, uv1.y, v * uv2.y));
    if (!has_axes) return;
    const float2 d1 = uv1 - uv0, d2 = uv2 - uv0;
    const float determinant = fma(d1.x, d2.y, -(d2.x * d1.y));
    if (!(fabs(determinant) >= FLT_MIN && fabs(determinant) <= FLT_MAX)) return;
    const float inverse = divide(1.0f, determinant);
    const float3 p0 = vload3(corner.x, columns.vertex_position);
    const float3 e1 = vload3(corner.y, columns.vertex_position) - p0;
    const float3 e2 = vload3(corner.z, columns.vertex_position) - p0;
    point->along_u = fma((float3)(d2.y), e1, -(d1.y * e2)) * inverse;
    point->along_v = fma((float3)(d1.x), e2, -(d2.x * e1)) * inverse;
}

// u = (pi - phi) / (2 pi), v = theta / pi with phi = atan2(z, x) and theta = acos(y / radius).
CASTOR_INLINE void place_on_sphere(TexturedPoint *point, const float radius)
{
    const float3 n = point->normal;
    const float around = square_root(fma(n.x, n.x, n.z * n.z));
    const float inverse = around > 0.0f ? divide(1.0f, around) : 0.0f;
    const float cos_phi = around > 0.0f ? n.x * inverse : 1.0f, sin_phi = n.z * inverse;
    point->uv.x = (CASTOR_PI - arc_tangent2(n.z, n.x)) * 0.15915494f;  // 1 / (2 pi)
    point->uv.y = arc_cosine(clamp(n.y, -1.0f, 1.0f)) * 0.31830987f;   // 1 / pi
    point->along_u = 2.0f * CASTOR_PI * radius * (float3)(n.z, 0.0f, -n.x);
    point->along_v = CASTOR_PI * radius * (float3)(n.y * cos_phi, -around, n.y * sin_phi);
}

// `primitive`: what primitive_of_hit says of the hit. `needs_all`: whether more of a triangle is asked for than texture
// coordinates.
CASTOR_INLINE TexturedPoint textured_point(const SurfaceColumns columns, const global float *restrict vertex_uv,
                                           const uint primitive, const Hit hit, const float3 origin,
                                           const float3 direction, const int needs_all)
{
    TexturedPoint point;
    point.uv = (float2)(0.0f);
    point.position = point.normal = point.along_u = point.along_v = (float3)(0.0f);
    const int is_triangle = primitive < columns.params.triangle_count;
    if (needs_all || !is_triangle) {
        const Surfaces surface = surface_in_object(columns, primitive, hit, origin, direction);
        point.position = float3_of(surface.position);
        point.normal = float3_of(surface.normal);
    }
    const uint sphere = primitive - columns.params.triangle_count;
    if (is_triangle)
        place_on_triangle(&point, columns, vertex_uv, primitive, hit.u, hit.v, needs_all);
    else if (sphere < columns.params.sphere_count)
        place_on_sphere(&point, columns.sphere_center_radius[sphere].w);
    return point;
}
