// Where a ray met a primitive, as shading needs it. Columns and counts are those of a chunk of the scene.
#include "castor/shared/layout.h"
#include "device/scene.cl"

#define CASTOR_SURFACE_PARAMETER(name, host, element, per, place, made, trace, surface) \
    CASTOR_PARAMETER_##surface(name, element)
#define CASTOR_SURFACE_ARGUMENT(name, host, element, per, place, made, trace, surface) CASTOR_ARGUMENT_##surface(name)
#define CASTOR_SURFACE_MEMBER(name, host, element, per, place, made, trace, surface) \
    CASTOR_MEMBER_##surface(name, element)
#define CASTOR_SET_SURFACE_MEMBER(name, host, element, per, place, made, trace, surface) \
    CASTOR_SET_MEMBER_##surface(name)

// The parameters that describe a chunk's surfaces: the struct TraceParams, then the columns that find_surface reads.
#define CASTOR_SURFACE_PARAMETERS const TraceParams params CASTOR_SCENE_COLUMNS(CASTOR_SURFACE_PARAMETER)
#define CASTOR_SURFACE_ARGUMENTS params CASTOR_SCENE_COLUMNS(CASTOR_SURFACE_ARGUMENT)

// The same as a value that functions pass on.
typedef struct SurfaceColumns {
    TraceParams params;
    CASTOR_SCENE_COLUMNS(CASTOR_SURFACE_MEMBER)
} SurfaceColumns;

CASTOR_INLINE SurfaceColumns make_surface_columns(CASTOR_SURFACE_PARAMETERS)
{
    SurfaceColumns columns;
    columns.params = params;
    CASTOR_SCENE_COLUMNS(CASTOR_SET_SURFACE_MEMBER)
    return columns;
}

typedef struct Surface {
    float3 position;
    float3 normal;  // unit, outward: never turned towards the viewer
    uint material;
} Surface;

// The place of a number among ascending ones at [first, first + count); CASTOR_INVALID_INDEX: it is not there.
CASTOR_INLINE uint place_of_number(const global uint *restrict numbers, uint first, uint count, const uint number)
{
    const uint end = first + count;
    while (count > 0) {
        const uint half_count = count / 2;
        if (numbers[first + half_count] < number) {
            first += half_count + 1;
            count -= half_count + 1;
        } else {
            count = half_count;
        }
    }
    return first < end && numbers[first] == number ? first : CASTOR_INVALID_INDEX;
}

// What a hit names, as the chunk numbers triangles of all geometries, then spheres, then planes; CASTOR_INVALID_INDEX:
// it is in another chunk.
CASTOR_INLINE uint primitive_of_hit(const SurfaceColumns columns, const Hit hit)
{
    const uint geometry_index = hit.instance == 0 ? 0 : columns.instances[hit.instance].geometry;
    const Geometry geometry = columns.geometries[geometry_index];
    const uint first_sphere = columns.params.triangle_count + geometry.first_sphere;
    const uint first_plane = columns.params.triangle_count + columns.params.sphere_count;
    if (columns.params.number_count == 0) {
        if (hit.primitive < geometry.triangle_count) return geometry.first_triangle + hit.primitive;
        const uint after_triangles = hit.primitive - geometry.triangle_count;
        return after_triangles < geometry.sphere_count ? first_sphere + after_triangles
                                                       : first_plane + after_triangles - geometry.sphere_count;
    }
    uint found =
        place_of_number(columns.primitive_numbers, geometry.first_triangle, geometry.triangle_count, hit.primitive);
    if (found == CASTOR_INVALID_INDEX)
        found = place_of_number(columns.primitive_numbers, first_sphere, geometry.sphere_count, hit.primitive);
    if (found == CASTOR_INVALID_INDEX && geometry_index == 0)
        found = place_of_number(columns.primitive_numbers, first_plane, columns.params.plane_count, hit.primitive);
    return found;
}

CASTOR_INLINE float3 weighted_sum(const float3 a, const float3 b, const float3 c, const float u, const float v)
{
    const float w = 1.0f - u - v;
    return (float3)(fma(w, a.x, fma(u, b.x, v * c.x)), fma(w, a.y, fma(u, b.y, v * c.y)),
                    fma(w, a.z, fma(u, b.z, v * c.z)));
}

// The normal (p1-p0) x (p2-p0), unit. The edges are brought to a size near 1 first, so that the products of tiny
// triangles do not vanish.
CASTOR_INLINE float3 geometric_normal(const float3 p0, const float3 p1, const float3 p2)
{
    const float3 e1 = p1 - p0;
    const float3 e2 = p2 - p0;
    const float3 a1 = fabs(e1);
    const float3 a2 = fabs(e2);
    const float s1 = larger(a1.x, larger(a1.y, a1.z));
    const float s2 = larger(a2.x, larger(a2.y, a2.z));
    return normalized(cross_product(e1 * divide(1.0f, s1), e2 * divide(1.0f, s2)));
}

CASTOR_INLINE Surface triangle_surface(const SurfaceColumns columns, const uint triangle, const Hit hit)
{
    const uint3 corner = vload3(triangle, columns.triangle_vertices);
    const float3 p0 = vload3(corner.x, columns.vertex_position);
    const float3 p1 = vload3(corner.y, columns.vertex_position);
    const float3 p2 = vload3(corner.z, columns.vertex_position);
    const MeshRange mesh = mesh_of_triangle(columns.mesh_ranges, columns.params.mesh_count, triangle);
    Surface surface;
    surface.position = weighted_sum(p0, p1, p2, hit.u, hit.v);
    surface.normal = (float3)(0.0f);
    surface.material = mesh.material;
    if (mesh.first_normal != CASTOR_INVALID_INDEX) {
        const uint shift = mesh.first_normal - mesh.first_vertex;  // modulo 2^32
        surface.normal = normalized(weighted_sum(vload3(corner.x + shift, columns.vertex_normal),
                                                 vload3(corner.y + shift, columns.vertex_normal),
                                                 vload3(corner.z + shift, columns.vertex_normal), hit.u, hit.v));
    }
    if (dot_product(surface.normal, surface.normal) == 0.0f) surface.normal = geometric_normal(p0, p1, p2);
    return surface;
}

CASTOR_INLINE Surface sphere_surface(const float3 point, const float4 center_radius, const uint material)
{
    Surface surface;
    surface.normal = normalized(point - center_radius.xyz);
    surface.position = point_on_ray(center_radius.xyz, center_radius.w, surface.normal);
    surface.material = material;
    return surface;
}

CASTOR_INLINE float3 rows_times(const global float *m, const float3 v, const float w)
{
    return (float3)(fma(m[0], v.x, fma(m[1], v.y, fma(m[2], v.z, m[3] * w))),
                    fma(m[4], v.x, fma(m[5], v.y, fma(m[6], v.z, m[7] * w))),
                    fma(m[8], v.x, fma(m[9], v.y, fma(m[10], v.z, m[11] * w))));
}

CASTOR_INLINE float3 columns_times(const global float *m, const float3 v)
{
    return (float3)(fma(m[0], v.x, fma(m[4], v.y, m[8] * v.z)), fma(m[1], v.x, fma(m[5], v.y, m[9] * v.z)),
                    fma(m[2], v.x, fma(m[6], v.y, m[10] * v.z)));
}

// The inverse transpose takes normals to the world. What comes in is brought to a size near 1 before it is squared,
// since the matrix may scale a lot.
CASTOR_INLINE float3 world_normal(const global Instance *instance, const float3 normal)
{
    const float3 n = columns_times(&instance->to_object[0][0], normal);
    const float3 a = fabs(n);
    const float largest = larger(a.x, larger(a.y, a.z));
    return largest > 0.0f ? normalized(n * divide(1.0f, largest)) : n;
}

// A hit of an instance other than 0.
CASTOR_INLINE Surface instance_surface(const SurfaceColumns columns, const uint primitive, const Hit hit,
                                       const float3 origin, const float3 direction)
{
    const global Instance *instance = columns.instances + hit.instance;
    Surface surface;
    if (primitive < columns.params.triangle_count) {
        surface = triangle_surface(columns, primitive, hit);
    } else {
        const global float *m = &instance->to_object[0][0];
        const float3 point = point_on_ray(rows_times(m, origin, 1.0f), hit.t, rows_times(m, direction, 0.0f));
        surface = sphere_surface(point, columns.sphere_center_radius[primitive - columns.params.triangle_count], 0);
    }
    surface.position = rows_times(&instance->to_world[0][0], surface.position, 1.0f);
    surface.normal = world_normal(instance, surface.normal);
    surface.material = instance->material;
    return surface;
}

// `primitive`: what primitive_of_hit says of the hit.
CASTOR_INLINE Surface surface_of_hit(const SurfaceColumns columns, const uint primitive, const Hit hit,
                                     const float3 origin, const float3 direction)
{
    if (hit.instance != 0) return instance_surface(columns, primitive, hit, origin, direction);
    if (primitive < columns.params.triangle_count) return triangle_surface(columns, primitive, hit);
    const float3 point = point_on_ray(origin, hit.t, direction);
    const uint sphere = primitive - columns.params.triangle_count;
    if (sphere < columns.params.sphere_count)
        return sphere_surface(point, columns.sphere_center_radius[sphere], columns.sphere_material[sphere]);
    const uint plane = sphere - columns.params.sphere_count;
    Surface surface;
    surface.position = point;
    surface.normal = columns.plane_normal[plane].xyz;
    surface.material = columns.plane_material[plane];
    return surface;
}
