// Where one ray met a primitive of any instance.
#include "device/surface.x1.cl"

CASTOR_INLINE Vectors vectors_of(const float3 v) { return vectors(v.x, v.y, v.z); }

// Returns the material of a hit, which costs much less than its surface. `primitive`: what primitive_of_hit says of it.
CASTOR_INLINE uint material_of_hit(const SurfaceColumns columns, const uint primitive, const Hit hit)
{
    if (hit.instance != 0) return columns.instances[hit.instance].material;
    if (primitive < columns.params.triangle_count)
        return mesh_of_triangle(columns.mesh_ranges, columns.params.mesh_count, primitive).material;
    const uint sphere = primitive - columns.params.triangle_count;
    if (sphere < columns.params.sphere_count) return columns.sphere_material[sphere];
    return columns.plane_material[sphere - columns.params.sphere_count];
}

// Returns the surface of a hit in the space of what it hit; the material is that of the geometry. `primitive`: what
// primitive_of_hit says of the hit.
CASTOR_INLINE Surfaces surface_in_object(const SurfaceColumns columns, const uint primitive, const Hit hit,
                                         const float3 origin, const float3 direction)
{
    const Vectors from = vectors_of(origin), along = vectors_of(direction);
    if (hit.instance == 0) return surfaces_in_place(columns, 1, primitive, hit.t, hit.u, hit.v, from, along);
    return surfaces_in_instance(columns, columns.instances + hit.instance, 1, primitive, hit.t, hit.u, hit.v, from,
                                along);
}

// Returns the surface of a hit.
CASTOR_INLINE Surfaces surface_of_hit(const SurfaceColumns columns, const uint primitive, const Hit hit,
                                      const float3 origin, const float3 direction)
{
    Surfaces surface = surface_in_object(columns, primitive, hit, origin, direction);
    if (hit.instance == 0) return surface;
    const global Instance *instance = columns.instances + hit.instance;
    surface.position = rows_times(instance->to_world, surface.position, 1.0f);
    surface.normal = world_normals(instance, surface.normal);
    surface.material = instance->material;
    return surface;
}
