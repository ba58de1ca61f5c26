// The columns by which surfaces are found, and which primitive a hit names. Columns and counts are those of a chunk of
// the scene.
#include "castor/shared/layout.h"
#include "device/scene.cl"

// CASTOR_SURFACES_HAVE_UVS  1: surfaces have texture coordinates. A source that needs them defines it before all else
//                           and sets the column vertex_uv.
// CASTOR_SURFACES_HAVE_AXES 1: and the directions in which these grow.
#ifndef CASTOR_SURFACES_HAVE_UVS
#define CASTOR_SURFACES_HAVE_UVS 0
#endif
#ifndef CASTOR_SURFACES_HAVE_AXES
#define CASTOR_SURFACES_HAVE_AXES 0
#endif

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
#if CASTOR_SURFACES_HAVE_UVS
    const global float *vertex_uv;
#endif
} SurfaceColumns;

// The columns by which surfaces of triangles are found. `vertex_uv`: if they have texture coordinates.
typedef struct TriangleColumns {
    uint mesh_count;
    const global MeshRange *mesh_ranges;
    const global uint *triangle_vertices;
    const global float *vertex_position;
    const global float *vertex_normal;
    const global float *vertex_uv;
} TriangleColumns;

CASTOR_INLINE SurfaceColumns make_surface_columns(CASTOR_SURFACE_PARAMETERS)
{
    SurfaceColumns columns;
    columns.params = params;
    CASTOR_SCENE_COLUMNS(CASTOR_SET_SURFACE_MEMBER)
    return columns;
}

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
