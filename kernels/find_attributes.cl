// One work-item a path. Writes what principled materials need to know of the surface that its ray met, if the chunk has
// it: texture coordinates of both sets; the tangent, and in w how large the first set's are there (TexturePlaces), with
// the sign of the bitangent; the colour of vertices, and in w how large the second set's are.
#define CASTOR_SURFACES_HAVE_UVS 1
#define CASTOR_SURFACES_HAVE_AXES 1
#include "castor/shared/wave_columns.h"
#include "device/attributes.cl"

kernel void find_attributes(const uint path_count, CASTOR_SURFACE_PARAMETERS, const global float *restrict vertex_uv,
                            const global VertexAttributes *restrict vertex_attributes, CASTOR_READ(ray_origin_tmin),
                            CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits), CASTOR_WRITE(surface_uvs),
                            CASTOR_WRITE(surface_tangent), CASTOR_WRITE(surface_color))
{
    const uint place = get_global_id(0);
    if (place >= path_count) return;
    const Hit hit = hits[place];
    if (hit.primitive == CASTOR_INVALID_INDEX) return;
    SurfaceColumns columns = make_surface_columns(CASTOR_SURFACE_ARGUMENTS);
    columns.vertex_uv = vertex_uv;
    const uint primitive = primitive_of_hit(columns, hit);
    if (primitive == CASTOR_INVALID_INDEX) return;
    const MeshRange mesh = mesh_of_primitive(columns, primitive);
    const int is_triangle = primitive < columns.params.triangle_count;
    if (is_triangle && mesh.first_uv == CASTOR_INVALID_INDEX && mesh.first_attributes == CASTOR_INVALID_INDEX) {
        surface_uvs[place] = surface_tangent[place] = (float4)(0.0f);
        surface_color[place] = (float4)(1.0f, 1.0f, 1.0f, 0.0f);
        return;
    }
    Surfaces surface =
        surface_in_object(columns, primitive, hit, ray_origin_tmin[place].xyz, ray_direction_tmax[place].xyz);
    add_coordinates_of_spheres(&surface, columns, 1, primitive);
    const VertexAttributes attributes = attributes_of_hit(columns, vertex_attributes, mesh, primitive, hit);

    // The second axis is against v, which points down in pictures of glTF: green of a normal map is up.
    const Axes axis = axes_of_edges(surface.edge);
    Vectors normal = surface.normal, along_u = axis.along_u, along_v = axis.along_v;
    Vectors e1 = surface.edge.e1, e2 = surface.edge.e2;
    Vectors tangent = vectors(attributes.tangent[0], attributes.tangent[1], attributes.tangent[2]);
    const int is_given = dot_products(tangent, tangent) > 0.0f;
    Vectors up = is_given ? scaled_vectors(cross_products(normal, tangent), attributes.tangent[3])
                          : scaled_vectors(along_v, -1.0f);
    if (hit.instance != 0) {
        const global Instance *const instance = columns.instances + hit.instance;
        const global float(*const to_world)[4] = instance->to_world;
        normal = world_normals(instance, normal);
        along_u = rows_times(to_world, along_u, 0.0f);
        along_v = rows_times(to_world, along_v, 0.0f);
        e1 = rows_times(to_world, e1, 0.0f);
        e2 = rows_times(to_world, e2, 0.0f);
        tangent = rows_times(to_world, tangent, 0.0f);
        up = rows_times(to_world, up, 0.0f);
    }
    if (!is_given) tangent = along_u;
    tangent = normalized_vectors(tangent);
    const Vectors area = cross_products(along_u, along_v);  // of a whole picture
    const float length_of_picture = square_root(square_root(dot_products(area, area)));
    const float uvs_per_length = length_of_picture > 0.0f ? divide(1.0f, length_of_picture) : 0.0f;
    const Vectors of_triangle = cross_products(e1, e2);  // twice its area
    const float length_of_triangle = square_root(square_root(dot_products(of_triangle, of_triangle)));
    const float second_length = square_root(second_area(columns, vertex_attributes, mesh, primitive));
    const float second_per_length = length_of_triangle > 0.0f ? divide(second_length, length_of_triangle) : 0.0f;
    const float side = dot_products(cross_products(normal, tangent), up) < 0.0f ? -1.0f : 1.0f;
    surface_uvs[place] = (float4)(surface.uv.x, surface.uv.y, attributes.uv_1[0], attributes.uv_1[1]);
    surface_tangent[place] = (float4)(tangent.x, tangent.y, tangent.z, side * uvs_per_length);
    surface_color[place] = (float4)(attributes.color[0], attributes.color[1], attributes.color[2], second_per_length);
}
