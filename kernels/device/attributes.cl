// What vertices have for principled materials, where a ray met a triangle. A source that includes this defines
// CASTOR_SURFACES_HAVE_UVS as 1 before all else.
#include "device/sphere_coordinates.x1.cl"
#include "device/surface_of_hit.cl"

// Returns the mesh of a primitive; one without attributes of vertices for what is no triangle. `primitive`: what
// primitive_of_hit says of a hit.
CASTOR_INLINE MeshRange mesh_of_primitive(const SurfaceColumns columns, const uint primitive)
{
    const MeshRange none = {0u, 0u, CASTOR_INVALID_INDEX, 0u, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX, {0u, 0u}};
    if (primitive >= columns.params.triangle_count) return none;
    return mesh_of_triangle(columns.mesh_ranges, columns.params.mesh_count, primitive);
}

// Returns what the vertices of a triangle say together where it was hit; without attributes: no tangent, white, (0, 0).
// `mesh`: what mesh_of_primitive says of `primitive`.
CASTOR_INLINE VertexAttributes attributes_of_hit(const SurfaceColumns columns,
                                                 const global VertexAttributes *restrict vertex_attributes,
                                                 const MeshRange mesh, const uint primitive, const Hit hit)
{
    VertexAttributes sum = {{0.0f, 0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f, 1.0f}, {0.0f, 0.0f}, {0u, 0u}};
    if (mesh.first_attributes == CASTOR_INVALID_INDEX) return sum;
    const uint shift = mesh.first_attributes - mesh.first_vertex;  // modulo 2^32
    const global uint *const corners = columns.triangle_vertices + (size_t)3 * primitive;
    const VertexAttributes a = vertex_attributes[corners[0] + shift], b = vertex_attributes[corners[1] + shift],
                           c = vertex_attributes[corners[2] + shift];
    const float u = hit.u, v = hit.v, w = 1.0f - u - v;
    for (int i = 0; i < 3; ++i) sum.tangent[i] = fma(w, a.tangent[i], fma(u, b.tangent[i], v * c.tangent[i]));
    sum.tangent[3] = a.tangent[3];
    for (int i = 0; i < 4; ++i) sum.color[i] = fma(w, a.color[i], fma(u, b.color[i], v * c.color[i]));
    for (int i = 0; i < 2; ++i) sum.uv_1[i] = fma(w, a.uv_1[i], fma(u, b.uv_1[i], v * c.uv_1[i]));
    return sum;
}

// Returns twice the area of a triangle in the second coordinates; 0 of all else. `mesh`: as in attributes_of_hit.
CASTOR_INLINE float second_area(const SurfaceColumns columns, const global VertexAttributes *restrict vertex_attributes,
                                const MeshRange mesh, const uint primitive)
{
    if (mesh.first_attributes == CASTOR_INVALID_INDEX) return 0.0f;
    const uint shift = mesh.first_attributes - mesh.first_vertex;  // modulo 2^32
    const global uint *const corners = columns.triangle_vertices + (size_t)3 * primitive;
    const float2 a = vload2(0, vertex_attributes[corners[0] + shift].uv_1);
    const float2 e1 = vload2(0, vertex_attributes[corners[1] + shift].uv_1) - a;
    const float2 e2 = vload2(0, vertex_attributes[corners[2] + shift].uv_1) - a;
    return fabs(fma(e1.x, e2.y, -(e2.x * e1.y)));
}
